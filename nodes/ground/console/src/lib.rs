//! The console: what the ground knows of a mission, live or recorded, as a page in a browser and as an HTTP API.
//!
//! `ledger` keeps what is known as a list of facts that only grows; `live` fills it from topics and services, `replay`
//! from a bag; `http` is the port and `routes` what is behind it: the page, its `api`, `stapi` and `features` for
//! programs. `guard` and `tokens` say who is let in; commands are handed in at the `desks`.
#![allow(unused_qualifications, reason = "what utoipa makes of parameters")]

mod api;
mod asked;
mod assets;
mod command;
mod desks;
mod extract;
mod facts;
mod features;
mod guard;
mod guests;
mod http;
mod ledger;
#[cfg(test)]
mod ledger_tests;
mod live;
mod newest;
mod numbers;
mod presence;
mod problem;
mod replay;
mod routes;
mod schemas;
mod server;
mod shapes;
mod shared;
mod stapi;
mod stream;
mod telemetry;
mod ticks;
mod times;
mod tokens;
mod wishes;

pub use assets::{ASSETS, Asset};
pub use command::{ConsoleArgs, run};
pub use facts::{Candidate, Fact};
pub use guard::{Caller, Guard};
pub use http::{listen, serve, tls};
pub use ledger::Ledger;
pub use newest::Newest;
pub use replay::{Recording, read as read_bag};
pub use routes::description;
pub use server::Site;
pub use shared::Shared;
pub use telemetry::{Link, Pass, Plan, Planned, Resources};
pub use tokens::{Role, Token, Tokens};
