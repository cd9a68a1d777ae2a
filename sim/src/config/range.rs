//! Ranges of settings.

use crate::error::SimError;

/// Refuses a value outside [min, max], and NaN.
pub(crate) fn in_range(name: &'static str, value: f64, min: f64, max: f64) -> Result<(), SimError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(SimError::OutOfRange { name, value, min, max }) }
}

/// Refuses a range that runs backwards.
pub(crate) fn ordered(name: &'static str, min: f64, max: f64) -> Result<(), SimError> {
    if min <= max { Ok(()) } else { Err(SimError::EmptyRange { name, min, max }) }
}
