//! What can be done with a finished bag.

pub mod cat;
mod checks;
pub mod convert;
pub mod copy;
pub mod info;
pub mod recover;
pub mod reindex;
mod report;
pub mod validate;

pub use report::{Report, TopicReport};

use crate::error::{BagError, chain};

/// Faults that are written out one by one; a badly damaged bag has as many as messages.
const MOST_FAULTS: usize = 1000;

/// Adds a fault to a list that does not grow without end.
fn note(faults: &mut Vec<String>, error: &BagError) {
    match faults.len() {
        len if len < MOST_FAULTS => faults.push(chain(error)),
        MOST_FAULTS => faults.push("and more".to_owned()),
        _ => {}
    }
}
