//! Times as people write them.

use chrono::{DateTime, SecondsFormat, Utc};

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

/// The time of a number of seconds since 1970-01-01 UTC, such as `2026-01-01 06:00:00`.
#[must_use]
pub fn date(seconds: u64) -> String {
    let seconds = i64::try_from(seconds).unwrap_or(i64::MAX);
    let time = DateTime::from_timestamp(seconds, 0).unwrap_or(DateTime::<Utc>::MAX_UTC);
    time.format("%Y-%m-%d %H:%M:%S").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        assert_eq!(date(0), "1970-01-01 00:00:00");
        assert_eq!(date(1_709_210_096), "2024-02-29 12:34:56");
    }

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
