//! Times as people write them.

use chrono::{DateTime, SecondsFormat};

/// Nanoseconds since 1970-01-01 UTC of a time such as `2026-01-01T06:00:00Z`.
///
/// # Errors
/// When the text is no such time, or one before 1970.
pub fn parse(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is no time such as 2026-01-01T06:00:00Z");
    let time = DateTime::parse_from_rfc3339(text).map_err(|_| wrong())?;
    time.timestamp_nanos_opt().and_then(|ns| u64::try_from(ns).ok()).ok_or_else(wrong)
}

/// The time of a number of nanoseconds since 1970-01-01 UTC, such as `2026-01-01T06:00:00Z`.
#[must_use]
pub fn format(ns: u64) -> String {
    let ns = i64::try_from(ns).unwrap_or(i64::MAX);
    DateTime::from_timestamp_nanos(ns).to_rfc3339_opts(SecondsFormat::AutoSi, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_round_trip_and_others_are_told() {
        for text in ["2026-01-01T00:00:00Z", "2026-01-01T06:30:00.500Z", "1970-01-01T00:00:01Z"] {
            assert_eq!(format(parse(text).unwrap()), text);
        }
        assert_eq!(parse("2026-01-01T01:00:00+01:00").unwrap(), 1_767_225_600_000_000_000);
        for text in ["soon", "2026-13-01T00:00:00Z", "1960-01-01T00:00:00Z", ""] {
            assert!(parse(text).unwrap_err().contains("is no time such as"), "{text}");
        }
    }
}
