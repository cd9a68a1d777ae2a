//! The console from outside: its page in a browser, its HTTP side, and that the bundle is of its sources.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod bundle;
mod doors;
mod gdal;
mod hostile;
mod page;
mod server;
