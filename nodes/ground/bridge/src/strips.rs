//! Strips by their state as GeoJSON, one channel a state: a map panel draws all that it ever got of a channel.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use foxglove::messages::GeoJson;
use foxglove::{ChannelBuilder, Context, Encode as _, RawChannel};
use serde_json::{Value, json};
use swath_mission::requests::lifecycle::State;
use swath_msgs::swath_msgs::StripStatus;
use swath_node::stamp::{EARTH_FRAME, frame_in};

use crate::latched::{Kept, send_latched};
use crate::scene::{Ends, Scene};

/// A strip as a map draws it.
struct Drawn {
    state: State,
    feature: Value,
    ends: Ends,
}

/// All strips that are known, and what of them is not told yet.
pub struct Strips {
    context: Arc<Context>,
    kept: Arc<Kept>,
    namespace: String,
    channels: BTreeMap<u8, Arc<RawChannel>>,
    known: BTreeMap<u64, Drawn>,
    changed: BTreeSet<u8>,
    scene: Scene,
}

impl Strips {
    /// None yet.
    #[must_use]
    pub fn new(context: &Arc<Context>, kept: Arc<Kept>, namespace: &str) -> Self {
        let frame = frame_in(namespace, EARTH_FRAME);
        Self {
            scene: Scene::new(context, Arc::clone(&kept), namespace, frame),
            context: Arc::clone(context),
            kept,
            namespace: namespace.to_owned(),
            channels: BTreeMap::new(),
            known: BTreeMap::new(),
            changed: BTreeSet::new(),
        }
    }

    /// Takes in how a strip stands.
    pub fn take(&mut self, status: &StripStatus) {
        let Some(state) = State::from_number(status.state).filter(|_| status.strip.id != 0) else { return };
        self.changed.insert(state.number());
        let strip = &status.strip;
        let ends =
            [[strip.start_longitude_deg, strip.start_latitude_deg], [strip.end_longitude_deg, strip.end_latitude_deg]];
        let drawn = Drawn { state, feature: feature(status), ends };
        if let Some(before) = self.known.insert(status.strip.id, drawn) {
            self.changed.insert(before.state.number());
        }
    }

    /// Forgets all strips.
    pub fn forget(&mut self) {
        self.known.clear();
        self.changed.extend(self.channels.keys());
    }

    /// Tells of the states in which something has changed, each as a whole.
    pub fn tell(&mut self, log_time: u64) {
        if !self.changed.is_empty() {
            self.scene.tell(&self.groups(), log_time);
        }
        for state in std::mem::take(&mut self.changed) {
            let Some(channel) = self.channel(state) else { continue };
            let of_state = self.known.values().filter(|drawn| drawn.state.number() == state);
            let features: Vec<&Value> = of_state.map(|drawn| &drawn.feature).collect();
            let text = json!({ "type": "FeatureCollection", "features": features }).to_string();
            let mut message = Vec::new();
            match (GeoJson { geojson: text }).encode(&mut message) {
                Ok(()) => send_latched(&self.kept, &channel, log_time, &message),
                Err(error) => tracing::warn!("strips cannot be told: {error}"),
            }
        }
    }

    /// The strips of each state, with its colour.
    fn groups(&self) -> BTreeMap<&'static str, (&'static str, Vec<Ends>)> {
        // A state that nothing is in any more is told as well: it is drawn as nothing then.
        let mut groups: BTreeMap<_, _> =
            State::ALL.into_iter().map(|state| (state.name(), (colour(state.number()), Vec::new()))).collect();
        for drawn in self.known.values() {
            if let Some((_, strips)) = groups.get_mut(drawn.state.name()) {
                strips.push(drawn.ends);
            }
        }
        groups
    }

    /// The channel of a state, `strips/accepted` and so on, made when it is needed first.
    fn channel(&mut self, state: u8) -> Option<Arc<RawChannel>> {
        if let Some(channel) = self.channels.get(&state) {
            return Some(Arc::clone(channel));
        }
        let name = State::from_number(state)?.name().replace(' ', "_");
        let made = ChannelBuilder::new(format!("{}/strips/{name}", self.namespace))
            .message_encoding(GeoJson::get_message_encoding())
            .schema(GeoJson::get_schema())
            .context(&self.context)
            .build_raw();
        match made {
            Ok(channel) => Some(Arc::clone(self.channels.entry(state).or_insert(channel))),
            Err(error) => {
                tracing::warn!("no channel for strips that are {name}: {error}");
                None
            }
        }
    }
}

/// Colours of states, as the console's: Okabe and Ito's palette.
const COLOURS: [&str; 13] = [
    "#b0b8c0", "#cc79a7", "#e69f00", "#56b4e9", "#f0e442", "#ffffff", "#17b88a", "#8a8f98", "#8a8f98", "#a08a70",
    "#d55e00", "#6c7a89", "#17b88a",
];

fn colour(state: u8) -> &'static str {
    COLOURS.get(usize::from(state)).copied().unwrap_or("#ff00ff")
}

/// A strip as a feature. A line across the 180th meridian goes on beyond it: a map would draw it round the Earth.
fn feature(status: &StripStatus) -> Value {
    let strip = &status.strip;
    let from = strip.start_longitude_deg;
    let to = from + (strip.end_longitude_deg - from + 180.0).rem_euclid(360.0) - 180.0;
    let colour = colour(status.state);
    json!({
        "type": "Feature",
        "id": strip.id,
        "properties": {
            "name": strip.name,
            "strip": strip.id,
            "priority": strip.priority,
            "reason": status.reason,
            "style": { "color": colour, "weight": 3 },
        },
        "geometry": {
            "type": "LineString",
            "coordinates": [[from, strip.start_latitude_deg], [to, strip.end_latitude_deg]],
        },
    })
}

#[cfg(test)]
mod tests {
    use swath_msgs::swath_msgs::Strip;

    use super::*;

    fn status(id: u64, state: u8, from: f64, to: f64) -> StripStatus {
        let strip = Strip { id, start_longitude_deg: from, end_longitude_deg: to, ..Strip::default() };
        StripStatus { strip, state, ..StripStatus::default() }
    }

    #[test]
    fn a_line_across_the_date_line_does_not_go_round_the_earth() {
        let ends = |from, to| {
            let feature = feature(&status(1, 3, from, to));
            let places = feature["geometry"]["coordinates"].clone();
            (places[0][0].as_f64().unwrap(), places[1][0].as_f64().unwrap())
        };
        assert_eq!(ends(179.0, -179.0), (179.0, 181.0));
        assert_eq!(ends(-179.0, 179.0), (-179.0, -181.0));
        assert_eq!(ends(10.0, 12.0), (10.0, 12.0));
    }

    #[test]
    fn a_strip_that_changes_leaves_its_state() {
        let context = Context::new();
        let mut strips = Strips::new(&context, Arc::default(), "/swath");
        strips.take(&status(1, StripStatus::STATE_ACCEPTED, 0.0, 1.0));
        strips.take(&status(0, StripStatus::STATE_REJECTED, 0.0, 1.0));
        assert_eq!(strips.changed, BTreeSet::from([StripStatus::STATE_ACCEPTED]));
        strips.tell(0);
        assert!(strips.changed.is_empty());
        strips.take(&status(1, StripStatus::STATE_SCHEDULED, 0.0, 1.0));
        assert_eq!(strips.changed, BTreeSet::from([StripStatus::STATE_ACCEPTED, StripStatus::STATE_SCHEDULED]));
        strips.tell(1);
        assert_eq!(strips.channels.len(), 2);
        strips.forget();
        assert_eq!(strips.changed.len(), 2);
    }
}
