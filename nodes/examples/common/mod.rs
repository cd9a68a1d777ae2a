//! What the examples share: flights and their operators, company on the domain, servers, long figures.

pub mod company;
pub mod flight;
pub mod look;
pub mod operator;
pub mod request;
pub mod server;
pub mod soak;
pub mod sortie;
pub mod witness;
