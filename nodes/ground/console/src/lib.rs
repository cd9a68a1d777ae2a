//! The console: what the ground knows of a mission, live or recorded, as a page in a browser and as an HTTP API.
//!
//! `ledger` keeps what is known as a list of facts that only grows; `live` fills it from topics and services, `replay`
//! from a bag; `http` tells it to browsers and hands in their commands at the `desks`.

mod api;
mod assets;
mod command;
mod desks;
mod facts;
mod guard;
mod http;
mod ledger;
mod live;
mod problem;
mod replay;
mod shared;
mod stream;

pub use assets::{ASSETS, Asset};
pub use command::{ConsoleArgs, run};
pub use facts::{Candidate, Fact};
pub use http::{Site, listen, serve};
pub use ledger::Ledger;
pub use replay::{Recording, read as read_bag};
pub use shared::Shared;
