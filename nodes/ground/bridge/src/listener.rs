//! What clients do: subscriptions are served at once, everything else is handed on.

use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};

use foxglove::websocket::{
    ChannelView, Client, ClientChannel, ClientChannelId, ClientId, PlaybackControlRequest, PlaybackState,
    ServerListener,
};

use crate::latched::Kept;

/// What a client wishes.
pub enum Wish {
    /// To publish on a topic.
    Advertise(Client, ClientChannel),
    /// To publish no more.
    Unadvertise(ClientId, ClientChannelId),
    /// To publish a message.
    Publish(Client, ClientChannelId, Vec<u8>),
    /// To play, to pause, to look at another time.
    Playback(PlaybackControlRequest),
}

/// Hears the clients.
pub struct Listener {
    kept: Arc<Kept>,
    wishes: Mutex<Sender<Wish>>,
}

impl Listener {
    /// Hands wishes on.
    #[must_use]
    pub fn new(kept: Arc<Kept>, wishes: Sender<Wish>) -> Self {
        Self { kept, wishes: Mutex::new(wishes) }
    }

    fn hand_on(&self, wish: Wish) {
        // Nobody follows them any more when the bridge ends.
        let _ = self.wishes.lock().unwrap_or_else(PoisonError::into_inner).send(wish);
    }
}

impl ServerListener for Listener {
    fn on_subscribe(&self, client: Client, channel: ChannelView) {
        self.kept.send(channel.id(), client.sink_id());
    }

    fn on_client_advertise(&self, client: Client, channel: &ClientChannel) {
        self.hand_on(Wish::Advertise(client, channel.clone()));
    }

    fn on_client_unadvertise(&self, client: Client, channel: &ClientChannel) {
        self.hand_on(Wish::Unadvertise(client.id(), channel.id));
    }

    fn on_message_data(&self, client: Client, channel: &ClientChannel, payload: &[u8]) {
        self.hand_on(Wish::Publish(client, channel.id, payload.to_vec()));
    }

    fn on_playback_control_request(&self, request: PlaybackControlRequest) -> Option<PlaybackState> {
        self.hand_on(Wish::Playback(request));
        None
    }
}
