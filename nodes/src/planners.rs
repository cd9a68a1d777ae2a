//! Naming and making planners.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use swath_sim::planner::{Heuristic, Lookahead, Planner, Random};
use thiserror::Error;

/// A planner by name: `lookahead`, `lookahead:TICKS`, `heuristic:SECONDS` or `random`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum PlannerSpec {
    /// Flies each candidate in its head; the margin is added to each transition [ticks].
    Lookahead(u32),
    /// The paper's heuristic with a fixed transition time [s].
    Heuristic(f64),
    /// A uniform strip and a uniform transition time.
    Random,
}

/// A name that is no planner's.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("`{name}` is no planner: {reason}")]
pub struct UnknownPlanner {
    name: String,
    reason: &'static str,
}

/// Largest margin of the lookahead planner [ticks].
const MARGIN_MAX: u32 = 240;
/// Longest fixed transition [s].
const T_PRE_MAX_S: f64 = 600.0;

impl Default for PlannerSpec {
    fn default() -> Self {
        Self::Lookahead(0)
    }
}

impl FromStr for PlannerSpec {
    type Err = UnknownPlanner;

    fn from_str(name: &str) -> Result<Self, UnknownPlanner> {
        let unknown = |reason| UnknownPlanner { name: name.to_owned(), reason };
        match name.split_once(':') {
            None if name == "random" => Ok(Self::Random),
            None if name == "lookahead" => Ok(Self::Lookahead(0)),
            Some(("lookahead", ticks)) => match ticks.parse() {
                Ok(margin) if margin <= MARGIN_MAX => Ok(Self::Lookahead(margin)),
                _ => Err(unknown("the margin must be a whole number of ticks from 0 to 240")),
            },
            Some(("heuristic", seconds)) => match seconds.parse() {
                Ok(t_pre_s) if (0.0..=T_PRE_MAX_S).contains(&t_pre_s) => Ok(Self::Heuristic(t_pre_s)),
                _ => Err(unknown("the transition time must be a number of seconds from 0 to 600")),
            },
            _ => Err(unknown("expected `lookahead`, `lookahead:TICKS`, `heuristic:SECONDS` or `random`")),
        }
    }
}

impl TryFrom<String> for PlannerSpec {
    type Error = UnknownPlanner;

    fn try_from(name: String) -> Result<Self, UnknownPlanner> {
        name.parse()
    }
}

impl From<PlannerSpec> for String {
    fn from(spec: PlannerSpec) -> Self {
        spec.to_string()
    }
}

impl fmt::Display for PlannerSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lookahead(0) => write!(f, "lookahead"),
            Self::Lookahead(margin) => write!(f, "lookahead:{margin}"),
            Self::Heuristic(t_pre_s) => write!(f, "heuristic:{t_pre_s}"),
            Self::Random => write!(f, "random"),
        }
    }
}

impl PlannerSpec {
    /// Makes the planner for a mission of this seed.
    #[must_use]
    pub fn make(&self, seed: u64) -> Box<dyn Planner + Send> {
        match *self {
            Self::Lookahead(margin) => Box::new(Lookahead { margin }),
            Self::Heuristic(t_pre_s) => Box::new(Heuristic { t_pre_s }),
            Self::Random => Box::new(Random { seed }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_faults_are_told() {
        for name in ["lookahead", "lookahead:4", "heuristic:90", "heuristic:72.5", "random"] {
            assert_eq!(name.parse::<PlannerSpec>().unwrap().to_string(), name);
        }
        for name in ["heuristic:nan", "heuristic:-1", "heuristic:601", "lookahead:-1", "clever", "random:3"] {
            assert!(name.parse::<PlannerSpec>().unwrap_err().to_string().contains(name));
        }
    }
}
