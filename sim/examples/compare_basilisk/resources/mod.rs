//! Histories of resources, ground access and momentum: each kind is computed again and compared row by row.

mod access;
mod bus;
mod data;
mod loops;
mod read;
mod sunlight;

use std::path::Path;

use anyhow::{Context, Result, bail};

use read::Input;

/// Largest difference of one quantity from a history, and how large it may be.
#[derive(Debug)]
pub struct Check {
    /// What was compared, with its unit.
    pub what: &'static str,
    /// Largest difference; NaN where one side is not a number.
    pub difference: f64,
    /// Largest difference allowed; 0 where it must be exact.
    pub tolerance: f64,
}

impl Check {
    fn new(what: &'static str, tolerance: f64) -> Self {
        Self { what, difference: 0.0, tolerance }
    }

    fn add(&mut self, ours: f64, theirs: f64) {
        let difference = (ours - theirs).abs();
        // A difference that is not a number stays.
        if difference.is_nan() || difference > self.difference {
            self.difference = difference;
        }
    }

    fn add_all(&mut self, ours: &[f64], theirs: &[f64]) {
        if ours.len() != theirs.len() {
            self.difference = f64::NAN;
        }
        ours.iter().zip(theirs).for_each(|(ours, theirs)| self.add(*ours, *theirs));
    }

    /// Whether the difference is within the tolerance.
    pub fn holds(&self) -> bool {
        self.difference <= self.tolerance
    }
}

/// What came of a comparison.
#[derive(Debug)]
pub struct Comparison {
    /// Rows compared.
    pub rows: usize,
    /// Largest differences.
    pub checks: Vec<Check>,
}

/// The kind of a history of resources; none where it is another history.
pub fn case(history: &serde_json::Value) -> Option<&str> {
    history.get("meta")?.get("case")?.as_str()
}

/// Computes a history again and compares.
///
/// # Errors
/// When something is missing in the history, or its kind is unknown.
pub fn compare(path: &Path, history: &serde_json::Value) -> Result<Comparison> {
    let case = case(history).context("`meta.case` does not say what kind of history this is")?;
    let meta = Input::new(history, "meta")?;
    let data = Input::new(history, "data")?;
    let compared = match case {
        "eclipse" => sunlight::eclipse(&meta, &data),
        "panel_tumble" => sunlight::panel_tumble(&meta, &data),
        "panel_replay" => sunlight::panel_replay(&meta, &data),
        "wheel_replay" => bus::wheel_replay(&meta, &data),
        "wheel_power" => bus::wheel_power(&meta, &data),
        "battery" => bus::battery(&meta, &data),
        "access" => access::access(&meta, &data),
        "data" => data::data(&meta, &data),
        "momentum" => loops::momentum(&meta, &data),
        "gg_tumble" => loops::gravity_tumble(&meta, &data),
        other => bail!("unknown case `{other}`"),
    };
    compared.with_context(|| format!("in {}", path.display()))
}
