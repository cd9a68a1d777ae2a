//! Requests as tables for people and as JSON for machines.

use anyhow::Result;
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;

use swath_mission::time_text;
use swath_node::out;
use swath_node::stamp::nanoseconds;

use crate::requests::json::{history_json, state_name, status_json, time, time_json};

/// Prints what became of a request or of what was asked of it.
pub fn print_result(name: &str, done: &str, result: &msg::SubmitResult, as_json: bool) -> Result<()> {
    out::print_line(if as_json {
        let line = json!({
            "name": name, "accepted": result.accepted, "id": result.id,
            "reason_code": result.reason_code, "reason": result.reason,
        });
        line.to_string()
    } else if result.accepted {
        format!("{done:<9} {:>7}  {name}", result.id)
    } else {
        format!("refused   {:>7}  {name}: {} (reason {})", "-", result.reason, result.reason_code)
    })?;
    Ok(())
}

/// Head of a table of requests.
pub fn status_head() -> String {
    format!(
        "{:>7}  {:<19} {:>4} {:>3}  {:<20}  {:<20}  {:<20}  name",
        "id", "state", "prio", "att", "window opens", "window closes", "imaging"
    )
}

/// A request as a line of a table.
pub fn status_line(status: &msg::StripStatus) -> String {
    let reason = if status.reason.is_empty() { String::new() } else { format!(": {}", status.reason) };
    format!(
        "{:>7}  {:<19} {:>4.2} {:>3}  {:<20}  {:<20}  {:<20}  {}{reason}",
        status.strip.id,
        state_name(status.state),
        status.strip.priority,
        status.attempts,
        time(&status.window_open),
        time(&status.window_close),
        time(&status.imaging),
        status.strip.name,
    )
}

/// A chance, for machines.
pub fn opportunity_json(opportunity: &msg::Opportunity) -> Value {
    json!({
        "window_open": time_json(&opportunity.window_open),
        "window_close": time_json(&opportunity.window_close),
        "window_open_tick": opportunity.window_open_tick,
        "window_close_tick": opportunity.window_close_tick,
        "t_acq_ticks": opportunity.t_acq_ticks,
        "min_elevation_deg": opportunity.min_elevation.to_degrees(),
        "transition_ticks": opportunity.transition_found.then_some(opportunity.transition_ticks),
        "conflicts": opportunity.conflicts,
        "conflict_ids": opportunity.conflict_ids.to_vec(),
    })
}

/// Chances as a table; nothing without any.
pub fn opportunity_table(opportunities: &[msg::Opportunity]) -> String {
    let head = format!(
        "  {:<24}  {:<24}  {:>9} {:>9} {:>10}  conflicts\n",
        "window opens", "window closes", "elevation", "acquire", "transition"
    );
    let times = TickTimes::of(opportunities.iter().flat_map(edges));
    let lines = opportunities.iter().map(|it| {
        let transition = if it.transition_found { times.duration(it.transition_ticks) } else { "-".to_owned() };
        format!(
            "  {:<24}  {:<24}  {:>8.1}° {:>9} {:>10}  {}\n",
            time(&it.window_open),
            time(&it.window_close),
            it.min_elevation.to_degrees(),
            times.duration(it.t_acq_ticks),
            transition,
            it.conflicts,
        )
    });
    if opportunities.is_empty() { String::new() } else { std::iter::once(head).chain(lines).collect() }
}

/// Ticks of a mission as times, from stamps whose ticks are known.
#[derive(Clone, Copy, Default)]
struct TickTimes {
    /// A stamp [ns] with its tick, and the length of a tick [ns].
    known: Option<(u64, u64, u64)>,
}

impl TickTimes {
    fn of(pairs: impl Iterator<Item = (u64, u64)> + Clone) -> Self {
        let first = pairs.clone().min_by_key(|(_, tick)| *tick);
        let last = pairs.max_by_key(|(_, tick)| *tick);
        let known = first.zip(last).and_then(|((from, first), (to, last))| {
            let ticks = last.checked_sub(first).filter(|ticks| *ticks > 0)?;
            // A whole number of nanoseconds, whatever the stamps were rounded to.
            Some((from, first, (to.checked_sub(from)? + ticks / 2) / ticks))
        });
        Self { known }
    }

    /// A number of ticks in seconds; in ticks where nothing tells their length.
    fn duration(self, ticks: u32) -> String {
        match self.known {
            Some((_, _, period)) => format!("{:.1} s", f64::from(ticks) * period as f64 / 1e9),
            None => format!("{ticks} ticks"),
        }
    }

    /// The time of a tick; the tick where nothing tells it.
    fn at(self, tick: u64) -> String {
        let time = self.known.and_then(|(from, first, period)| match tick.checked_sub(first) {
            Some(after) => from.checked_add(after.checked_mul(period)?),
            None => from.checked_sub((first - tick).checked_mul(period)?),
        });
        time.map_or_else(|| format!("tick {tick}"), time_text::format)
    }
}

/// Both ends of a window: stamps [ns] with their ticks.
fn edges(opportunity: &msg::Opportunity) -> [(u64, u64); 2] {
    let msg::Opportunity { window_open, window_close, window_open_tick, window_close_tick, .. } = opportunity;
    [(nanoseconds(window_open), *window_open_tick), (nanoseconds(window_close), *window_close_tick)]
}

fn attempt_state(state: u8) -> &'static str {
    match state {
        msg::Attempt::STATE_PLANNED => "planned",
        msg::Attempt::STATE_TRANSITIONING => "transitioning",
        msg::Attempt::STATE_ACQUIRING => "acquiring",
        msg::Attempt::STATE_SUCCEEDED => "succeeded",
        msg::Attempt::STATE_FAILED => "failed",
        _ => "cancelled",
    }
}

fn attempt_json(attempt: &msg::Attempt) -> Value {
    json!({
        "strip": attempt.strip_id,
        "task": attempt.task,
        "start_tick": attempt.start_tick,
        "end_tick": attempt.end_tick,
        "t_pre_ticks": attempt.t_pre_ticks,
        "t_acq_ticks": attempt.t_acq_ticks,
        "state": attempt_state(attempt.state),
        "reason_code": attempt.reason_code,
        "max_attitude_error": attempt.max_attitude_error,
        "min_elevation_deg": attempt.min_elevation.to_degrees(),
        "reward": attempt.reward,
    })
}

/// All that is known of a request, for machines.
pub fn report_json(report: &msg::StripReport) -> Value {
    json!({
        "status": status_json(&report.status),
        "bidirectional": report.request.bidirectional,
        "valid_from": time_json(&report.request.valid_from),
        "valid_until": time_json(&report.request.valid_until),
        "max_attempts": report.request.max_attempts,
        "opportunities": report.opportunities.iter().map(opportunity_json).collect::<Vec<_>>(),
        "attempts": report.attempts.iter().map(attempt_json).collect::<Vec<_>>(),
        "history": report.history.iter().map(history_json).collect::<Vec<_>>(),
    })
}

/// All that is known of a request, for people.
pub fn report_text(report: &msg::StripReport) -> String {
    let (status, strip) = (&report.status, &report.status.strip);
    let mut text = format!(
        "strip {} {}\n  {} since {}{}\n  from {:.4}° {:.4}° to {:.4}° {:.4}°, priority {}, {} m/s, by {} ({})\n",
        strip.id,
        strip.name,
        state_name(status.state),
        time(&status.header.stamp),
        if status.reason.is_empty() { String::new() } else { format!(": {}", status.reason) },
        strip.start_latitude_deg,
        strip.start_longitude_deg,
        strip.end_latitude_deg,
        strip.end_longitude_deg,
        strip.priority,
        strip.acquisition_speed,
        status.submitter,
        status.client_ref,
    );
    for (what, id) in
        [("linked to", status.linked_to), ("replaces", status.supersedes), ("replaced by", status.superseded_by)]
    {
        if id != 0 {
            text += &format!("  {what} strip {id}\n");
        }
    }
    let status_time = (nanoseconds(&status.header.stamp), status.tick);
    let history = report.history.iter().map(|entry| (nanoseconds(&entry.stamp), entry.tick));
    let times =
        TickTimes::of(report.opportunities.iter().flat_map(edges).chain(history).chain(std::iter::once(status_time)));
    text += "chances\n";
    text += &match report.opportunities.is_empty() {
        true => "  none\n".to_owned(),
        false => opportunity_table(&report.opportunities),
    };
    text += "attempts\n";
    if report.attempts.is_empty() {
        text += "  none\n";
    }
    for attempt in &report.attempts {
        let end = if attempt.end_tick == 0 { String::new() } else { format!(" to {}", times.at(attempt.end_tick)) };
        text += &format!(
            "  task {} from {}{end}: {} {}, attitude error {:.3}, elevation {:.1}°\n",
            attempt.task,
            times.at(attempt.start_tick),
            attempt_state(attempt.state),
            if attempt.reason_code == 0 { String::new() } else { format!("(reason {})", attempt.reason_code) },
            attempt.max_attitude_error,
            attempt.min_elevation.to_degrees(),
        );
    }
    text += "history\n";
    for entry in &report.history {
        text += &format!(
            "  {}  strip {} {} by {}{}\n",
            time(&entry.stamp),
            entry.strip_id,
            state_name(entry.state),
            entry.actor,
            if entry.reason.is_empty() { String::new() } else { format!(": {}", entry.reason) },
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_told_as_times() {
        let start = time_text::parse("2026-01-01T00:00:00Z").unwrap();
        let times = TickTimes::of([(start + 5_000_000_000, 10), (start + 50_000_000_000, 100)].into_iter());
        assert_eq!(times.at(0), "2026-01-01T00:00:00Z");
        assert_eq!(times.at(21), "2026-01-01T00:00:10.500Z");
        assert_eq!(times.duration(25), "12.5 s");
        let unknown = TickTimes::of(std::iter::once((start, 7)));
        assert_eq!((unknown.at(3), unknown.duration(4)), ("tick 3".to_owned(), "4 ticks".to_owned()));
    }
}
