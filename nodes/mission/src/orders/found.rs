//! What is found in files of requests, and what becomes of it.

use thiserror::Error;

use super::order::Order;

/// A line that is nearer to its only strip is straight [km].
const STRAIGHT_KM: f64 = 0.01;

/// What files of requests hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The strips, in the order of the files.
    pub orders: Vec<Order>,
    /// Lines and areas found.
    pub shapes: usize,
    /// What became of each.
    pub cut: Vec<Cut>,
    /// What is no strip.
    pub refused: Vec<Fault>,
}

/// What became of a line or an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Its name.
    pub name: String,
    /// Its strips.
    pub strips: usize,
    /// How well they show it.
    pub shown: Shown,
    /// What of it is left out, and why.
    pub left_out: Vec<String>,
}

impl Cut {
    /// Whether strips are other than what they were made from, or something is wrong with them.
    #[must_use]
    pub fn is_worth_a_word(&self) -> bool {
        let Shown::Line { farthest_km, too_short, .. } = self.shown else { return true };
        self.strips > 1 || farthest_km > STRAIGHT_KM || too_short || !self.left_out.is_empty()
    }
}

/// How well strips show what they were made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// A line.
    Line {
        /// Its length [km].
        length_km: f64,
        /// Its greatest distance from its strips [km].
        farthest_km: f64,
        /// Whether its only strip is shorter than a strip may be.
        too_short: bool,
    },
    /// An area.
    Area {
        /// Its size [km²].
        square_km: f64,
        /// Share of it that is shown.
        covered: f64,
        /// Share of it that is shown more than once.
        twice: f64,
    },
}

/// Something that is no strip.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("requests {path}, feature {feature}{}: {reason}", part.map_or_else(String::new, |part| format!(", part {part}")))]
pub struct Fault {
    /// The file.
    pub path: String,
    /// Number of the feature, from 1.
    pub feature: usize,
    /// Number of the part of the feature, from 1, if it has several.
    pub part: Option<usize>,
    /// What is wrong.
    pub reason: String,
}
