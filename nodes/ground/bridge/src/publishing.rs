//! What clients publish, sent into the domain.

use std::collections::HashMap;

use foxglove::websocket::{Client, ClientChannel, ClientChannelId, ClientId, Status};
use swath_bags::schema::{Schema, to_json, to_little_endian};
use swath_msgs::Interface;
use swath_ros::qos::Profile;
use swath_ros::{Cdr, Node, RawPublisher, graph};

use crate::listener::Wish;

/// Publishers at a time.
const PUBLISHERS: usize = 200;

/// Publishers, each of one client's channel.
#[derive(Default)]
pub struct Publishing {
    open: HashMap<(ClientId, ClientChannelId), (RawPublisher, Schema)>,
}

impl Publishing {
    /// Follows a wish; what cannot be done is told to its client.
    pub fn follow(&mut self, node: &Node, wish: Wish) {
        match wish {
            Wish::Advertise(client, channel) if self.open.len() >= PUBLISHERS => {
                refuse(&client, &format!("{} cannot be published: {PUBLISHERS} publishers are open", channel.topic));
            }
            Wish::Advertise(client, channel) => match advertise(node, &channel) {
                Ok(publisher) => {
                    self.open.insert((client.id(), channel.id), publisher);
                }
                Err(reason) => refuse(&client, &format!("{} cannot be published: {reason}", channel.topic)),
            },
            Wish::Unadvertise(client, channel) => {
                self.open.remove(&(client, channel));
            }
            Wish::Publish(client, channel, message) => {
                // One that was refused is told once.
                let Some((publisher, schema)) = self.open.get(&(client.id(), channel)) else { return };
                if let Err(reason) = publish(publisher, schema, &message) {
                    refuse(&client, &format!("a message of {} was not published: {reason}", publisher.topic()));
                }
            }
            Wish::Playback(_) => {}
        }
    }
}

/// Sends a message that has been read through: the mission need not find out that it is garbled.
fn publish(publisher: &RawPublisher, schema: &Schema, message: &[u8]) -> Result<(), String> {
    to_json(schema, message, &mut Vec::new()).map_err(|error| error.to_string())?;
    let cdr = to_little_endian(schema, message).map_err(|error| error.to_string())?;
    publisher.publish(Cdr::from_bytes(cdr)).map_err(|error| error.to_string())
}

fn advertise(node: &Node, channel: &ClientChannel) -> Result<(RawPublisher, Schema), String> {
    if channel.encoding != "cdr" {
        return Err(format!("its encoding is {:?}, expected \"cdr\"", channel.encoding));
    }
    let known = Interface::find(&channel.schema_name);
    let known = known.ok_or_else(|| format!("the type {:?} is not known here", channel.schema_name))?;
    let schema = Schema::parse(known.type_name, known.schema).map_err(|error| error.to_string())?;
    let name = |entry: &graph::Entry| node.names().resolve(entry.name).is_ok_and(|name| name == channel.topic);
    let entry = graph::TOPICS.iter().find(|entry| name(entry));
    if let Some(entry) = entry.filter(|entry| entry.type_name != known.type_name) {
        return Err(format!("its type is {}, not {}", entry.type_name, known.type_name));
    }
    let qos = entry.map_or(Profile::Event, |entry| entry.profile).qos();
    let publisher = node.raw_publisher(&channel.topic, known.type_name, &qos).map_err(|error| error.to_string())?;
    Ok((publisher, schema))
}

fn refuse(client: &Client, text: &str) {
    tracing::warn!("{text}");
    client.send_status(Status::warning(text));
}
