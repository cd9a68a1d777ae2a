//! The report's page: facts, plots and tables in one HTML text that needs nothing else.

use std::fmt::Write as _;

use anyhow::Result;
use swath_mission::time_text::date;
use swath_msgs::swath_msgs as msg;
use swath_sim::task::Totals;
use swath_sim::time::TickPeriod;

use super::markup::escaped;
use super::story::Story;
use super::{alarms, figures};
use crate::debrief::recorded::Recorded;

const STYLE: &str = include_str!("style.css");

/// The page.
///
/// # Errors
/// When a plot cannot be drawn, or the bag cannot be read.
pub fn page(recorded: &Recorded, story: &Story) -> Result<String> {
    let name = escaped(&recorded.mission.name);
    // The policy keeps the page from asking anything of a network.
    let policy = "default-src 'none'; style-src 'unsafe-inline'";
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <title>{name}: mission report</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{name}</h1>\n"
    );
    facts(&mut html, recorded, story);
    orders(&mut html, story);
    alarms::tables(&mut html, recorded)?;
    story.radio.tables(&mut html);
    plots(&mut html, story)?;
    tasks(&mut html, story);
    decisions(&mut html, recorded);
    html += "</body>\n</html>\n";
    Ok(html)
}

fn facts(html: &mut String, recorded: &Recorded, story: &Story) {
    let mut totals = Totals::default();
    recorded.tasks.iter().for_each(|(record, _)| totals.add(record));
    let success = match totals.attempts {
        0 => "-".to_owned(),
        _ => format!("{:.1} %", 100.0 * totals.success_rate()),
    };
    let mission = &recorded.mission;
    *html += "<table id=\"facts\">\n";
    for (name, value) in [
        ("planner", mission.planner.to_string()),
        ("seed", mission.seed.to_string()),
        ("epoch", format!("{} UTC", date(mission.epoch_unix_s.into()))),
        ("flown", format!("{:.0} s, {:.2} orbits", story.end_s, story.end_s / story.orbit_s)),
        ("recording", if recorded.complete { "complete" } else { "ends before the mission" }.to_owned()),
        ("strips accepted", story.strips.len().to_string()),
        ("attempts", totals.attempts.to_string()),
        ("strips imaged", totals.fulfilled.to_string()),
        ("success rate", success),
        ("failed for attitude", totals.failed_attitude.to_string()),
        ("failed for elevation", totals.failed_elevation.to_string()),
        ("reward", format!("{:.3}", totals.reward)),
    ] {
        _ = writeln!(html, "<tr><th>{name}</th><td>{}</td></tr>", escaped(&value));
    }
    *html += "</table>\n";
}

/// What share of each line and area is imaged.
fn orders(html: &mut String, story: &Story) {
    if story.orders.is_empty() {
        return;
    }
    *html += "<h2>Orders</h2>\n<table id=\"orders\">\n<tr><th>order</th><th>submitter</th><th>strips</th>\
              <th>priority</th><th>imaged</th><th>reward</th></tr>\n";
    for order in &story.orders {
        _ = writeln!(
            html,
            "<tr><td>{} {}</td><td>{}</td><td>{}</td><td>{:.3}</td><td>{:.1} %</td><td>{:.3}</td></tr>",
            order.order_id,
            escaped(&order.name),
            escaped(&order.submitter),
            order.strips,
            order.priority,
            100.0 * order.imaged,
            order.reward,
        );
    }
    *html += "</table>\n";
}

fn plots(html: &mut String, story: &Story) -> Result<()> {
    let speed = (&story.wheel_speed, story.wheel_speed_max_rpm, "wheel speed [rpm]");
    let torque = (&story.wheel_torque, story.wheel_torque_max_Nm, "wheel torque [N m]");
    let map = "Ground track (blue) and strips: imaged (green), tried in vain (red), not tried (grey). \
               Coastlines: Natural Earth.";
    let mut timeline =
        "Tasks: transition (amber), imaging with success (green) or without (red), waiting (grey).".to_owned();
    if !story.radio.passes.is_empty() || !story.radio.plans.is_empty() {
        timeline += " Above them passes (blue), below them imaging as the ground had predicted it (purple).";
    }
    for (id, title, svg) in [
        ("map", map, figures::map(story)?),
        ("timeline", &*timeline, figures::timeline(story)?),
        ("attitude", "Attitude error.", figures::attitude_error(story)?),
        ("wheel-speed", "Speeds of the wheels.", figures::wheels(story, speed.0, speed.1, speed.2)?),
        ("wheel-torque", "Torques of the wheels.", figures::wheels(story, torque.0, torque.1, torque.2)?),
        ("reward", "Reward earned.", figures::reward(story)?),
        ("requests", "Strip requests by state.", figures::requests(story)?),
    ] {
        _ = writeln!(html, "<figure id=\"{id}\">\n<figcaption>{title}</figcaption>\n{svg}</figure>");
    }
    if let Some(resources) = &story.resources {
        let title =
            "Battery, storage and the wheel with most momentum, as shares of what there is room for; grey: sunlight.";
        let svg = figures::resources(story.end_s, resources)?;
        _ = writeln!(html, "<figure id=\"resources\">\n<figcaption>{title}</figcaption>\n{svg}</figure>");
    }
    Ok(())
}

fn tasks(html: &mut String, story: &Story) {
    *html += "<h2>Tasks</h2>\n<table id=\"tasks\">\n<tr><th>task</th><th>start [s]</th><th>end [s]</th><th>strip</th>\
              <th>T_pre [s]</th><th>outcome</th><th>attitude error</th><th>elevation [deg]</th><th>reward</th></tr>\n";
    for (number, task) in story.tasks.iter().enumerate() {
        let (start, end) = (task.start_s, task.end_s);
        _ = write!(html, "<tr><td>{number}</td><td>{start:.1}</td><td>{end:.1}</td>");
        let Some((id, name)) = &task.strip else {
            *html += "<td>wait</td><td></td><td></td><td></td><td></td><td></td></tr>\n";
            continue;
        };
        let outcome = task.reason.as_deref().unwrap_or("imaged");
        let (class, error) = (if task.success { "good" } else { "bad" }, task.max_attitude_error);
        _ = writeln!(
            html,
            "<td>{id} {}</td><td>{:.1}</td><td class=\"{class}\">{outcome}</td><td>{error:.4}</td><td>{:.1}</td>\
             <td>{:.3}</td></tr>",
            escaped(name),
            task.t_pre_s,
            task.min_elevation_deg,
            task.reward,
        );
    }
    *html += "</table>\n";
}

fn decisions(html: &mut String, recorded: &Recorded) {
    let period = recorded.model.period;
    *html += "<h2>Decisions</h2>\n<div id=\"decisions\">\n";
    for (task, offer) in &recorded.offers {
        let decision = recorded.decisions.get(task);
        let chosen = decision.and_then(|decision| offer.candidates.get(decision.chosen as usize));
        let choice = match (decision, chosen) {
            (Some(decision), Some(candidate)) => format!(
                "strip {} {}, T_pre {:.1} s",
                candidate.strip.id,
                escaped(&candidate.strip.name),
                period.duration_s(decision.t_pre_ticks)
            ),
            (Some(_), None) => "wait".to_owned(),
            (None, _) => "not recorded".to_owned(),
        };
        let (time, count) = (offer.tick as f64 * period.seconds(), offer.candidates.len());
        _ = writeln!(
            html,
            "<details><summary>{task}: {time:.1} s, {count} candidates: {choice}</summary>\n<table>\n\
             <tr><th>strip</th><th>priority</th><th>window [s]</th><th>T_acq [s]</th><th>probability</th></tr>"
        );
        for (number, candidate) in offer.candidates.iter().enumerate() {
            let chosen = decision.is_some_and(|decision| decision.chosen as usize == number);
            let probability = decision.and_then(|decision| decision.probabilities.get(number));
            candidate_row(html, candidate, chosen, probability, period);
        }
        *html += "</table></details>\n";
    }
    *html += "</div>\n";
}

fn candidate_row(
    html: &mut String,
    candidate: &msg::Candidate,
    chosen: bool,
    probability: Option<&f32>,
    period: TickPeriod,
) {
    let seconds = |tick: u64| tick as f64 * period.seconds();
    let strip = &candidate.strip;
    _ = writeln!(
        html,
        "<tr{}><td>{} {}</td><td>{:.3}</td><td>{:.1} to {:.1}</td><td>{:.1}</td><td>{}</td></tr>",
        if chosen { " class=\"chosen\"" } else { "" },
        strip.id,
        escaped(&strip.name),
        strip.priority,
        seconds(candidate.window_open_tick),
        seconds(candidate.window_close_tick),
        period.duration_s(candidate.t_acq_ticks),
        probability.map_or_else(|| "-".to_owned(), |p| format!("{p:.3}")),
    );
}
