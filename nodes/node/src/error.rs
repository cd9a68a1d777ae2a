//! Why a message is not taken.

use swath_sim::error::StripError;
use thiserror::Error;

/// Why a message is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MessageError {
    /// A number is NaN, infinite or absurd.
    #[error("{field} is {value}, the limit is ±{limit}")]
    Number {
        /// Field of the message.
        field: &'static str,
        /// Value given.
        value: f64,
        /// Largest magnitude.
        limit: f64,
    },
    /// A constant that the interface does not know.
    #[error("{field} is {value}, which is none of its constants")]
    Constant {
        /// Field of the message.
        field: &'static str,
        /// Value given.
        value: u8,
    },
    /// A tick that the mission does not have.
    #[error("tick {tick} lies after the mission's end at tick {end}")]
    Tick {
        /// Tick given.
        tick: u64,
        /// The mission's last.
        end: u64,
    },
    /// Too many candidates.
    #[error("{count} candidates were offered, the limit is {max}")]
    Candidates {
        /// Number given.
        count: usize,
        /// Most allowed.
        max: usize,
    },
    /// A task of another length than its strip.
    #[error("acquisition of strip {strip} takes {expected} ticks, the message says {given}")]
    AcquisitionTime {
        /// Number of the strip.
        strip: u64,
        /// Ticks that the strip takes.
        expected: u32,
        /// Ticks given.
        given: u32,
    },
    /// A strip that cannot be flown.
    #[error("strip {strip}: {source}")]
    Strip {
        /// Number of the strip.
        strip: u64,
        /// Why.
        source: StripError,
    },
}
