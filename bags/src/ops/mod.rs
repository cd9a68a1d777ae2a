//! What can be done with a finished bag.

pub mod cat;
mod checks;
pub mod copy;
pub mod info;
pub mod recover;
pub mod validate;
