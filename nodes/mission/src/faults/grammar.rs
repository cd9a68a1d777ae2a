//! One fault as people write it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use swath_sim::vehicle::faults::{Fault, WheelFault};
use thiserror::Error;

/// A node that can be made to fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Process {
    /// The satellite itself, and the clock.
    Spacecraft,
    /// Flies the task in hand.
    Guidance,
    /// Chooses the next task.
    Planner,
    /// Keeps the requests.
    RequestManager,
    /// Writes the bag.
    Recorder,
    /// Keeps what was uplinked, in missions with a radio.
    Catalogue,
    /// The radio.
    Link,
}

impl Process {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Spacecraft,
        Self::Guidance,
        Self::Planner,
        Self::RequestManager,
        Self::Recorder,
        Self::Catalogue,
        Self::Link,
    ];

    /// Those that a mission in one process can be without.
    pub const IN_PROCESS: [Self; 3] = [Self::Guidance, Self::Planner, Self::RequestManager];

    /// Name of the node.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Spacecraft => "spacecraft",
            Self::Guidance => "guidance",
            Self::Planner => "planner",
            Self::RequestManager => "request_manager",
            Self::Recorder => "recorder",
            Self::Catalogue => "catalogue",
            Self::Link => "link",
        }
    }

    /// Whether it is part of the radio.
    #[must_use]
    pub fn is_of_radio(self) -> bool {
        matches!(self, Self::Catalogue | Self::Link)
    }
}

/// How a process fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failure {
    /// It ends at once, without a word.
    Kill,
    /// It is there and does nothing.
    Hang,
}

/// What fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// A node.
    Process(Process, Failure),
    /// This share of all messages is dropped, 0 to 1.
    Drop(f64),
    /// This share of the radio's frames is lost besides, 0 to 1.
    FramesLost(f64),
    /// A wheel or a sensor.
    Vehicle(Fault),
    /// Nothing can be written to the store of requests.
    StoreFull,
    /// Nothing can be written to the bag.
    BagFull,
}

/// A fault, when it begins and how long it lasts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PlannedFault {
    /// What fails.
    pub what: What,
    /// When it begins [s since the epoch]; at once when it is left out.
    pub at_s: Option<f64>,
    /// How long it lasts [s]; for good when it is left out. A process that is killed is replaced at once.
    pub for_s: Option<f64>,
}

/// Why a text is no fault.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GrammarError {
    /// It has no colon.
    #[error("`{text}` is no fault: expected PART:WHAT@TIME, such as guidance:kill@120s or wheel2:dead@600s")]
    Form {
        /// The text.
        text: String,
    },
    /// There is no such part.
    #[error(
        "`{text}`: there is no part `{part}`; there are spacecraft, guidance, planner, request_manager, recorder, catalogue, \
         link, topic, wheel1, wheel2, wheel3, gyro, startracker, store and bag"
    )]
    Part {
        /// The text.
        text: String,
        /// The part named.
        part: String,
    },
    /// The part cannot fail like that.
    #[error("`{text}`: {part} cannot `{what}`; it can {can}")]
    What {
        /// The text.
        text: String,
        /// The part named.
        part: String,
        /// What it should do.
        what: String,
        /// What it can.
        can: &'static str,
    },
    /// A number that is none, or outside its limits.
    #[error("`{text}`: {name} is `{value}`, not {wanted}")]
    Number {
        /// The text.
        text: String,
        /// What it is.
        name: &'static str,
        /// The value given.
        value: String,
        /// What is wanted.
        wanted: &'static str,
    },
}

/// Longest time that a fault may begin at or last for [s]: a hundred years.
const TIME_MAX_S: f64 = 3.2e9;
/// Greatest bias of the gyro [deg/s].
const BIAS_MAX_DEG_S: f64 = 1.0;

impl FromStr for PlannedFault {
    type Err = GrammarError;

    fn from_str(text: &str) -> Result<Self, GrammarError> {
        let form = || GrammarError::Form { text: text.to_owned() };
        let (part, rest) = text.trim().split_once(':').ok_or_else(form)?;
        let (what, when) = match rest.split_once('@') {
            Some((what, when)) => (what, Some(when)),
            None => (rest, None),
        };
        let (at, lasts) = match when.map(|when| when.split_once('+').unwrap_or((when, ""))) {
            Some((at, "")) if !when.is_some_and(|when| when.ends_with('+')) => (Some(at), None),
            Some((at, lasts)) => (Some(at), Some(lasts)),
            None => (None, None),
        };
        // Without a time, what lasts stands after the fault itself.
        let (what, lasts) = match (at, what.split_once('+')) {
            (None, Some((what, lasts))) => (what, Some(lasts)),
            _ => (what, lasts),
        };
        let at_s = at.map(|value| seconds(text, "the time", value, "seconds such as 120s, 2min or 1h")).transpose()?;
        let lasting = |value| seconds(text, "the duration", value, "seconds above 0 such as 10s, 2min or 1h");
        let for_s = lasts.map(lasting).transpose()?;
        if for_s == Some(0.0) {
            return Err(number(text, "the duration", lasts.unwrap_or(""), "seconds above 0 such as 10s, 2min or 1h"));
        }
        Ok(Self { what: parse_what(text, part.trim(), what.trim())?, at_s, for_s })
    }
}

fn parse_what(text: &str, part: &str, what: &str) -> Result<What, GrammarError> {
    let cannot = |can| {
        let (text, part, what) = (text.to_owned(), part.to_owned(), what.to_owned());
        Err(GrammarError::What { text, part, what, can })
    };
    if let Some(process) = Process::ALL.into_iter().find(|process| process.name() == part) {
        return match (process, what.split_once(' ')) {
            (Process::Link, Some(("drop", value))) => {
                Ok(What::FramesLost(percent(text, "the share dropped", value.trim())?))
            }
            (Process::Link, _) if !matches!(what, "kill" | "hang") => {
                cannot("kill, hang, or drop a share of its frames, such as drop 20%")
            }
            _ => of_process(process, what).map_or_else(|| cannot("kill or hang"), Ok),
        };
    }
    match (part, what.split_once(' ').map_or((what, None), |(word, value)| (word, Some(value.trim())))) {
        ("wheel1" | "wheel2" | "wheel3", (word, value)) => {
            let wheel = usize::from(part.as_bytes()[5] - b'1');
            let how = match (word, value) {
                ("dead", None) => WheelFault::Dead,
                ("stuck", None) => WheelFault::Stuck,
                ("weak", Some(value)) => WheelFault::Weak(percent(text, "the share lost", value)?),
                _ => return cannot("be dead, stuck or weak by a share, such as weak 50%"),
            };
            Ok(What::Vehicle(Fault::Wheel(wheel, how)))
        }
        ("gyro", ("bias", Some(value))) => bias(text, value),
        ("gyro", _) => cannot("have a bias, such as bias 0.01deg/s"),
        ("startracker", ("out", None)) => Ok(What::Vehicle(Fault::StarTrackerOut)),
        ("startracker", _) => cannot("be out"),
        ("topic", ("drop", Some(value))) => Ok(What::Drop(percent(text, "the share dropped", value)?)),
        ("topic", _) => cannot("drop a share of its messages, such as drop 20%"),
        ("store", ("full", None)) => Ok(What::StoreFull),
        ("bag", ("full", None)) => Ok(What::BagFull),
        ("store" | "bag", _) => cannot("be full"),
        _ => Err(GrammarError::Part { text: text.to_owned(), part: part.to_owned() }),
    }
}

fn of_process(process: Process, what: &str) -> Option<What> {
    match what {
        "kill" => Some(What::Process(process, Failure::Kill)),
        "hang" => Some(What::Process(process, Failure::Hang)),
        _ => None,
    }
}

fn bias(text: &str, value: &str) -> Result<What, GrammarError> {
    let wanted = "a rate such as 0.01deg/s, up to 1deg/s either way and not 0";
    let refused = || number(text, "the bias", value, wanted);
    let deg_s: f64 = value.strip_suffix("deg/s").and_then(|it| it.trim().parse().ok()).ok_or_else(refused)?;
    if deg_s.abs() > 0.0 && deg_s.abs() <= BIAS_MAX_DEG_S {
        Ok(What::Vehicle(Fault::GyroBias(deg_s.to_radians())))
    } else {
        Err(refused())
    }
}

fn percent(text: &str, name: &'static str, value: &str) -> Result<f64, GrammarError> {
    let share = value.strip_suffix('%').and_then(|it| it.trim().parse::<f64>().ok());
    share
        .filter(|share| *share > 0.0 && *share <= 100.0)
        .map(|share| share / 100.0)
        .ok_or_else(|| number(text, name, value, "a share above 0% and up to 100%"))
}

fn seconds(text: &str, name: &'static str, value: &str, wanted: &'static str) -> Result<f64, GrammarError> {
    let value = value.trim();
    let units = [("min", 60.0), ("h", 3600.0), ("s", 1.0)];
    let parsed = units.iter().find_map(|(unit, scale)| {
        let number: f64 = value.strip_suffix(unit)?.trim().parse().ok()?;
        Some(number * scale)
    });
    parsed.filter(|it| (0.0..=TIME_MAX_S).contains(it)).ok_or_else(|| number(text, name, value, wanted))
}

fn number(text: &str, name: &'static str, value: &str, wanted: &'static str) -> GrammarError {
    GrammarError::Number { text: text.to_owned(), name, value: value.to_owned(), wanted }
}

/// The shortest decimal that `read` takes for `value`, which is about `near`.
fn shortest(value: f64, near: f64, read: fn(f64) -> f64) -> f64 {
    let rounded = (0..17).filter_map(|digits| format!("{near:.digits$e}").parse().ok());
    let mut candidates = rounded.chain([near, near.next_up(), near.next_down()]);
    candidates.find(|&candidate| read(candidate) == value).unwrap_or(near)
}

fn percentage(share: f64) -> f64 {
    shortest(share, share * 100.0, |percent| percent / 100.0)
}

fn degrees(rad: f64) -> f64 {
    shortest(rad, rad.to_degrees(), f64::to_radians)
}

impl What {
    /// Whether it can only happen where there is a radio.
    #[must_use]
    pub fn is_of_radio(&self) -> bool {
        match self {
            Self::Process(process, _) => process.is_of_radio(),
            Self::FramesLost(_) => true,
            _ => false,
        }
    }

    /// Name of the part that fails.
    #[must_use]
    pub fn part(&self) -> &'static str {
        match self {
            Self::Process(process, _) => process.name(),
            Self::Drop(_) => "topic",
            Self::FramesLost(_) => "link",
            Self::Vehicle(Fault::Wheel(0, _)) => "wheel1",
            Self::Vehicle(Fault::Wheel(1, _)) => "wheel2",
            Self::Vehicle(Fault::Wheel(..)) => "wheel3",
            Self::Vehicle(Fault::GyroBias(_)) => "gyro",
            Self::Vehicle(Fault::StarTrackerOut) => "startracker",
            Self::StoreFull => "store",
            Self::BagFull => "bag",
        }
    }
}

impl fmt::Display for What {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = self.part();
        match *self {
            Self::Process(_, Failure::Kill) => write!(f, "{part}:kill"),
            Self::Process(_, Failure::Hang) => write!(f, "{part}:hang"),
            Self::Drop(share) | Self::FramesLost(share) => write!(f, "{part}:drop {}%", percentage(share)),
            Self::Vehicle(Fault::Wheel(_, WheelFault::Dead)) => write!(f, "{part}:dead"),
            Self::Vehicle(Fault::Wheel(_, WheelFault::Stuck)) => write!(f, "{part}:stuck"),
            Self::Vehicle(Fault::Wheel(_, WheelFault::Weak(lost))) => write!(f, "{part}:weak {}%", percentage(lost)),
            Self::Vehicle(Fault::GyroBias(rad_s)) => write!(f, "{part}:bias {}deg/s", degrees(rad_s)),
            Self::Vehicle(Fault::StarTrackerOut) => write!(f, "{part}:out"),
            Self::StoreFull | Self::BagFull => write!(f, "{part}:full"),
        }
    }
}

impl fmt::Display for PlannedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.what)?;
        if let Some(at_s) = self.at_s {
            write!(f, "@{at_s}s")?;
        }
        self.for_s.map_or(Ok(()), |for_s| write!(f, "+{for_s}s"))
    }
}

impl From<PlannedFault> for String {
    fn from(fault: PlannedFault) -> Self {
        fault.to_string()
    }
}

impl TryFrom<String> for PlannedFault {
    type Error = GrammarError;

    fn try_from(text: String) -> Result<Self, GrammarError> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn faults_are_read_and_written() {
        let cases = [
            ("guidance:kill@120s", What::Process(Process::Guidance, Failure::Kill), Some(120.0), None),
            ("planner:hang@300s+10s", What::Process(Process::Planner, Failure::Hang), Some(300.0), Some(10.0)),
            ("topic:drop 20%@400s+60s", What::Drop(0.2), Some(400.0), Some(60.0)),
            ("link:drop 20%@400s+60s", What::FramesLost(0.2), Some(400.0), Some(60.0)),
            ("link:kill@400s", What::Process(Process::Link, Failure::Kill), Some(400.0), None),
            ("catalogue:hang@400s", What::Process(Process::Catalogue, Failure::Hang), Some(400.0), None),
            ("wheel2:dead@600s", What::Vehicle(Fault::Wheel(1, WheelFault::Dead)), Some(600.0), None),
            ("wheel1:stuck@600s", What::Vehicle(Fault::Wheel(0, WheelFault::Stuck)), Some(600.0), None),
            ("wheel3:weak 50%@600s", What::Vehicle(Fault::Wheel(2, WheelFault::Weak(0.5))), Some(600.0), None),
            ("gyro:bias 0.01deg/s@700s", What::Vehicle(Fault::GyroBias(0.01f64.to_radians())), Some(700.0), None),
            ("startracker:out@800s+30s", What::Vehicle(Fault::StarTrackerOut), Some(800.0), Some(30.0)),
            ("store:full", What::StoreFull, None, None),
            ("bag:full+30s", What::BagFull, None, Some(30.0)),
        ];
        for (text, what, at_s, for_s) in cases {
            let fault: PlannedFault = text.parse().unwrap();
            assert_eq!(fault, PlannedFault { what, at_s, for_s }, "{text}");
            assert_eq!(fault.to_string(), text);
        }
        let fault: PlannedFault = " recorder:kill @ 2min + 1h".parse().unwrap();
        assert_eq!(fault.to_string(), "recorder:kill@120s+3600s");
    }

    #[test]
    fn what_cannot_be_done_is_refused_by_name() {
        for (text, words) in [
            ("guidance", "`guidance` is no fault: expected PART:WHAT@TIME"),
            ("thruster:dead@5s", "there is no part `thruster`; there are spacecraft, guidance"),
            ("wheel4:dead@5s", "there is no part `wheel4`"),
            ("guidance:explode@5s", "guidance cannot `explode`; it can kill or hang"),
            ("wheel2:weak@5s", "wheel2 cannot `weak`; it can be dead, stuck or weak by a share"),
            ("wheel2:weak 120%@5s", "the share lost is `120%`, not a share above 0% and up to 100%"),
            ("wheel2:weak NaN%@5s", "the share lost is `NaN%`"),
            ("topic:drop 0%@5s", "the share dropped is `0%`"),
            ("gyro:bias 5deg/s@5s", "the bias is `5deg/s`"),
            ("gyro:bias 0.01@5s", "the bias is `0.01`, not a rate such as 0.01deg/s"),
            ("planner:kill@-5s", "the time is `-5s`, not seconds such as 120s"),
            ("planner:kill@soon", "the time is `soon`"),
            ("planner:kill@5", "the time is `5`"),
            ("planner:kill@5s+", "the duration is ``"),
            ("planner:kill@5s+0s", "the duration is `0s`, not seconds above 0"),
            ("link:drop@5s", "link cannot `drop`; it can kill, hang, or drop a share of its frames"),
            ("link:drop 0%@5s", "the share dropped is `0%`"),
            ("catalogue:drop 5%@5s", "catalogue cannot `drop 5%`; it can kill or hang"),
            ("store:empty", "store cannot `empty`; it can be full"),
        ] {
            let error = text.parse::<PlannedFault>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,40}") {
            if let Ok(fault) = text.parse::<PlannedFault>() {
                prop_assert_eq!(fault.to_string().parse(), Ok(fault));
            }
        }

        #[test]
        fn anything_like_a_fault_is_read_or_refused(
            text in "(guidance|wheel[0-5]|gyro|topic|link|startracker|bag):(kill|weak|bias|drop|out|full)( [0-9.]{1,6}(%|deg/s))?(@[0-9.]{1,5}(s|min))?(\\+[0-9.]{1,4}s)?",
        ) {
            if let Ok(fault) = text.parse::<PlannedFault>() {
                prop_assert_eq!(fault.to_string().parse(), Ok(fault));
            }
        }
    }
}
