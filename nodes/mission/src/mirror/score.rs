//! How far flight and prediction have been the same.

use std::collections::BTreeMap;

use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::mrp;
use swath_sim::world::strip::StripId;

use super::parting::{Cause, Parting};
use crate::link::message::Housekeeping;
use crate::requests::journal::{Attempt, Outcome};

/// What came down compared with what was predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Imaging tasks that came to be known.
    pub tasks: u64,
    /// Of those, tasks that were as predicted: number, strip, times and success.
    pub equal: u64,
    /// Strips that came to be known as imaged.
    pub imaged: u64,
    /// Of those, strips that were predicted to be, within two minutes.
    pub foretold: u64,
    /// Places where flight and prediction parted; after each the prediction goes on from what came down.
    pub partings: Vec<Parting>,
    /// From when on the prediction is flown in the head.
    since: Tick,
    /// The first difference since then, which may yet part the two.
    first: Option<(Tick, Cause)>,
    /// Whether they have parted since then.
    parted: bool,
}

impl Score {
    /// Share of imaging tasks that were as predicted; 1 without any.
    #[must_use]
    pub fn share(&self) -> f64 {
        if self.tasks == 0 { 1.0 } else { self.equal as f64 / self.tasks as f64 }
    }

    /// Share of strips imaged that were predicted to be, about then; 1 without any.
    #[must_use]
    pub fn foretold_share(&self) -> f64 {
        if self.imaged == 0 { 1.0 } else { self.foretold as f64 / self.imaged as f64 }
    }

    /// Whether anything was not as predicted since the prediction goes on from what came down.
    pub(super) fn differs(&self) -> bool {
        self.parted || self.first.is_some()
    }

    /// The prediction goes on from what came down.
    pub(super) fn go_on_from(&mut self, at: Tick) {
        (self.since, self.first, self.parted) = (at, None, false);
    }

    /// A difference that may part the two.
    pub(super) fn differ(&mut self, at: Tick, cause: Cause) {
        if self.first.is_none_or(|(first, _)| at < first) {
            self.first = Some((at, cause));
        }
    }

    /// What the satellite was like when a task was decided.
    pub(super) fn point(&mut self, told: &Housekeeping, predicted: &BodyState) {
        let flown = told.body();
        if flown != *predicted {
            let angle = mrp::principal_angle(&mrp::subtract(&flown.sigma_BN, &predicted.sigma_BN));
            self.differ(told.at, Cause::Attitude { task: told.task, angle });
        }
    }

    /// An attempt that has ended, beside the task of its number in the prediction, and when the strips that were predicted
    /// to be imaged began; `about` is how far apart [ticks] the two may be and count as foretold.
    pub(super) fn attempt(
        &mut self,
        flown: &Attempt,
        predicted: Option<&TaskRecord>,
        foretold: &BTreeMap<StripId, Tick>,
        about: i64,
    ) {
        self.tasks += 1;
        let same = predicted.filter(|it| {
            (it.strip, it.start, it.end, it.t_pre) == (Some(flown.id), flown.start, flown.end, flown.t_pre)
        });
        let equal = same.is_some_and(|it| it.success() == (flown.outcome == Outcome::Succeeded));
        self.equal += u64::from(equal);
        let error = same.map(|it| it.outcome.max_attitude_error).filter(|error| *error != flown.max_attitude_error);
        let task = flown.task;
        let tracking = error.map(|predicted| Cause::Tracking { task, flown: flown.max_attitude_error, predicted });
        let before = self.first.filter(|(at, _)| *at <= flown.start).map(|(_, cause)| cause);
        tracking.into_iter().for_each(|cause| self.differ(flown.end, cause));
        if flown.outcome == Outcome::Succeeded {
            self.imaged += 1;
            let foretold = foretold.get(&flown.id).is_some_and(|start| start.since(flown.start).abs() <= about);
            self.foretold += u64::from(foretold);
        }
        if !equal && !std::mem::replace(&mut self.parted, true) {
            self.partings.push(Parting {
                task: flown.task,
                at: flown.start,
                since: self.since,
                flown: flown.id,
                predicted: predicted.and_then(|it| it.strip),
                cause: before.or(tracking).unwrap_or(Cause::Decision),
            });
        }
    }
}
