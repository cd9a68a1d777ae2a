//! What a report tells of the radio: its passes, what had come up and down by their ends, and how far the satellite did
//! what the ground had predicted.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;

use super::markup::escaped;
use crate::debrief::recorded::Recorded;

/// What was told of the radio.
#[derive(Default)]
pub struct RadioStory {
    /// Passes that have begun, by their rise.
    pub passes: Vec<Pass>,
    /// Plans of the ground, in the order in which they were made.
    pub plans: Vec<Plan>,
}

/// A pass over a station.
pub struct Pass {
    /// Its station.
    pub station: String,
    /// When the station hears the satellite first [s].
    pub rise_s: f64,
    /// When it hears it no more [s].
    pub set_s: f64,
    /// Greatest elevation [deg].
    pub elevation_deg: f64,
    /// What the ground knew at its end; nothing if the flight ended before.
    pub known: Option<Known>,
}

/// What the ground knows of what came up and down.
pub struct Known {
    /// Orders that are not known to be on board.
    pub waiting: u64,
    /// Requests that are known to be on board.
    pub on_board: u64,
    /// Requests that are known to be imaged.
    pub imaged: u64,
    /// Images that are on the ground as a whole.
    pub delivered: u64,
}

/// A plan of the ground.
pub struct Plan {
    /// When it was made [s].
    pub made_s: f64,
    /// When the housekeeping that it rests on was told [s].
    pub since_s: f64,
    /// Imaging that it foretells: when it begins and ends [s].
    pub imaging: Vec<(f64, f64)>,
    /// Imaging tasks that had come to be known, and how many of them were exactly as predicted.
    pub compared: (u64, u64),
    /// How often flight and prediction had parted, and why they did last.
    pub partings: (u64, String),
}

impl RadioStory {
    /// Gathers it; empty in a mission without a radio.
    ///
    /// # Errors
    /// When the bag cannot be read.
    pub fn of(recorded: &Recorded) -> Result<Self> {
        let seconds = |tick: u64| tick as f64 * recorded.model.period.seconds();
        let mut story = Self::default();
        if recorded.has(&graph::LINK_STATUS) {
            let mut statuses = Vec::new();
            recorded.for_each(&graph::LINK_STATUS, |status| {
                statuses.push(status);
                Ok(())
            })?;
            story.passes = passes(&statuses, seconds);
        }
        if recorded.has(&graph::PREDICTED_PLAN) {
            recorded.for_each(&graph::PREDICTED_PLAN, |plan| {
                story.plans.push(Plan {
                    made_s: seconds(plan.tick),
                    since_s: seconds(plan.since_tick),
                    imaging: plan.tasks.iter().map(|it| (seconds(it.imaging_tick), seconds(it.end_tick))).collect(),
                    compared: (plan.compared, plan.equal),
                    partings: (plan.partings, plan.parted_reason),
                });
                Ok(())
            })?;
        }
        Ok(story)
    }

    /// Imaging that was foretold [s]: of each plan what begins before the next one was made.
    pub fn foretold(&self) -> Vec<(f64, f64)> {
        let until = |at: usize| self.plans.get(at + 1).map_or(f64::INFINITY, |next| next.made_s);
        let of = |(at, plan): (usize, &Plan)| {
            let span = plan.made_s..until(at);
            plan.imaging.iter().filter(move |(begin, _)| span.contains(begin)).copied().collect::<Vec<_>>()
        };
        self.plans.iter().enumerate().flat_map(of).collect()
    }

    /// The tables; nothing in a mission without a radio.
    pub fn tables(&self, html: &mut String) {
        if !self.passes.is_empty() {
            self.write_passes(html);
        }
        if !self.plans.is_empty() {
            self.write_plans(html);
        }
    }

    fn write_passes(&self, html: &mut String) {
        *html += "<h2>Passes</h2>\n<table id=\"passes\">\n<tr><th>station</th><th>rise [s]</th><th>set [s]</th>\
                  <th>elevation [deg]</th><th>orders waiting</th><th>on board</th><th>known imaged</th>\
                  <th>images down</th></tr>\n";
        for pass in &self.passes {
            let known = pass.known.as_ref();
            let cell = |count: fn(&Known) -> u64| known.map_or_else(|| "-".to_owned(), |it| count(it).to_string());
            _ = writeln!(
                html,
                "<tr><td>{}</td><td>{:.1}</td><td>{:.1}</td><td>{:.1}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>\
                 </tr>",
                escaped(&pass.station),
                pass.rise_s,
                pass.set_s,
                pass.elevation_deg,
                cell(|it| it.waiting),
                cell(|it| it.on_board),
                cell(|it| it.imaged),
                cell(|it| it.delivered),
            );
        }
        *html += "</table>\n";
    }

    /// The plans from which on more was known of how flight and prediction agree.
    fn write_plans(&self, html: &mut String) {
        *html += "<h2>Plan and flight</h2>\n<table id=\"plans\">\n<tr><th>plan of [s]</th><th>from the housekeeping of \
                  [s]</th><th>imaging foretold</th><th>tasks known</th><th>as predicted</th><th>parted</th>\
                  <th>last because</th></tr>\n";
        let mut before = None;
        for plan in &self.plans {
            let ((known, equal), (partings, reason)) = (plan.compared, &plan.partings);
            if before.replace((known, partings)) == Some((known, partings)) {
                continue;
            }
            _ = writeln!(
                html,
                "<tr><td>{:.1}</td><td>{:.1}</td><td>{}</td><td>{known}</td><td>{equal}</td><td>{partings}</td>\
                 <td>{}</td></tr>",
                plan.made_s,
                plan.since_s,
                plan.imaging.len(),
                escaped(reason),
            );
        }
        *html += "</table>\n";
    }
}

/// Passes that have begun by the last status, each once.
fn passes(statuses: &[msg::LinkStatus], seconds: impl Fn(u64) -> f64) -> Vec<Pass> {
    let end = statuses.last().map_or(0, |status| status.tick);
    let told: BTreeMap<(u64, &str), &msg::RadioPass> =
        statuses.iter().flat_map(|it| &it.passes).map(|pass| ((pass.rise_tick, pass.station.as_str()), pass)).collect();
    // The status by which a pass is over; passes of several stations may overlap.
    let known = |pass: &msg::RadioPass| {
        statuses.iter().find(|status| status.tick >= pass.set_tick).map(|status| Known {
            waiting: status.waiting_orders,
            on_board: status.on_board,
            imaged: status.imaged,
            delivered: status.delivered,
        })
    };
    let begun = told.into_values().filter(|pass| pass.rise_tick <= end);
    begun
        .map(|pass| Pass {
            station: pass.station.clone(),
            rise_s: seconds(pass.rise_tick),
            set_s: seconds(pass.set_tick),
            elevation_deg: pass.elevation.to_degrees(),
            known: known(pass),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass(station: &str, rise_tick: u64, set_tick: u64) -> msg::RadioPass {
        msg::RadioPass { station: station.to_owned(), rise_tick, set_tick, ..msg::RadioPass::default() }
    }

    #[test]
    fn each_pass_that_has_begun_is_told_once_with_what_was_known_at_its_end() {
        let (first, second, third) = (pass("a", 10, 20), pass("b", 15, 30), pass("a", 90, 99));
        let status = |tick: u64, imaged: u64, passes: &[&msg::RadioPass]| msg::LinkStatus {
            tick,
            imaged,
            passes: passes.iter().map(|&pass| pass.clone()).collect(),
            ..msg::LinkStatus::default()
        };
        let statuses = [
            status(0, 0, &[&first, &second, &third]),
            status(12, 1, &[&first, &second, &third]),
            status(20, 2, &[&second, &third]),
            status(30, 3, &[&third]),
        ];
        let told = passes(&statuses, |tick| tick as f64 / 2.0);
        let told: Vec<_> =
            told.iter().map(|it| (&*it.station, it.rise_s, it.set_s, it.known.as_ref().map(|it| it.imaged))).collect();
        assert_eq!(told, [("a", 5.0, 10.0, Some(2)), ("b", 7.5, 15.0, Some(3))]);
    }

    #[test]
    fn what_a_newer_plan_says_counts() {
        let plan = |made_s: f64, begins: &[f64]| Plan {
            made_s,
            since_s: 0.0,
            imaging: begins.iter().map(|begin| (*begin, begin + 1.0)).collect(),
            compared: (0, 0),
            partings: (0, String::new()),
        };
        let story = RadioStory { passes: Vec::new(), plans: vec![plan(0.0, &[5.0, 15.0]), plan(10.0, &[5.0, 16.0])] };
        assert_eq!(story.foretold(), [(5.0, 6.0), (16.0, 17.0)]);
    }
}
