//! The alarms of a mission: what causes each, what it does to the mission, and what an operator does about it.

use serde::{Deserialize, Serialize};
use swath_sim::time::TickPeriod;

use super::state::Rules;

/// How grave an alarm is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing: the mission goes on as it is.
    Warn,
    /// Something does not work: the mission goes on with less.
    Error,
    /// The mission does not go on without somebody.
    Critical,
}

impl Severity {
    /// All of them, the gravest last.
    pub const ALL: [Self; 3] = [Self::Warn, Self::Error, Self::Critical];

    /// Its name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Warn => "warn",
            Self::Error => "error",
            Self::Critical => "critical",
        }
    }
}

/// An alarm of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Definition {
    /// Its name; the node that raises it is told beside it.
    pub name: &'static str,
    /// How grave it is.
    pub severity: Severity,
    /// Reports in a row before it is raised.
    pub violations: u32,
    /// How long nothing may be wrong before it returns [s of simulated time].
    pub off_delay_s: f64,
    /// Whether its reports tell of moments.
    pub momentary: bool,
    /// What causes it.
    pub cause: &'static str,
    /// What it does to the mission.
    pub effect: &'static str,
    /// What an operator does.
    pub response: &'static str,
}

/// How long a moment stands [s].
const MOMENT_S: f64 = 5.0;

const fn lasting(name: &'static str, severity: Severity, words: [&'static str; 3]) -> Definition {
    let [cause, effect, response] = words;
    Definition { name, severity, violations: 1, off_delay_s: 1.0, momentary: false, cause, effect, response }
}

const fn moment(name: &'static str, severity: Severity, words: [&'static str; 3]) -> Definition {
    Definition { off_delay_s: MOMENT_S, momentary: true, ..lasting(name, severity, words) }
}

/// A node is not there; the launcher tells of each by `NODE lost`.
const NODE_LOST: Definition = lasting(
    "lost",
    Severity::Error,
    [
        "the process of the node has ended, or does not answer",
        "what the node does is not done; the satellite flies on with what it has",
        "nothing, if it returns within seconds; else look at its log and start it again",
    ],
);

/// A node is there and says nothing; the launcher tells of each by `NODE silent`.
const NODE_SILENT: Definition = lasting(
    "silent",
    Severity::Warn,
    [
        "the main loop of the node has given no sign of life for `supervision.warn_s`",
        "what the node does waits; after `supervision.kill_s` it is killed and started again",
        "nothing, if it returns; else look at what its machine is doing",
    ],
);

/// Every alarm that has a name of its own.
pub const DEFINITIONS: &[Definition] = &[
    lasting("wheel x", Severity::Error, WHEEL),
    lasting("wheel y", Severity::Error, WHEEL),
    lasting("wheel z", Severity::Error, WHEEL),
    lasting(
        "gyro biased",
        Severity::Warn,
        [
            "rates from the gyro differ from the change of the star tracker's attitude",
            "the rates are corrected by the difference; without a star tracker the attitude drifts",
            "acknowledge; plan for a calibration",
        ],
    ),
    lasting(
        "star tracker out",
        Severity::Warn,
        [
            "the star tracker repeats its last attitude",
            "the attitude is carried on with the gyro, and is off by its errors in time",
            "acknowledge; judge images of this time by their geometry",
        ],
    ),
    lasting(
        "battery low",
        Severity::Warn,
        [
            "the charge is less than 5 % of the capacity above the battery's floor",
            "the shield charges instead of imaging, where it is on; at nothing the satellite comes into safe mode",
            "nothing, with a shield; else ask for less, or switch the shield on",
        ],
    ),
    lasting(
        "storage full",
        Severity::Warn,
        [
            "more than 95 % of the on-board storage is taken",
            "an image that finds no room is thrown away",
            "look at the next contacts; ask for less until then",
        ],
    ),
    lasting(
        "momentum high",
        Severity::Warn,
        [
            "a wheel has more than 80 % of the momentum that it may have",
            "slews take longer; over the limit the wheel counts as failed",
            "look whether rods or thrusters take it out",
        ],
    ),
    lasting(
        "power or wheels failed",
        Severity::Error,
        [
            "the battery was empty, or a wheel's momentum was over its limit",
            "the satellite charges or takes momentum out, and images nothing until that is mended",
            "look at what was flown before; it goes on by itself",
        ],
    ),
    lasting(
        "planner replaced",
        Severity::Error,
        [
            "the planner failed, is not there, or does not know what the satellite has lost",
            "another planner decides in its place",
            "look at the reason; choose another planner if it stays",
        ],
    ),
    lasting(
        "safe mode",
        Severity::Critical,
        [
            "a node was lost more often than it is started again",
            "the attitude is held, nothing is imaged; what was acknowledged is kept",
            "look at the node's log; let the planner choose again when the cause is mended: `swath planner mode autonomous`",
        ],
    ),
    lasting(
        "ground silent",
        Severity::Error,
        [
            "the satellite has heard no frame from the ground for `command_loss_h`",
            "it holds its attitude and images nothing until it hears one (`command_loss_mode`: it goes on)",
            "look at the next passes (`swath passes`) and at the stations",
        ],
    ),
    lasting(
        "messages dropped",
        Severity::Warn,
        [
            "messages between nodes are lost, by order",
            "what is not answered is asked again; ticks of a paced mission may pass without a torque command",
            "nothing, if it returns; plan no drill for the time of an important pass",
        ],
    ),
    lasting(
        "frames lost",
        Severity::Warn,
        [
            "frames of the radio are lost, by order",
            "what does not get through is sent again; orders and results come later, or at the next pass",
            "nothing, if it returns; plan no drill for the time of an important pass",
        ],
    ),
    lasting(
        "store full",
        Severity::Error,
        [
            "there is no room where the requests are kept",
            "no request is taken, changed or answered; what was acknowledged is kept, and the satellite flies on",
            "make room: what waits is written as soon as there is some",
        ],
    ),
    lasting(
        "bag full",
        Severity::Error,
        [
            "there is no room where the bag is written",
            "nothing is recorded; the bag is whole up to there, and goes on in a new file once there is room",
            "make room",
        ],
    ),
    moment(
        "planner late",
        Severity::Warn,
        [
            "a task did not come before its deadline",
            "the attitude is held for a while, then the planner is asked again",
            "choose a faster planner or a longer deadline, if it goes on",
        ],
    ),
];

const WHEEL: [&str; 3] = [
    "a reaction wheel gives less than three quarters of the torque commanded",
    "slews take longer; with a wheel lost, only some strips can be pointed at",
    "acknowledge; expect fewer images, and let a planner decide that flies slews in its head",
];

/// What holds for an alarm by name. `None` for one without a definition of its own, which tells of a moment.
#[must_use]
pub fn definition(name: &str) -> Option<&'static Definition> {
    let of_node = || match name.rsplit_once(' ') {
        Some((_, "lost")) => Some(&NODE_LOST),
        Some((_, "silent")) => Some(&NODE_SILENT),
        _ => None,
    };
    DEFINITIONS.iter().find(|definition| definition.name == name).or_else(of_node)
}

/// When the condition of an alarm counts.
#[must_use]
pub fn rules(name: &str, period: TickPeriod) -> Rules {
    let (violations, off_delay_s, momentary) =
        definition(name).map_or((1, MOMENT_S, true), |it| (it.violations, it.off_delay_s, it.momentary));
    Rules { violations, off_delay: period.ticks_ceil(off_delay_s), momentary }
}

/// The table as it stands in `docs/alarms.md`.
#[must_use]
pub fn table() -> String {
    let mut text =
        String::from("| alarm | severity | cause | effect | what to do |\n| --- | --- | --- | --- | --- |\n");
    let of_nodes =
        [Definition { name: "*NODE* lost", ..NODE_LOST }, Definition { name: "*NODE* silent", ..NODE_SILENT }];
    for it in DEFINITIONS.iter().chain(&of_nodes) {
        let severity = it.severity.name();
        text += &format!("| {} | {severity} | {} | {} | {} |\n", it.name, it.cause, it.effect, it.response);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_alarm_stands_in_the_documents() {
        let docs = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/alarms.md")).unwrap();
        assert!(docs.contains(&table()), "docs/alarms.md lacks:\n{}", table());
    }

    #[test]
    fn names_are_distinct_and_found() {
        for definition in DEFINITIONS {
            assert_eq!(super::definition(definition.name), Some(definition));
        }
        assert_eq!(definition("guidance lost").map(|it| it.severity), Some(Severity::Error));
        assert_eq!(definition("guidance silent").map(|it| it.severity), Some(Severity::Warn));
        assert_eq!(definition("ground silent").map(|it| it.severity), Some(Severity::Error));
        assert_eq!(definition("task refused"), None);
    }
}
