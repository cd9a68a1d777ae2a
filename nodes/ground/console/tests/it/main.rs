//! The console from outside: its page in a browser, its HTTP side, and that the bundle is of its sources.

mod bundle;
mod page;
mod server;
