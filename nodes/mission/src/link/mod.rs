//! The radio between ground and satellite: stations and passes, the protocol, what each end keeps.

pub mod config;
pub mod passes;
