//! The bridge to Foxglove: topics of a flying mission or of a bag, with their schemas and bytes as they are, over
//! Foxglove's WebSocket protocol.
//!
//! `channels` is a sink of the tap, `latched` keeps the last message for who comes later; `strips` makes of requests
//! what a map panel draws, `scene` what a 3D panel draws; `listener` hears clients; `services` are called for them and
//! `publishing` sends for them, where that is allowed; `live` and `playback` are where messages come from.

mod channels;
mod command;
mod latched;
mod listener;
mod live;
mod playback;
mod publishing;
mod scene;
mod services;
mod strips;

pub use command::{BridgeArgs, run};
