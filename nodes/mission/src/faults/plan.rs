//! The faults of a mission: checked against each other and against the mission, and as they act at its ticks.

use std::mem::discriminant;

use serde::{Deserialize, Serialize};
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::faults::{FOR_GOOD, TimedFault};
use thiserror::Error;

use super::grammar::{Failure, PlannedFault, Process, What};
use super::random;

/// `[faults]` of a mission file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FaultPlan {
    /// What fails, such as `guidance:kill@120s`.
    pub plan: Vec<PlannedFault>,
    /// Number of faults that are drawn from the mission's seed besides.
    #[serde(skip_serializing_if = "is_zero")]
    pub random: u32,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for it")]
fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// Greatest share of messages that is dropped: what comes again until it is answered must come some time.
const DROP_MAX: f64 = 0.5;

/// Most faults of a mission.
pub const FAULTS_MAX: usize = 1000;

/// Why faults cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FaultPlanError {
    /// It would begin before now.
    #[error("{fault} is past: it is {now_s} s now")]
    Past {
        /// The fault.
        fault: PlannedFault,
        /// Now [s].
        now_s: f64,
    },
    /// The mission is over by then.
    #[error("{fault} comes too late: the mission ends at {end_s} s")]
    AfterEnd {
        /// The fault.
        fault: PlannedFault,
        /// End of the mission [s].
        end_s: f64,
    },
    /// Two cannot act at the same time.
    #[error("{first} and {second} contradict each other: both change {part} at the same time")]
    Contradiction {
        /// The one.
        first: Box<PlannedFault>,
        /// The other.
        second: Box<PlannedFault>,
        /// What both change.
        part: &'static str,
    },
    /// The spacecraft cannot be away for a time that it counts itself.
    #[error(
        "{fault}: the spacecraft owns the clock, so that it cannot be away for simulated time; leave out +{for_s}s"
    )]
    OwnsTheClock {
        /// The fault.
        fault: PlannedFault,
        /// How long it was to be [s].
        for_s: f64,
    },
    /// Guidance waits for it.
    #[error(
        "{fault}: nothing is flown without {part}, so that it cannot be away for simulated time; leave out +{for_s}s"
    )]
    Awaited {
        /// The fault.
        fault: PlannedFault,
        /// What is awaited.
        part: &'static str,
        /// How long it was to be [s].
        for_s: f64,
    },
    /// There is no radio.
    #[error("{fault}: the mission has no [link], so nothing of the radio can fail")]
    NoRadio {
        /// The fault.
        fault: PlannedFault,
    },
    /// Too little would come through.
    #[error("{fault}: in lockstep time stands until a message comes through; drop at most 50%")]
    NothingLeft {
        /// The fault.
        fault: PlannedFault,
    },
    /// It cannot be made to happen where the mission is flown.
    #[error("{fault} cannot be {place}: {can}")]
    NotHere {
        /// The fault.
        fault: PlannedFault,
        /// What it cannot be, and where.
        place: &'static str,
        /// What can fail there.
        can: &'static str,
    },
    /// There are too many.
    #[error("{count} faults are planned, the most are {FAULTS_MAX}")]
    TooMany {
        /// How many.
        count: usize,
    },
}

/// A fault at its ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scheduled {
    /// What fails.
    pub what: What,
    /// First tick at which it acts.
    pub from: Tick,
    /// First tick at which it does not act any more. A process that is replaced at once has the tick of its end.
    pub until: Tick,
}

impl Scheduled {
    /// A fault that is ordered at `now`.
    #[must_use]
    pub fn new(fault: &PlannedFault, now: Tick, period: TickPeriod) -> Self {
        let from = fault.at_s.map_or(now, |at_s| Tick(ticks(at_s, period)));
        let until = match (fault.for_s, fault.what) {
            (Some(for_s), _) => Tick(from.0 + ticks(for_s, period).max(1)),
            (None, What::Process(..)) => from,
            (None, _) => FOR_GOOD,
        };
        Self { what: fault.what, from, until }
    }

    /// Whether both act at some tick.
    fn meets(&self, other: &Self) -> bool {
        let last = |it: &Self| Tick(it.until.0.max(it.from.0 + 1));
        self.from < last(other) && other.from < last(self)
    }
}

/// Whole ticks of a time, rounded up.
fn ticks(seconds: f64, period: TickPeriod) -> u64 {
    (seconds / period.seconds() - 1e-9).ceil().max(0.0) as u64
}

impl FaultPlan {
    /// Whether nothing fails.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.plan.is_empty() && self.random == 0
    }

    /// The same with the faults drawn that are to be drawn; `radio` is whether there is one that can fail.
    #[must_use]
    pub fn resolved(mut self, seed: u64, radio: bool, horizon: Tick, period: TickPeriod) -> Self {
        for fault in random::draw(seed, std::mem::take(&mut self.random), radio, horizon, period) {
            self.plan.push(fault);
            if check(&self.plan, horizon, period).is_err() {
                self.plan.pop();
            }
        }
        self
    }

    /// Checks the faults of a mission against each other and against its length, and how many are to be drawn.
    ///
    /// # Errors
    /// The first fault that cannot be flown.
    pub fn validate(&self, horizon: Tick, period: TickPeriod) -> Result<(), FaultPlanError> {
        // Those that are to be drawn take room and time, too.
        let count = self.plan.len().saturating_add(self.random as usize);
        if count > FAULTS_MAX {
            return Err(FaultPlanError::TooMany { count });
        }
        check(&self.plan, horizon, period)
    }

    /// Checks that nothing of a radio fails where there is none.
    ///
    /// # Errors
    /// The first fault that needs one.
    pub fn fits_no_radio(&self) -> Result<(), FaultPlanError> {
        match self.plan.iter().find(|fault| fault.what.is_of_radio()) {
            Some(&fault) => Err(FaultPlanError::NoRadio { fault }),
            None => Ok(()),
        }
    }

    /// Checks that a mission in one process can fly the faults: there is no spacecraft and no recorder to be lost in it.
    /// Of messages that are dropped, a full store and a full bag it has the alarms: over DDS they change no task either.
    ///
    /// # Errors
    /// The first that it cannot.
    pub fn fits_one_process(&self) -> Result<(), FaultPlanError> {
        let can = "everything but spacecraft and recorder can fail there";
        self.each(in_one_process, "flown in one process", can)
    }

    /// Without the faults that no mission in one process can fly; over DDS they change no task.
    #[must_use]
    pub fn within_one_process(mut self) -> Self {
        self.plan.retain(in_one_process);
        self
    }

    /// Checks that a mission over DDS can fly the faults.
    ///
    /// # Errors
    /// The first that it cannot.
    pub fn fits_dds(&self) -> Result<(), FaultPlanError> {
        let flown = |fault: &PlannedFault| match fault.what {
            // What would have been offered and recorded meanwhile, nobody knows.
            What::Process(Process::RequestManager | Process::Recorder, _) => fault.for_s.is_none(),
            _ => true,
        };
        let can = "everything can fail there; request_manager and recorder are replaced at once";
        self.each(flown, "flown over DDS", can)
    }

    /// Checks that the faults can be ordered while a mission flies over DDS.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn fits_orders(&self) -> Result<(), FaultPlanError> {
        self.fits_dds()?;
        let can = "everything else can be; the recorder knows of nothing but the mission file";
        self.each(|fault| fault.what != What::BagFull, "ordered while a mission flies", can)
    }

    pub(crate) fn each(
        &self,
        flown: impl Fn(&PlannedFault) -> bool,
        place: &'static str,
        can: &'static str,
    ) -> Result<(), FaultPlanError> {
        match self.plan.iter().find(|fault| !flown(fault)) {
            Some(&fault) => Err(FaultPlanError::NotHere { fault, place, can }),
            None => Ok(()),
        }
    }

    /// Adds a fault that is ordered at `now`.
    ///
    /// # Errors
    /// When it is past, comes after the end, or contradicts another one.
    pub fn order(
        &mut self,
        mut fault: PlannedFault,
        now: Tick,
        horizon: Tick,
        period: TickPeriod,
    ) -> Result<Scheduled, FaultPlanError> {
        let now_s = period.time_s(now);
        if fault.at_s.is_some_and(|at_s| at_s < now_s) {
            return Err(FaultPlanError::Past { fault, now_s });
        }
        fault.at_s = fault.at_s.or(Some(now_s));
        self.plan.push(fault);
        if let Err(error) = check(&self.plan, horizon, period) {
            self.plan.pop();
            return Err(error);
        }
        Ok(Scheduled::new(&fault, now, period))
    }

    /// All faults at their ticks, in the order in which they begin.
    #[must_use]
    pub fn scheduled(&self, period: TickPeriod) -> Vec<Scheduled> {
        let mut all: Vec<_> = self.plan.iter().map(|fault| Scheduled::new(fault, Tick(0), period)).collect();
        all.sort_by_key(|it| it.from);
        all
    }

    /// The faults of wheels and sensors.
    #[must_use]
    pub fn vehicle(&self, period: TickPeriod) -> Vec<TimedFault> {
        let of = |it: Scheduled| match it.what {
            What::Vehicle(fault) => Some(TimedFault { fault, from: it.from, until: it.until }),
            _ => None,
        };
        self.scheduled(period).into_iter().filter_map(of).collect()
    }

    /// When messages are dropped, and which share of them.
    #[must_use]
    pub fn drops(&self, period: TickPeriod) -> Vec<(Scheduled, f64)> {
        let of = |it: Scheduled| match it.what {
            What::Drop(share) => Some((it, share)),
            _ => None,
        };
        self.scheduled(period).into_iter().filter_map(of).collect()
    }

    /// When frames of the radio are lost besides, and which share of them.
    #[must_use]
    pub fn frames_lost(&self, period: TickPeriod) -> Vec<(Scheduled, f64)> {
        let of = |it: Scheduled| match it.what {
            What::FramesLost(share) => Some((it, share)),
            _ => None,
        };
        self.scheduled(period).into_iter().filter_map(of).collect()
    }

    /// When this happens: the store, or the bag, is full.
    #[must_use]
    pub fn when(&self, what: What, period: TickPeriod) -> Vec<Scheduled> {
        self.scheduled(period).into_iter().filter(|it| it.what == what).collect()
    }

    /// The faults of a node.
    #[must_use]
    pub fn of(&self, process: Process, period: TickPeriod) -> Vec<(Scheduled, Failure)> {
        let of = |it: Scheduled| match it.what {
            What::Process(other, failure) if other == process => Some((it, failure)),
            _ => None,
        };
        self.scheduled(period).into_iter().filter_map(of).collect()
    }
}

/// Whether a mission in one process can fly a fault.
fn in_one_process(fault: &PlannedFault) -> bool {
    match fault.what {
        // Without link or catalogue the clock stands, so that only an alarm tells of their loss.
        What::Process(process, _) => process.is_of_radio() || Process::IN_PROCESS.contains(&process),
        _ => true,
    }
}

fn check(plan: &[PlannedFault], horizon: Tick, period: TickPeriod) -> Result<(), FaultPlanError> {
    if plan.len() > FAULTS_MAX {
        return Err(FaultPlanError::TooMany { count: plan.len() });
    }
    let scheduled: Vec<_> = plan.iter().map(|fault| Scheduled::new(fault, Tick(0), period)).collect();
    for (i, (&fault, it)) in plan.iter().zip(&scheduled).enumerate() {
        if let (What::Process(Process::Spacecraft, _), Some(for_s)) = (fault.what, fault.for_s) {
            return Err(FaultPlanError::OwnsTheClock { fault, for_s });
        }
        if let (What::Process(process, _), Some(for_s)) = (fault.what, fault.for_s)
            && process.is_of_radio()
        {
            return Err(FaultPlanError::Awaited { fault, part: process.name(), for_s });
        }
        if it.from >= horizon {
            return Err(FaultPlanError::AfterEnd { fault, end_s: period.time_s(horizon) });
        }
        if let What::Drop(share) = fault.what
            && share > DROP_MAX
        {
            return Err(FaultPlanError::NothingLeft { fault });
        }
        for (&second, other) in plan.iter().zip(&scheduled).skip(i + 1) {
            let part = fault.what.part();
            let same = part == second.what.part() && discriminant(&fault.what) == discriminant(&second.what);
            if same && it.meets(other) {
                return Err(FaultPlanError::Contradiction { first: Box::new(fault), second: Box::new(second), part });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HORIZON: Tick = Tick(2000);

    fn period() -> TickPeriod {
        TickPeriod::from_frequency(2.0).unwrap()
    }

    fn plan(texts: &[&str]) -> FaultPlan {
        FaultPlan { plan: texts.iter().map(|text| text.parse().unwrap()).collect(), random: 0 }
    }

    #[test]
    fn there_may_be_so_many_faults_planned_and_drawn() {
        let many = |random| FaultPlan { random, ..plan(&["wheel2:dead@600s"]) }.validate(HORIZON, period());
        assert_eq!(many(999), Ok(()));
        assert_eq!(many(1000), Err(FaultPlanError::TooMany { count: 1001 }));
        assert_eq!(many(u32::MAX), Err(FaultPlanError::TooMany { count: 4_294_967_296 }));
    }

    #[test]
    fn faults_that_cannot_be_flown_are_named() {
        for (texts, words) in [
            (&["wheel2:dead@600s", "wheel2:stuck@700s"][..], "wheel2:dead@600s and wheel2:stuck@700s contradict"),
            (&["planner:kill@10s+60s", "planner:hang@30s"], "both change planner at the same time"),
            (&["gyro:bias 0.1deg/s@5s", "gyro:bias 0.2deg/s@9s"], "both change gyro"),
            (&["guidance:kill@5s", "guidance:hang@5s"], "both change guidance"),
            (&["planner:kill@1000s"], "planner:kill@1000s comes too late: the mission ends at 1000 s"),
            (&["spacecraft:kill@10s+5s"], "the spacecraft owns the clock"),
            (
                &["topic:drop 51%@10s+5s"],
                "topic:drop 51%@10s+5s: in lockstep time stands until a message comes through",
            ),
            (&["link:drop 5%@10s+9s", "link:drop 6%@12s"], "both change link at the same time"),
            (&["catalogue:hang@10s+9s"], "nothing is flown without catalogue, so that it cannot be away"),
            (&["topic:drop 5%@10s+9s", "topic:drop 6%@12s"], "both change topic at the same time"),
        ] {
            let error = plan(texts).validate(HORIZON, period()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let fine = plan(&[
            "wheel2:dead@600s+100s",
            "wheel2:stuck@700s",
            "wheel1:dead@650s",
            "guidance:kill@5s",
            "guidance:kill@6s",
            "spacecraft:kill@10s",
            "store:full+10s",
            "link:kill@12s",
            "link:drop 30%@10s+9s",
        ]);
        assert_eq!(fine.validate(HORIZON, period()), Ok(()));
        let error = fine.fits_no_radio().unwrap_err().to_string();
        assert_eq!(error, "link:kill@12s: the mission has no [link], so nothing of the radio can fail");
    }

    #[test]
    fn what_cannot_fail_where_it_is_flown_is_named() {
        let refused = |texts: &[&str], dds: bool| {
            let plan = plan(texts);
            let checked = if dds { plan.fits_dds() } else { plan.fits_one_process() };
            checked.map_err(|error| error.to_string())
        };
        assert_eq!(refused(&["wheel1:dead@5s", "guidance:kill@5s", "request_manager:hang@5s+9s"], false), Ok(()));
        assert_eq!(refused(&["wheel1:dead@5s", "startracker:out@5s"], true), Ok(()));
        assert_eq!(refused(&["guidance:kill@5s+9s", "request_manager:hang@5s", "spacecraft:kill@9s"], true), Ok(()));
        for dds in [false, true] {
            assert_eq!(refused(&["store:full", "topic:drop 5%@1s", "bag:full@3s+5s"], dds), Ok(()));
        }
        for text in ["recorder:kill@5s", "spacecraft:kill@5s"] {
            let error = refused(&[text], false).unwrap_err();
            assert!(error.starts_with(&format!("{text} cannot be flown in one process: everything but")), "{error}");
        }
        let error = plan(&["bag:full@9s"]).fits_orders().unwrap_err().to_string();
        assert!(error.starts_with("bag:full@9s cannot be ordered while a mission flies"), "{error}");
        for text in ["request_manager:kill@9s+5s", "recorder:hang@9s+5s"] {
            let error = refused(&["gyro:bias 0.1deg/s@5s", text], true).unwrap_err();
            assert!(error.starts_with(&format!("{text} cannot be flown over DDS")), "{error}");
        }
    }

    #[test]
    fn orders_in_flight_are_checked_against_now() {
        let mut plan = plan(&["wheel2:dead@600s"]);
        let mut order = |text: &str| plan.order(text.parse().unwrap(), Tick(400), HORIZON, period());
        let error = order("guidance:kill@199s").unwrap_err().to_string();
        assert_eq!(error, "guidance:kill@199s is past: it is 200 s now");
        assert!(order("wheel2:weak 50%").is_err(), "it would last until the wheel is dead, and beyond");
        let scheduled = order("wheel2:weak 50%+100s").unwrap();
        assert_eq!((scheduled.from, scheduled.until), (Tick(400), Tick(600)));
        assert_eq!(order("startracker:out").unwrap().until, FOR_GOOD);
        assert_eq!(order("planner:kill@250.1s+0.1s").map(|it| (it.from, it.until)), Ok((Tick(501), Tick(502))));
    }

    #[test]
    fn what_is_drawn_follows_from_the_seed_and_can_be_flown() {
        let (mut differ, mut of_radio) = (0, 0);
        for seed in 0..200 {
            let drawn = FaultPlan { random: 5, ..FaultPlan::default() }.resolved(seed, false, HORIZON, period());
            assert_eq!(drawn, FaultPlan { random: 5, ..FaultPlan::default() }.resolved(seed, false, HORIZON, period()));
            assert!(!drawn.plan.is_empty() && drawn.random == 0);
            assert_eq!(drawn.validate(HORIZON, period()), Ok(()), "{drawn:?}");
            let texts: Vec<String> = drawn.plan.iter().map(ToString::to_string).collect();
            let read: Vec<PlannedFault> = texts.iter().map(|text| text.parse().unwrap()).collect();
            assert_eq!(read, drawn.plan);
            differ += usize::from(texts != plan_of(seed + 1));
            let radio = FaultPlan { random: 5, ..FaultPlan::default() }.resolved(seed, true, HORIZON, period());
            assert_eq!(radio.validate(HORIZON, period()), Ok(()), "{radio:?}");
            of_radio += radio.plan.iter().filter(|fault| fault.what.is_of_radio()).count();
        }
        assert!(differ > 190 && of_radio > 100, "{differ} {of_radio}");
    }

    fn plan_of(seed: u64) -> Vec<String> {
        let drawn = FaultPlan { random: 5, ..FaultPlan::default() }.resolved(seed, false, HORIZON, period());
        drawn.plan.iter().map(ToString::to_string).collect()
    }
}
