//! What a report tells of alarms, and of faults that were ordered on the way.

use std::fmt::Write as _;

use anyhow::Result;
use swath_ros::graph;

use super::markup::escaped;
use crate::alarms::messages::{event_name, severity_name};
use crate::debrief::recorded::Recorded;

/// The tables; nothing where nothing happened.
///
/// # Errors
/// When the bag cannot be read.
pub fn tables(html: &mut String, recorded: &Recorded) -> Result<()> {
    faults(html, recorded);
    if recorded.has(&graph::ALARM_EVENTS) {
        events(html, recorded)?;
    }
    Ok(())
}

/// Faults by order: those of the mission's file, and those of operators.
fn faults(html: &mut String, recorded: &Recorded) {
    let faults = &recorded.mission.faults.plan;
    if faults.is_empty() {
        return;
    }
    *html += "<h2>Faults by order</h2>\n<table id=\"faults\">\n<tr><th>fault</th><th>ordered by</th></tr>\n";
    for fault in faults {
        let order = recorded.fault_orders.iter().find(|order| order.fault == *fault);
        let by = order.map_or("the mission", |order| &order.actor);
        _ = writeln!(html, "<tr><td>{}</td><td>{}</td></tr>", escaped(&fault.to_string()), escaped(by));
    }
    *html += "</table>\n";
}

fn events(html: &mut String, recorded: &Recorded) -> Result<()> {
    *html += "<h2>Alarms</h2>\n<table id=\"alarms\">\n<tr><th>time [s]</th><th>alarm</th><th>node</th>\
              <th>severity</th><th>event</th><th>by</th><th>text</th></tr>\n";
    let period = recorded.model.period;
    recorded.for_each(&graph::ALARM_EVENTS, |event| {
        _ = writeln!(
            html,
            "<tr><td>{:.1}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            event.tick as f64 * period.seconds(),
            escaped(&event.name),
            escaped(&event.node),
            severity_name(event.severity),
            event_name(event.event),
            escaped(&event.actor),
            escaped(&event.text),
        );
        Ok(())
    })?;
    *html += "</table>\n";
    Ok(())
}
