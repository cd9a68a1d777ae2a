//! Times as people write them.

use chrono::{DateTime, NaiveDate, SecondsFormat, Utc};

/// How GDAL writes times to formats that have none.
const GDAL: &str = "%Y/%m/%d %H:%M:%S%.f%#z";
/// Nanoseconds of a day.
const DAY_NS: u64 = 86_400_000_000_000;

/// Nanoseconds since 1970-01-01 UTC of the beginning and the end of a day such as `2026-01-01`, of which a Shapefile
/// knows no more.
#[must_use]
pub fn day(text: &str) -> Option<[u64; 2]> {
    let date = NaiveDate::parse_from_str(text, "%Y-%m-%d").ok()?;
    let begin = date.and_hms_opt(0, 0, 0)?.and_utc().timestamp_nanos_opt()?;
    let begin = u64::try_from(begin).ok()?;
    Some([begin, begin.checked_add(DAY_NS)?])
}

/// Nanoseconds since 1970-01-01 UTC of a time such as `2026-01-01T06:00:00Z`, or as GDAL writes it,
/// `2026/01/01 06:00:00+00`.
///
/// # Errors
/// When the text is no such time, or one before 1970.
pub fn parse(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is no time such as 2026-01-01T06:00:00Z");
    let time = DateTime::parse_from_rfc3339(text).or_else(|_| DateTime::parse_from_str(text, GDAL));
    let time = time.map_err(|_| wrong())?;
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
        let new_year = 1_767_225_600_000_000_000;
        for text in ["2026-01-01T01:00:00+01:00", "2026/01/01 00:00:00+00", "2026/01/01 05:30:00.000+0530"] {
            assert_eq!(parse(text).unwrap(), new_year, "{text}");
        }
        assert_eq!(day("2026-01-01"), Some([new_year, new_year + DAY_NS]));
        assert!(day("2026-02-30").is_none() && day("1960-01-01").is_none() && day("2026-01-01T00:00:00Z").is_none());
        for text in ["soon", "2026-13-01T00:00:00Z", "1960-01-01T00:00:00Z", ""] {
            assert!(parse(text).unwrap_err().contains("is no time such as"), "{text}");
        }
    }
}
