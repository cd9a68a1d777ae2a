//! The shortest transition with which a strip is imaged, found by flying it.

use super::experience::Allowance;
use super::meter::Meter;
use crate::requests::catalogue::Candidate;
use crate::task::{Duty, Task};
use crate::time::Tick;
use crate::vehicle::flight::{Flight, Situation};
use crate::vehicle::model::Model;

/// The transition is settled once the attitude error is below this share of its limit.
const SETTLED_SHARE: f64 = 0.8;
/// Flights that a search for one transition may take.
const TRIALS: u32 = 6;
/// Where the search for a transition begins [s].
const FIRST_GUESS_S: f64 = 40.0;

/// Flights in the planner's head.
pub struct Search<'a> {
    model: &'a Model,
    flight: Flight,
    margin: u32,
    sigma_max: f64,
    /// Where the next task begins.
    pub begin: Situation,
    /// Closed-loop ticks flown so far.
    pub ticks: u64,
    meter: Option<Meter>,
}

/// A task that succeeds when it is flown in the head.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its transition [ticks].
    pub t_pre: u32,
    /// Where it ends.
    pub end: Situation,
    /// What it takes of energy [J], where that is measured; see [`Meter`].
    pub taken_j: f64,
}

impl<'a> Search<'a> {
    /// Flights with a model of the satellite, on the orbit of a situation.
    #[must_use]
    pub fn new(model: &'a Model, situation: &Situation, allowance: &Allowance) -> Self {
        let mut flight = Flight::predicted(model, situation);
        if allowance.weakness > 0.0 {
            flight.spacecraft.refit(model.plant.limited(&situation.wheels).weakened(allowance.weakness));
        }
        let mut begin = *situation;
        if allowance.delay > 0 {
            flight.fly(Task::Wait { ticks: allowance.delay }, Tick(u64::MAX));
            begin = flight.situation();
        }
        let sigma_max = model.config.imaging.sigma_max;
        let (margin, ticks) = (allowance.ticks, u64::from(allowance.delay));
        Self { model, flight, margin, sigma_max, begin, ticks, meter: None }
    }

    /// The same, measuring what flights take of energy, where that has bounds.
    #[must_use]
    pub fn metered(mut self) -> Self {
        self.meter = Meter::new(self.model);
        self
    }

    /// What measures energy, if something does.
    #[must_use]
    pub fn meter(&self) -> Option<&Meter> {
        self.meter.as_ref()
    }

    /// Flies a duty from a situation: what it takes of energy up to each of some times [J]; 0 where nothing is measured.
    pub fn serve<const N: usize>(&mut self, from: &Situation, duty: Duty, ticks: [u32; N]) -> [f64; N] {
        let Some(meter) = &self.meter else { return [0.0; N] };
        self.flight.rewind(from);
        let longest = ticks.into_iter().max().unwrap_or(0);
        self.ticks += u64::from(longest);
        let (mut flown, mut turning_j, mut taken) = (0, 0.0, [0.0; N]);
        self.flight.fly_showing(Task::Serve { duty, ticks: longest }, |spacecraft| {
            flown += 1;
            turning_j += meter.turning_j(spacecraft);
            for (taken, &ticks) in taken.iter_mut().zip(&ticks) {
                if ticks == flown {
                    *taken = turning_j + meter.still_j(&Task::Serve { duty, ticks });
                }
            }
        });
        taken
    }

    /// Shortest and longest transition after which the candidate's window is open [ticks].
    #[must_use]
    pub fn starts(&self, now: Tick, candidate: &Candidate) -> Option<(u32, u32)> {
        let earliest = candidate.window.open.since(now).max(0);
        let latest = candidate.window.close.since(now).min(i64::from(self.model.t_pre_max()));
        (earliest <= latest).then_some((earliest as u32, latest as u32))
    }

    /// The shortest transition found with which the strip is imaged, if it is at most `longest` [ticks].
    ///
    /// A flight with transition T tells when its attitude error is settled. That hardly depends on T, so it is the next
    /// T to try.
    pub fn shortest(&mut self, from: &Situation, candidate: &Candidate, longest: u32) -> Option<Found> {
        let (earliest, latest) = self.starts(from.now, candidate)?;
        let latest = latest.min(longest);
        if latest < earliest {
            return None;
        }
        let mut guess = self.model.period.ticks_ceil(FIRST_GUESS_S).clamp(earliest, latest);
        let mut too_short: Option<u32> = None;
        let mut found = None;
        for _ in 0..TRIALS {
            let settled = self.settling(from, candidate, guess, latest);
            let next = match settled {
                Some(settled) if settled + self.margin <= guess => {
                    found = Some(guess);
                    (settled + self.margin).max(earliest).max(too_short.map_or(0, |short| short + 1))
                }
                Some(settled) => {
                    too_short = Some(guess);
                    (settled + self.margin).max(guess + 1)
                }
                None => {
                    too_short = Some(guess);
                    // It does not settle in time from here: try the longest transition before giving up.
                    latest
                }
            };
            let done = match found {
                Some(found) => next >= found,
                None => next > latest || too_short == Some(latest),
            };
            if done {
                break;
            }
            guess = next;
        }
        let t_pre = found?;
        let (end, taken_j) = self.image(from, candidate, t_pre)?;
        Some(Found { t_pre, end, taken_j })
    }

    /// Ticks after which the attitude error stays within its limit, in a flight with this transition; `None` when it is
    /// not settled `latest` ticks from now.
    pub fn settling(&mut self, from: &Situation, candidate: &Candidate, t_pre: u32, latest: u32) -> Option<u32> {
        self.begin(from, candidate, t_pre);
        let limit = self.sigma_max * self.sigma_max;
        let well_within = limit * SETTLED_SHARE * SETTLED_SHARE;
        let mut settled = 0;
        for tick in 0..=latest {
            let error = self.flight.tick().error.sigma_BR.norm_squared();
            self.ticks += 1;
            if error >= limit {
                settled = tick + 1;
            } else if error < well_within && tick >= t_pre {
                break;
            }
        }
        (settled <= latest).then_some(settled)
    }

    /// Where the whole task ends and what it takes of energy [J], if it succeeds.
    pub fn image(&mut self, from: &Situation, candidate: &Candidate, t_pre: u32) -> Option<(Situation, f64)> {
        self.flight.rewind(from);
        let task = Task::Image { id: candidate.id, strip: candidate.strip, t_pre, t_acq: candidate.t_acq };
        self.ticks += u64::from(task.ticks());
        let (outcome, taken_j) = match &self.meter {
            None => (self.flight.fly(task, Tick(u64::MAX)), 0.0),
            Some(meter) => {
                let mut taken_j = meter.still_j(&task);
                let outcome = self.flight.fly_showing(task, |spacecraft| taken_j += meter.turning_j(spacecraft));
                (outcome, taken_j)
            }
        };
        outcome.failure.is_none().then(|| (self.flight.situation(), taken_j))
    }

    fn begin(&mut self, from: &Situation, candidate: &Candidate, t_pre: u32) {
        self.flight.rewind(from);
        let task = Task::Image { id: candidate.id, strip: candidate.strip, t_pre, t_acq: candidate.t_acq };
        self.flight.begin(task);
    }
}
