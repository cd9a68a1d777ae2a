//! What can be done with a finished bag.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use swath_bags::{Bag, BagOptions, Filter, ReadOptions, ops};
//!
//! # fn main() -> swath_bags::Result<()> {
//! let bag = Bag::open(Path::new("out/bag"))?;
//! println!("{}", ops::info::info(&bag));
//! let copied = ops::copy::filter(&bag, &Filter::default(), Path::new("out/copy"), BagOptions::default())?;
//! assert!(copied.faults.is_empty(), "what could not be read is told");
//! let report = ops::validate::validate(Path::new("out/copy"), None, ReadOptions::default())?;
//! assert!(report.faults.is_empty());
//! # Ok(())
//! # }
//! ```

pub mod cat;
mod checks;
pub mod convert;
pub mod copy;
pub mod info;
pub mod mend;
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
