//! The life cycle of a strip request: its states, and the one function that every change of state goes through.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Where a strip request stands (the STATE constants of `swath_msgs/msg/StripStatus`, in their order).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[repr(u8)]
pub enum State {
    /// Arrived, not yet looked at.
    Received,
    /// Refused.
    Rejected,
    /// Waits for an operator's approval.
    Held,
    /// To be imaged when the planner chooses it.
    Accepted,
    /// Chosen as the next task; the satellite slews to it.
    Scheduled,
    /// Being imaged.
    Executing,
    /// Imaged.
    Completed,
    /// Withdrawn by a user.
    CancelledByUser,
    /// Withdrawn by the system.
    CancelledBySystem,
    /// No opportunity is left.
    Expired,
    /// Every attempt allowed has failed.
    Failed,
    /// Replaced by another request.
    Superseded,
    /// Its twin was imaged.
    FulfilledByLink,
}

/// A change of state that the life cycle does not have.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("a request that is {} cannot become {}", from.name(), to.name())]
pub struct IllegalTransition {
    /// State that the request has.
    pub from: State,
    /// State that it should get.
    pub to: State,
}

impl State {
    /// Every state, in the order of their numbers.
    pub const ALL: [Self; 13] = [
        Self::Received,
        Self::Rejected,
        Self::Held,
        Self::Accepted,
        Self::Scheduled,
        Self::Executing,
        Self::Completed,
        Self::CancelledByUser,
        Self::CancelledBySystem,
        Self::Expired,
        Self::Failed,
        Self::Superseded,
        Self::FulfilledByLink,
    ];

    /// The one way from a state to another.
    ///
    /// # Errors
    /// When the life cycle has no such step.
    pub fn step(self, to: Self) -> Result<Self, IllegalTransition> {
        use State::{
            Accepted, CancelledBySystem, CancelledByUser, Completed, Executing, Expired, Failed, FulfilledByLink, Held,
            Received, Rejected, Scheduled, Superseded,
        };
        let legal = match self {
            Received => matches!(to, Rejected | Held | Accepted),
            Held => matches!(
                to,
                Accepted | Rejected | CancelledByUser | CancelledBySystem | Expired | Superseded | FulfilledByLink
            ),
            Accepted => matches!(
                to,
                Held | Scheduled
                    | CancelledByUser
                    | CancelledBySystem
                    | Expired
                    | Failed
                    | Superseded
                    | FulfilledByLink
            ),
            Scheduled => {
                matches!(to, Executing | Accepted | Held | CancelledByUser | CancelledBySystem | Superseded)
            }
            Executing => matches!(to, Completed | Accepted | Failed),
            _ => false,
        };
        if legal { Ok(to) } else { Err(IllegalTransition { from: self, to }) }
    }

    /// Whether no step leads out of it.
    #[must_use]
    pub fn is_final(self) -> bool {
        !matches!(self, Self::Received | Self::Held | Self::Accepted | Self::Scheduled | Self::Executing)
    }

    /// Number in messages and in the store.
    #[must_use]
    pub fn number(self) -> u8 {
        self as u8
    }

    /// The state of a number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// Name for people and for the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Received => "received",
            Self::Rejected => "rejected",
            Self::Held => "held",
            Self::Accepted => "accepted",
            Self::Scheduled => "scheduled",
            Self::Executing => "executing",
            Self::Completed => "completed",
            Self::CancelledByUser => "cancelled by user",
            Self::CancelledBySystem => "cancelled by system",
            Self::Expired => "expired",
            Self::Failed => "failed",
            Self::Superseded => "superseded",
            Self::FulfilledByLink => "fulfilled by link",
        }
    }

    /// The state of a name, with spaces or hyphens.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.replace('-', " ");
        Self::ALL.into_iter().find(|state| state.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use swath_msgs::swath_msgs::StripStatus;

    use super::*;

    #[test]
    fn every_step_of_the_life_cycle_and_no_other() {
        let steps: Vec<_> = State::ALL
            .into_iter()
            .map(|from| {
                let to: Vec<_> =
                    State::ALL.into_iter().filter(|&to| from.step(to).is_ok()).map(State::number).collect();
                (from.number(), to)
            })
            .filter(|(_, to)| !to.is_empty())
            .collect();
        let expected = [
            (0, vec![1, 2, 3]),
            (2, vec![1, 3, 7, 8, 9, 11, 12]),
            (3, vec![2, 4, 7, 8, 9, 10, 11, 12]),
            (4, vec![2, 3, 5, 7, 8, 11]),
            (5, vec![3, 6, 10]),
        ];
        assert_eq!(steps, expected);
        assert!(
            State::ALL
                .into_iter()
                .all(|state| state.is_final() == State::ALL.iter().all(|&to| state.step(to).is_err()))
        );
    }

    #[test]
    fn an_illegal_step_names_both_states() {
        let error = State::Completed.step(State::CancelledByUser).unwrap_err();
        assert_eq!(error.to_string(), "a request that is completed cannot become cancelled by user");
    }

    #[test]
    fn numbers_are_those_of_the_message() {
        for (state, number) in [
            (State::Received, StripStatus::STATE_RECEIVED),
            (State::Rejected, StripStatus::STATE_REJECTED),
            (State::Held, StripStatus::STATE_HELD),
            (State::Accepted, StripStatus::STATE_ACCEPTED),
            (State::Scheduled, StripStatus::STATE_SCHEDULED),
            (State::Executing, StripStatus::STATE_EXECUTING),
            (State::Completed, StripStatus::STATE_COMPLETED),
            (State::CancelledByUser, StripStatus::STATE_CANCELLED_BY_USER),
            (State::CancelledBySystem, StripStatus::STATE_CANCELLED_BY_SYSTEM),
            (State::Expired, StripStatus::STATE_EXPIRED),
            (State::Failed, StripStatus::STATE_FAILED),
            (State::Superseded, StripStatus::STATE_SUPERSEDED),
            (State::FulfilledByLink, StripStatus::STATE_FULFILLED_BY_LINK),
        ] {
            assert_eq!(state.number(), number);
            assert_eq!(State::from_number(number), Some(state));
            assert_eq!(State::from_name(state.name()), Some(state));
        }
        assert_eq!(State::from_number(13), None);
    }
}
