//! Every reason that is given for a state, an attempt or a refusal, with its number.

use serde::{Deserialize, Serialize};
use swath_sim::error::StripError;
use swath_sim::task::FailureReason;

/// Why something is as it is: the REASON constants of `swath_msgs/msg/StripStatus`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u16)]
pub enum Reason {
    /// Nothing to explain.
    #[default]
    None = 0,
    /// A number is not finite.
    NotFinite = 100,
    /// A latitude is out of range.
    Latitude = 101,
    /// A longitude is out of range.
    Longitude = 102,
    /// The priority is out of range.
    Priority = 103,
    /// The acquisition speed is out of range.
    Speed = 104,
    /// The strip is too short or too long.
    Length = 105,
    /// The validity is empty or over.
    Validity = 106,
    /// A text is too long or holds characters that it may not.
    Text = 107,
    /// The reference is known with other contents.
    Duplicate = 108,
    /// There are too many requests.
    Capacity = 109,
    /// The satellite never sees the strip while it is valid.
    NoOpportunity = 110,
    /// The ends are antipodal.
    Antipodal = 111,
    /// There is nothing in the call.
    Empty = 112,
    /// The same strip is already asked for.
    SameStrip = 113,
    /// There is no such strip.
    Unknown = 120,
    /// The request's state does not allow it.
    State = 121,
    /// A filter, an action or a limit of the call is not valid.
    Call = 122,
    /// There is no room where requests are kept.
    StoreFull = 123,
    /// The attempt failed on the attitude error.
    Attitude = 201,
    /// The attempt failed on the elevation.
    Elevation = 202,
    /// The attempt was cut short.
    Interrupted = 203,
    /// The task was given up before it began.
    NotFlown = 204,
    /// Attempts that were allowed are used up.
    Attempts = 205,
}

impl Reason {
    /// Every reason, in the order of their numbers.
    pub const ALL: [Self; 24] = [
        Self::None,
        Self::NotFinite,
        Self::Latitude,
        Self::Longitude,
        Self::Priority,
        Self::Speed,
        Self::Length,
        Self::Validity,
        Self::Text,
        Self::Duplicate,
        Self::Capacity,
        Self::NoOpportunity,
        Self::Antipodal,
        Self::Empty,
        Self::SameStrip,
        Self::Unknown,
        Self::State,
        Self::Call,
        Self::StoreFull,
        Self::Attitude,
        Self::Elevation,
        Self::Interrupted,
        Self::NotFlown,
        Self::Attempts,
    ];

    /// Number in messages and in the store.
    #[must_use]
    pub fn number(self) -> u16 {
        self as u16
    }

    /// The reason of a number.
    #[must_use]
    pub fn from_number(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.number() == number)
    }

    /// The failure that it is a reason for.
    #[must_use]
    pub fn failure(self) -> Option<FailureReason> {
        let failures = [FailureReason::Attitude, FailureReason::Elevation, FailureReason::Interrupted];
        failures.into_iter().find(|failure| Self::from(*failure) == self)
    }
}

impl From<FailureReason> for Reason {
    fn from(failure: FailureReason) -> Self {
        match failure {
            FailureReason::Attitude => Self::Attitude,
            FailureReason::Elevation => Self::Elevation,
            FailureReason::Interrupted => Self::Interrupted,
        }
    }
}

impl From<&StripError> for Reason {
    fn from(error: &StripError) -> Self {
        match error {
            StripError::NotFinite { .. } => Self::NotFinite,
            StripError::Latitude { .. } => Self::Latitude,
            StripError::Longitude { .. } => Self::Longitude,
            StripError::Priority { .. } => Self::Priority,
            StripError::Speed { .. } => Self::Speed,
            StripError::Length { .. } => Self::Length,
            StripError::Antipodal => Self::Antipodal,
            StripError::NoWindow { .. } => Self::NoOpportunity,
        }
    }
}

#[cfg(test)]
mod tests {
    use swath_msgs::swath_msgs::StripStatus;

    use super::*;

    #[test]
    fn numbers_are_those_of_the_message() {
        let constants = [
            StripStatus::REASON_NONE,
            StripStatus::REASON_NOT_FINITE,
            StripStatus::REASON_LATITUDE,
            StripStatus::REASON_LONGITUDE,
            StripStatus::REASON_PRIORITY,
            StripStatus::REASON_SPEED,
            StripStatus::REASON_LENGTH,
            StripStatus::REASON_VALIDITY,
            StripStatus::REASON_TEXT,
            StripStatus::REASON_DUPLICATE,
            StripStatus::REASON_CAPACITY,
            StripStatus::REASON_NO_OPPORTUNITY,
            StripStatus::REASON_ANTIPODAL,
            StripStatus::REASON_EMPTY,
            StripStatus::REASON_SAME_STRIP,
            StripStatus::REASON_UNKNOWN,
            StripStatus::REASON_STATE,
            StripStatus::REASON_CALL,
            StripStatus::REASON_STORE_FULL,
            StripStatus::REASON_ATTITUDE,
            StripStatus::REASON_ELEVATION,
            StripStatus::REASON_INTERRUPTED,
            StripStatus::REASON_NOT_FLOWN,
            StripStatus::REASON_ATTEMPTS,
        ];
        assert_eq!(Reason::ALL.map(Reason::number), constants);
        let text = include_str!("../../../../msgs/msg/StripStatus.msg");
        assert_eq!(text.matches("uint16 REASON_").count(), constants.len(), "a constant is missing here");
        assert!(Reason::ALL.into_iter().all(|reason| Reason::from_number(reason.number()) == Some(reason)));
        assert_eq!(Reason::from_number(1), None);
    }
}
