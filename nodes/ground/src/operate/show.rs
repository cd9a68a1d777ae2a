//! Requests as tables for people and as JSON for machines.

use anyhow::Result;
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;
use swath_node::out;

use super::files::printable;
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
        format!("{done:<9} {:>7}  {}", result.id, printable(name))
    } else {
        let (name, reason) = (printable(name), printable(&result.reason));
        format!("refused   {:>7}  {name}: {reason} (reason {})", "-", result.reason_code)
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
    format!(
        "{:>7}  {:<19} {:>4.2} {:>3}  {:<20}  {:<20}  {:<20}  {}{}",
        status.strip.id,
        state_name(status.state),
        status.strip.priority,
        status.attempts,
        time(&status.window_open),
        time(&status.window_close),
        time(&status.imaging),
        printable(&status.strip.name),
        because(&status.reason),
    )
}

/// A reason behind what it is the reason for.
fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {}", printable(reason)) }
}

/// A chance, for machines.
pub fn opportunity_json(opportunity: &msg::Opportunity) -> Value {
    json!({
        "window_open": time_json(&opportunity.window_open),
        "window_close": time_json(&opportunity.window_close),
        "window_open_tick": opportunity.window_open_tick,
        "window_close_tick": opportunity.window_close_tick,
        "t_acq_ticks": opportunity.t_acq_ticks,
        "t_acq_s": opportunity.t_acq_s,
        "min_elevation_deg": opportunity.min_elevation.to_degrees(),
        "transition_ticks": opportunity.transition_found.then_some(opportunity.transition_ticks),
        "transition_s": opportunity.transition_found.then_some(opportunity.transition_s),
        "conflicts": opportunity.conflicts,
        "conflict_ids": opportunity.conflict_ids.to_vec(),
    })
}

/// Chances as a table.
pub fn opportunity_table(opportunities: &[msg::Opportunity]) -> String {
    let head = format!(
        "  {:<24}  {:<24}  {:>9} {:>9} {:>10}  conflicts\n",
        "window opens", "window closes", "elevation", "acquire", "transition"
    );
    let lines = opportunities.iter().map(|it| {
        let transition = if it.transition_found { format!("{:.1} s", it.transition_s) } else { "-".to_owned() };
        format!(
            "  {:<24}  {:<24}  {:>8.1}° {:>7.1} s {:>10}  {}\n",
            time(&it.window_open),
            time(&it.window_close),
            it.min_elevation.to_degrees(),
            it.t_acq_s,
            transition,
            it.conflicts,
        )
    });
    std::iter::once(head).chain(lines).collect()
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
        "start": time_json(&attempt.start),
        "end": time_json(&attempt.end),
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
        printable(&strip.name),
        state_name(status.state),
        time(&status.header.stamp),
        because(&status.reason),
        strip.start_latitude_deg,
        strip.start_longitude_deg,
        strip.end_latitude_deg,
        strip.end_longitude_deg,
        strip.priority,
        strip.acquisition_speed,
        printable(&status.submitter),
        printable(&status.client_ref),
    );
    if status.parts > 0 {
        let share = 100.0 * status.share;
        text +=
            &format!("  part {} of {} of order {}, {share:.1} % of it\n", status.part, status.parts, status.order_id);
    }
    for (what, id) in [
        ("linked to", status.linked_to),
        ("replaces", status.supersedes),
        ("replaced by", status.superseded_by),
        ("served by the imaging of", status.served_by),
    ] {
        if id != 0 {
            text += &format!("  {what} strip {id}\n");
        }
    }
    text += "chances\n";
    text += &opportunity_table(&report.opportunities);
    text += "attempts\n";
    for attempt in &report.attempts {
        text += &format!(
            "  task {} from {} to {}: {} {}, attitude error {:.3}, elevation {:.1}°\n",
            attempt.task,
            time(&attempt.start),
            time(&attempt.end),
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
            printable(&entry.actor),
            because(&entry.reason),
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operate::planner::status_text;

    #[test]
    fn what_others_wrote_does_not_steer_the_terminal() {
        let evil = || "\x1b[2J\u{9b}1m".to_owned();
        let strip = msg::Strip { name: evil(), ..Default::default() };
        let status = msg::StripStatus {
            reason: evil(),
            submitter: evil(),
            client_ref: evil(),
            strip: strip.clone(),
            ..Default::default()
        };
        let entry = msg::HistoryEntry { actor: evil(), reason: evil(), ..Default::default() };
        let report = msg::StripReport { status: status.clone(), history: vec![entry], ..Default::default() };
        let proposal = msg::PlannerStatus { proposal: 1, strip, ..Default::default() };
        for text in [status_line(&status), report_text(&report), status_text(&proposal)] {
            assert!(text.contains("\\u{1b}[2J"), "{text:?}");
            assert!(!text.chars().any(|letter| letter.is_control() && letter != '\n'), "{text:?}");
        }
    }

    #[test]
    fn people_are_told_seconds_and_times() {
        let at = |sec| swath_msgs::builtin_interfaces::Time { sec, nanosec: 0 };
        let chance =
            msg::Opportunity { t_acq_s: 21.5, transition_found: true, transition_s: 44.0, ..Default::default() };
        let attempt = msg::Attempt { start: at(1_700_000_000), ..Default::default() };
        let report = msg::StripReport { opportunities: vec![chance], attempts: vec![attempt], ..Default::default() };
        let report = report_text(&report);
        let proposal = msg::PlannerStatus {
            proposal: 1,
            t_pre_s: 44.0,
            window_close: at(1_700_000_100),
            deadline_tick: 1,
            deadline: at(1_700_000_060),
            ..Default::default()
        };
        let proposal = status_text(&proposal);
        for text in [&report, &proposal] {
            assert!(!text.contains("tick") && text.contains("44.0 s") && text.contains("2023-11-14T22:1"), "{text}");
        }
        assert!(report.contains("21.5 s") && report.contains("from 2023-11-14T22:13:20Z to -"), "{report}");
        assert!(proposal.contains("until 2023-11-14T22:14:20Z"), "{proposal}");
    }
}
