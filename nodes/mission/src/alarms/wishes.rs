//! What operators wish of alarms.

use serde::{Deserialize, Serialize};
use swath_sim::time::{Tick, TickPeriod};
use thiserror::Error;

use super::board::{Board, Key, OperatorError};

/// Longest time that an alarm is shelved for [s].
const SHELVE_MAX_S: f64 = 2_592_000.0;
/// Longest name of an operator and longest comment [bytes].
const TEXT_MAX: usize = 1000;

/// What an operator wishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Act {
    /// They know of it.
    Acknowledge,
    /// They do not want to be told for a number of ticks.
    Shelve(u32),
    /// They want to be told again.
    Unshelve,
}

/// What an operator wishes of an alarm.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Wish {
    /// When.
    pub tick: Tick,
    /// Which alarm.
    pub key: Key,
    /// What.
    pub act: Act,
    /// Who.
    pub actor: String,
    /// Why, in words.
    pub comment: String,
}

/// Why a wish is not followed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WishError {
    /// It cannot be shelved for so long.
    #[error("an alarm cannot be shelved for {0} s: 1 to {SHELVE_MAX_S} s are allowed")]
    Duration(f64),
    /// A text is too long.
    #[error("{what} of {length} bytes is too long: {TEXT_MAX} are allowed")]
    TooLong {
        /// Which text.
        what: &'static str,
        /// Its length [bytes].
        length: usize,
    },
    /// It makes no sense as the alarm stands.
    #[error(transparent)]
    Refused(#[from] OperatorError),
}

impl Act {
    /// Shelves for a time [s].
    ///
    /// # Errors
    /// When it is too short, too long or no number.
    pub fn shelve(period: TickPeriod, duration_s: f64) -> Result<Self, WishError> {
        match (1.0..=SHELVE_MAX_S).contains(&duration_s) {
            true => Ok(Self::Shelve(period.ticks_ceil(duration_s))),
            false => Err(WishError::Duration(duration_s)),
        }
    }
}

impl Wish {
    /// Tells the board.
    ///
    /// # Errors
    /// When it makes no sense as the alarm stands, or a text is too long.
    pub fn follow(&self, board: &mut Board) -> Result<(), WishError> {
        for (what, text) in [("actor", &self.actor), ("comment", &self.comment)] {
            if text.len() > TEXT_MAX {
                return Err(WishError::TooLong { what, length: text.len() });
            }
        }
        let Self { tick, key, act, actor, comment } = self;
        match *act {
            Act::Acknowledge => board.acknowledge(*tick, key, actor, comment)?,
            Act::Shelve(ticks) => board.shelve(*tick, key, ticks, actor, comment)?,
            Act::Unshelve => board.unshelve(*tick, key, actor, comment)?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alarms::Severity;

    #[test]
    fn wishes_are_followed_or_refused_in_words() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let mut board = Board::new(period);
        let key = Key::new("guidance", "wheel x");
        board.report(Tick(1), key.clone(), Severity::Error, true, "gives nothing");
        let mut tell = |tick, act, comment: &str| {
            let wish = Wish { tick: Tick(tick), key: key.clone(), act, actor: "ana".into(), comment: comment.into() };
            wish.follow(&mut board).map_err(|error| error.to_string())
        };
        assert_eq!(Act::shelve(period, 60.0), Ok(Act::Shelve(120)));
        tell(2, Act::Shelve(120), "known").unwrap();
        tell(3, Act::Unshelve, "").unwrap();
        tell(4, Act::Acknowledge, "").unwrap();
        assert_eq!(
            tell(5, Act::Acknowledge, "").unwrap_err(),
            "wheel x of guidance: the alarm is acknowledged already"
        );
        let long = "x".repeat(1001);
        let error = tell(6, Act::Shelve(1), &long).unwrap_err();
        assert_eq!(error, "comment of 1001 bytes is too long: 1000 are allowed");
        for wrong in [0.5, -1.0, f64::NAN, f64::INFINITY, 3e6] {
            let error = Act::shelve(period, wrong).unwrap_err().to_string();
            assert_eq!(error, format!("an alarm cannot be shelved for {wrong} s: 1 to 2592000 s are allowed"));
        }
        assert_eq!(board.take_journal().len(), 4);
    }
}
