//! Planners by name.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::decision::Planner;
use super::frugal::Frugal;
use super::handmade::Handmade;
use super::heuristic::Heuristic;
use super::lookahead::{Beam, BeamSearch, Lookahead};
use super::random::Random;
use super::repair::{Aspen, Method, Repair};

/// Kinds of policies: hybrid ones with a transformer, with an MLP, standard hybrid PPO, and PPO over a grid.
const KINDS: [&str; 4] = ["hop-ppo", "hop-ppo-mlp", "h-ppo", "discrete-ppo"];

/// What follows a kind of policy whose proposals are flown in the head.
const LOOKAHEAD: &str = "+lookahead";

/// Largest margin of the lookahead planner [ticks].
const MARGIN_MAX: u32 = 240;
/// Longest fixed transition [s].
const T_PRE_MAX_S: f64 = 600.0;

/// Most closed-loop ticks that `repair` may fly in the head for a decision.
const BUDGET_MAX: u64 = 100_000_000;

/// A planner by name: `lookahead`, `lookahead:TICKS` for a margin that is not adapted, `beam`, `beam:WIDTHxDEPTH`,
/// `frugal`, `beam+handmade:SHARE`,
/// `repair` and `aspen`, each also with `-annealing` or `-squeaky` for another search, `repair:TICKS` for another budget,
/// `heuristic:SECONDS`, `random`, or a kind of policy such as `hop-ppo` for the one that is part of the program and `hop-ppo:FILE` for another; with
/// `hop-ppo+lookahead` its proposals are flown in the head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum PlannerSpec {
    /// Flies each candidate in its head; with a margin [ticks] it adds that to each transition and adapts nothing.
    Lookahead(Option<u32>),
    /// Flies sequences of candidates in its head.
    Beam(BeamSearch),
    /// The same, paying for energy and data.
    Frugal,
    /// The beam search within a shield made by hand, with the least charge over capacity that it requires.
    Handmade(f64),
    /// Repairs its plan on board all the time, as CASPER.
    Repair {
        /// How better plans are sought.
        method: Method,
        /// Closed-loop ticks that it may fly in the head for a decision; none for the default.
        ticks: Option<u64>,
    },
    /// Makes a plan on the ground that is flown as it is, as ASPEN.
    Aspen(Method),
    /// The paper's heuristic with a fixed transition time [s].
    Heuristic(f64),
    /// A uniform strip and a uniform transition time.
    Random,
    /// A trained policy.
    Learned {
        /// Kind of network that it must have.
        kind: String,
        /// Policy or checkpoint; none for the shipped one.
        file: Option<PathBuf>,
        /// Whether the strips that it proposes are flown in the head before one is chosen.
        lookahead: bool,
    },
}

/// A name that is no planner's.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("`{name}` is no planner: {reason}")]
pub struct UnknownPlanner {
    name: String,
    reason: &'static str,
}

impl Default for PlannerSpec {
    fn default() -> Self {
        Self::Beam(BeamSearch::default())
    }
}

impl FromStr for PlannerSpec {
    type Err = UnknownPlanner;

    fn from_str(name: &str) -> Result<Self, UnknownPlanner> {
        let unknown = |reason| UnknownPlanner { name: name.to_owned(), reason };
        let (word, rest) = name.split_once(':').map_or((name, None), |(word, rest)| (word, Some(rest)));
        match (word, rest) {
            ("random", None) => Ok(Self::Random),
            ("lookahead", None) => Ok(Self::Lookahead(None)),
            ("lookahead", Some(ticks)) => match ticks.parse() {
                Ok(margin) if margin <= MARGIN_MAX => Ok(Self::Lookahead(Some(margin))),
                _ => Err(unknown("the margin must be a whole number of ticks from 0 to 240")),
            },
            ("beam", None) => Ok(Self::Beam(BeamSearch::default())),
            ("beam", Some(shape)) => beam(shape)
                .ok_or_else(|| unknown("the beam must be WIDTHxDEPTH, with a width of 1 to 64 and a depth of 1 to 8")),
            ("frugal", None) => Ok(Self::Frugal),
            ("beam+handmade", Some(share)) => match share.parse() {
                Ok(share) if (0.0..=1.0).contains(&share) => Ok(Self::Handmade(share)),
                _ => Err(unknown("the least charge must be a share of the capacity from 0 to 1")),
            },
            ("repair" | "repair-annealing" | "repair-squeaky", ticks) => match ticks.map(str::parse).transpose() {
                Ok(ticks) if ticks.is_none_or(|ticks| (1..=BUDGET_MAX).contains(&ticks)) => {
                    Ok(Self::Repair { method: method(word), ticks })
                }
                _ => Err(unknown("the budget must be a whole number of ticks from 1 to 100 000 000")),
            },
            ("aspen" | "aspen-annealing" | "aspen-squeaky", None) => Ok(Self::Aspen(method(word))),
            ("heuristic", Some(seconds)) => match seconds.parse() {
                Ok(t_pre_s) if (0.0..=T_PRE_MAX_S).contains(&t_pre_s) => Ok(Self::Heuristic(t_pre_s)),
                _ => Err(unknown("the transition time must be a number of seconds from 0 to 600")),
            },
            _ => {
                let (word, lookahead) = word.strip_suffix(LOOKAHEAD).map_or((word, false), |kind| (kind, true));
                let kind = KINDS.into_iter().find(|kind| *kind == word);
                let kind = kind.ok_or_else(|| {
                    unknown(
                        "expected lookahead[:TICKS], beam[:WIDTHxDEPTH], repair[:TICKS] or aspen, each also with -annealing \
                         or -squeaky, heuristic:SECONDS, random, or hop-ppo, hop-ppo-mlp, h-ppo or discrete-ppo, then \
                         +lookahead to fly its proposals in the head, and :FILE for a policy that is not shipped",
                    )
                })?;
                Ok(Self::Learned { kind: kind.to_owned(), file: rest.map(PathBuf::from), lookahead })
            }
        }
    }
}

/// The search that a name ends with.
fn method(word: &str) -> Method {
    match word.split_once('-') {
        Some((_, "annealing")) => Method::Annealing,
        Some((_, "squeaky")) => Method::Squeaky,
        _ => Method::Repair,
    }
}

fn beam(shape: &str) -> Option<PlannerSpec> {
    let (width, depth) = shape.split_once('x')?;
    let (width, depth) = (width.parse().ok()?, depth.parse().ok()?);
    let fits = (1..=64).contains(&width) && (1..=8).contains(&depth);
    fits.then(|| PlannerSpec::Beam(BeamSearch { width, depth, ..BeamSearch::default() }))
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
            Self::Lookahead(None) => write!(f, "lookahead"),
            Self::Lookahead(Some(margin)) => write!(f, "lookahead:{margin}"),
            Self::Beam(beam) if *beam == BeamSearch::default() => write!(f, "beam"),
            Self::Beam(beam) => write!(f, "beam:{}x{}", beam.width, beam.depth),
            Self::Frugal => write!(f, "frugal"),
            Self::Handmade(share) => write!(f, "beam+handmade:{share}"),
            Self::Repair { method, ticks } => {
                write!(f, "repair{}", method.ending())?;
                ticks.map_or(Ok(()), |ticks| write!(f, ":{ticks}"))
            }
            Self::Aspen(method) => write!(f, "aspen{}", method.ending()),
            Self::Heuristic(t_pre_s) => write!(f, "heuristic:{t_pre_s}"),
            Self::Random => write!(f, "random"),
            Self::Learned { kind, file, lookahead } => {
                write!(f, "{kind}{}", if *lookahead { LOOKAHEAD } else { "" })?;
                file.as_ref().map_or(Ok(()), |file| write!(f, ":{}", file.display()))
            }
        }
    }
}

impl PlannerSpec {
    /// Makes the planner for a mission of this seed; none for a policy, which this crate knows nothing of.
    #[must_use]
    pub fn hand_written(&self, seed: u64) -> Option<Box<dyn Planner + Send>> {
        match *self {
            Self::Lookahead(margin) => Some(Box::new(margin.map_or_else(Lookahead::default, Lookahead::with_margin))),
            Self::Beam(beam) => Some(Box::new(Beam::new(beam))),
            Self::Frugal => Some(Box::new(Frugal::default())),
            Self::Handmade(share) => Some(Box::new(Handmade::new(Box::new(Beam::default()), share))),
            Self::Repair { method, ticks } => Some(Box::new(
                ticks.map_or_else(|| Repair::new(method, seed), |ticks| Repair::with_budget(method, ticks, seed)),
            )),
            Self::Aspen(method) => Some(Box::new(Aspen::new(method, seed))),
            Self::Heuristic(t_pre_s) => Some(Box::new(Heuristic { t_pre_s })),
            Self::Random => Some(Box::new(Random { seed })),
            Self::Learned { .. } => None,
        }
    }

    /// Puts a policy's file into `folder` where its path is relative.
    pub fn resolve(&mut self, folder: &Path) {
        if let Self::Learned { file: Some(file), .. } = self {
            *file = folder.join(&*file);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip_and_faults_are_told() {
        for name in [
            "lookahead",
            "lookahead:4",
            "lookahead:0",
            "heuristic:90",
            "heuristic:72.5",
            "random",
            "h-ppo:a:b",
            "hop-ppo",
            "beam",
            "beam:4x2",
            "frugal",
            "beam+handmade:0.35",
            "hop-ppo+lookahead:a",
            "repair",
            "repair:30000",
            "repair-squeaky:7",
            "repair-annealing",
            "aspen",
            "aspen-squeaky",
        ] {
            assert_eq!(name.parse::<PlannerSpec>().unwrap().to_string(), name);
        }
        for name in [
            "heuristic:nan",
            "heuristic:-1",
            "heuristic:601",
            "lookahead:-1",
            "clever",
            "random:3",
            "heuristic",
            "beam:0x2",
            "beam:4",
            "beam+handmade",
            "beam+handmade:1.5",
            "frugal:2",
            "repair:0",
            "repair:much",
            "aspen:4",
            "aspen-clever",
        ] {
            assert!(name.parse::<PlannerSpec>().unwrap_err().to_string().contains(name));
        }
    }
}
