//! Why the request manager refuses something, with the value and the limit.

use swath_sim::error::StripError;
use thiserror::Error;

use super::lifecycle::IllegalTransition;
use super::reason_number::Reason;

/// Longest name, reference or reason [characters].
pub const TEXT_MAX: usize = 256;
/// Most strips held.
pub const CAPACITY: usize = 1_000_000;
/// Most requests or numbers in one call.
pub const BATCH_MAX: usize = 100_000;
/// Most attempts that a request may ask for.
pub const ATTEMPTS_MAX: u32 = 1000;

/// Why something is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refusal {
    /// The strip cannot be flown.
    #[error(transparent)]
    Strip(#[from] StripError),
    /// The validity ends before it begins.
    #[error("valid from {from_s} s to {until_s} s of the mission: it ends before it begins")]
    ValidityOrder {
        /// Begin since the epoch [s].
        from_s: f64,
        /// End since the epoch [s].
        until_s: f64,
    },
    /// The validity is over.
    #[error("valid until {until_s} s of the mission, which is now at {now_s} s")]
    ValidityOver {
        /// End since the epoch [s].
        until_s: f64,
        /// Now [s].
        now_s: f64,
    },
    /// A text is too long.
    #[error("{field} has {length} characters, the limit is {TEXT_MAX}")]
    TextLength {
        /// Field of the request.
        field: &'static str,
        /// Its length.
        length: usize,
    },
    /// A text holds a control character.
    #[error("{field} holds the control character {character:?}")]
    TextCharacter {
        /// Field of the request.
        field: &'static str,
        /// The character.
        character: char,
    },
    /// The reference is known with other contents.
    #[error("client_ref `{client_ref}` is known with other contents as request {id}")]
    Reference {
        /// The reference.
        client_ref: String,
        /// The request that has it.
        id: u64,
    },
    /// The same strip is already asked for.
    #[error("the same strip is already asked for by request {id}, which is {state}")]
    SameStrip {
        /// That request.
        id: u64,
        /// Its state.
        state: &'static str,
    },
    /// There is too much in one call.
    #[error("{count} entries in one call, the limit is {BATCH_MAX}")]
    Batch {
        /// Entries in the call.
        count: usize,
    },
    /// There is nothing in the call.
    #[error("the call has no entry: at least 1 is needed")]
    Empty,
    /// There are too many strips.
    #[error("{count} strips are known, the limit is {CAPACITY}")]
    Capacity {
        /// Strips known.
        count: usize,
    },
    /// Too many attempts are asked for.
    #[error("{given} attempts are asked for, the limit is {ATTEMPTS_MAX}")]
    Attempts {
        /// Attempts asked for.
        given: u32,
    },
    /// There is no such strip.
    #[error("there is no request {id}: the numbers go from 1 to {last}")]
    Unknown {
        /// Number given.
        id: u64,
        /// The last number.
        last: u64,
    },
    /// There is no request under that reference.
    #[error("`{submitter}` has no request with client_ref `{client_ref}`")]
    UnknownReference {
        /// Submitter given.
        submitter: String,
        /// Reference given.
        client_ref: String,
    },
    /// The state does not allow it.
    #[error("request {id}: {illegal}")]
    State {
        /// The request.
        id: u64,
        /// The step that is not there.
        illegal: IllegalTransition,
    },
    /// The request manager rests.
    #[error("the request manager is inactive: nothing is taken until it is activated")]
    Inactive,
    /// There is no room where requests are kept.
    #[error("there is no room where requests are kept: nothing can be taken until there is some")]
    StoreFull,
    /// A value of the call is not valid.
    #[error("{field} is {value}, outside {limits}")]
    Call {
        /// Field of the call.
        field: &'static str,
        /// Value given.
        value: f64,
        /// What is allowed.
        limits: &'static str,
    },
}

impl Refusal {
    /// The reason.
    #[must_use]
    pub fn reason(&self) -> Reason {
        match self {
            Self::Strip(error) => error.into(),
            Self::ValidityOrder { .. } | Self::ValidityOver { .. } => Reason::Validity,
            Self::TextLength { .. } | Self::TextCharacter { .. } => Reason::Text,
            Self::Reference { .. } => Reason::Duplicate,
            Self::Capacity { .. } | Self::Batch { .. } => Reason::Capacity,
            Self::Empty => Reason::Empty,
            Self::SameStrip { .. } => Reason::SameStrip,
            Self::Unknown { .. } | Self::UnknownReference { .. } => Reason::Unknown,
            Self::State { .. } | Self::Inactive => Reason::State,
            Self::StoreFull => Reason::StoreFull,
            Self::Call { .. } | Self::Attempts { .. } => Reason::Call,
        }
    }

    /// Stable number of the reason.
    #[must_use]
    pub fn code(&self) -> u16 {
        self.reason().number()
    }
}

/// Checks a text of a request.
///
/// # Errors
/// When it is too long or holds a control character.
pub fn check_text(field: &'static str, text: &str) -> Result<(), Refusal> {
    // A text has at most as many characters as bytes: most need not be counted.
    if text.len() > TEXT_MAX {
        let length = text.chars().count();
        if length > TEXT_MAX {
            return Err(Refusal::TextLength { field, length });
        }
    }
    match text.chars().find(|character| character.is_control()) {
        Some(character) => Err(Refusal::TextCharacter { field, character }),
        None => Ok(()),
    }
}

/// Checks how much a call holds.
///
/// # Errors
/// When it holds nothing or too much.
pub fn check_batch(count: usize) -> Result<(), Refusal> {
    match count {
        0 => Err(Refusal::Empty),
        1..=BATCH_MAX => Ok(()),
        _ => Err(Refusal::Batch { count }),
    }
}
