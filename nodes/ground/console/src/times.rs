//! Intervals of time, as STAPI writes them.

use swath_mission::time_text;

/// The end of an interval that has none: later than any mission.
const FOREVER_NS: u64 = 9_000_000_000_000_000_000;

/// Start and end [ns since 1970-01-01 UTC] of an interval such as `2026-01-01T00:00:00Z/..`; 0 for an open end.
///
/// # Errors
/// When it is none, or ends before it starts.
pub fn parse(text: &str) -> Result<(u64, u64), String> {
    let (start, end) = text.split_once('/').ok_or_else(|| format!("`{text}` is no interval START/END"))?;
    if end.contains('/') {
        return Err(format!("`{text}` has more than two ends"));
    }
    let one = |text: &str| if text.is_empty() || text == ".." { Ok(0) } else { time_text::parse(text) };
    let (start, end) = (one(start)?, one(end)?);
    if end != 0 && end < start {
        return Err(format!("`{text}` ends before it starts"));
    }
    Ok((start, end))
}

/// The interval; what is open begins at `from` and ends in the far future, because not every client knows open ones.
#[must_use]
pub fn format(start_ns: u64, end_ns: u64, from_ns: u64) -> String {
    let start = if start_ns == 0 { from_ns } else { start_ns };
    let end = if end_ns == 0 { FOREVER_NS } else { end_ns };
    format!("{}/{}", time_text::format(start), time_text::format(end.max(start)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_ends_come_in_and_closed_ones_go_out() {
        let day = 1_767_225_600_000_000_000;
        assert_eq!(parse("2026-01-01T00:00:00Z/2026-01-01T00:00:01Z"), Ok((day, day + 1_000_000_000)));
        assert_eq!(parse("2026-01-01T00:00:00Z/.."), Ok((day, 0)));
        assert_eq!(parse("/2026-01-01T00:00:00Z"), Ok((0, day)));
        assert_eq!(format(0, 0, day), "2026-01-01T00:00:00Z/2255-03-14T16:00:00Z");
        for wrong in ["", "2026-01-01T00:00:00Z", "soon/later", "2026-01-02T00:00:00Z/2026-01-01T00:00:00Z", "../../.."]
        {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
