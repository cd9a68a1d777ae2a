//! Faults that are ordered while a mission flies: taken or refused, kept, and the same when the mission is flown again.

use serde::{Deserialize, Serialize};
use swath_sim::time::{Tick, TickPeriod};
use thiserror::Error;

use super::grammar::{GrammarError, PlannedFault};
use super::plan::{FaultPlan, FaultPlanError, Scheduled};

/// Longest name of somebody who orders [bytes].
const ACTOR_MAX: usize = 1000;

/// A fault that was ordered while the mission flew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ordered {
    /// When it was ordered.
    pub tick: Tick,
    /// Who ordered it.
    pub actor: String,
    /// The fault, with its time.
    pub fault: PlannedFault,
}

/// Why an order is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum OrderError {
    /// It is no fault.
    #[error(transparent)]
    Grammar(#[from] GrammarError),
    /// It cannot be flown.
    #[error(transparent)]
    Plan(#[from] FaultPlanError),
    /// Nobody can be called so.
    #[error("the name of who orders has {0} bytes: {ACTOR_MAX} are allowed")]
    Actor(usize),
}

impl FaultPlan {
    /// Takes an order at `now`, in a mission over DDS. What is told of `now` cannot be changed any more: it acts from the
    /// next tick on, or later.
    ///
    /// # Errors
    /// When it is no fault, is past, comes after the mission's end, contradicts another one, or cannot be made to happen.
    pub fn take_order(
        &mut self,
        text: &str,
        actor: &str,
        now: Tick,
        horizon: Tick,
        period: TickPeriod,
    ) -> Result<(Ordered, Scheduled), OrderError> {
        if actor.len() > ACTOR_MAX {
            return Err(OrderError::Actor(actor.len()));
        }
        let fault: PlannedFault = text.parse()?;
        Self { plan: vec![fault], random: 0 }.fits_orders()?;
        let scheduled = self.order(fault, now.after(1), horizon, period)?;
        let fault = PlannedFault { at_s: Some(fault.at_s.unwrap_or_else(|| period.time_s(scheduled.from))), ..fault };
        Ok((Ordered { tick: now, actor: actor.to_owned(), fault }, scheduled))
    }

    /// Adds a fault that was ordered; returns whether it is new.
    pub fn add(&mut self, fault: PlannedFault) -> bool {
        let new = !self.plan.contains(&fault);
        if new {
            self.plan.push(fault);
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_taken_or_refused_by_name() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let mut plan = FaultPlan { plan: vec!["wheel2:dead@600s".parse().unwrap()], random: 0 };
        let mut order = |text: &str| plan.take_order(text, "ana", Tick(400), Tick(2000), period);
        let (ordered, scheduled) = order("wheel1:weak 50%+100s").unwrap();
        assert_eq!(ordered.fault.to_string(), "wheel1:weak 50%@200.5s+100s");
        assert_eq!((ordered.tick, scheduled.from, scheduled.until), (Tick(400), Tick(401), Tick(601)));
        let text = serde_json::to_string(&ordered).unwrap();
        assert_eq!(serde_json::from_str::<Ordered>(&text).unwrap(), ordered);
        for (text, words) in [
            ("thruster:dead", "there is no part `thruster`"),
            ("wheel1:weak 120%", "the share lost is `120%`"),
            ("guidance:kill@200s", "guidance:kill@200s is past: it is 200.5 s now"),
            ("guidance:kill@1000s", "comes too late: the mission ends at 1000 s"),
            ("wheel1:dead@250s", "wheel1:weak 50%@200.5s+100s and wheel1:dead@250s contradict"),
            ("wheel2:weak 10%", "wheel2:dead@600s and wheel2:weak 10%@200.5s contradict"),
            ("bag:full+5s", "bag:full+5s cannot be ordered while a mission flies"),
            ("request_manager:hang+5s", "request_manager:hang+5s cannot be flown over DDS"),
        ] {
            let error = order(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
        let long = plan.take_order("gyro:bias 0.1deg/s", &"x".repeat(1001), Tick(0), Tick(9), period);
        assert_eq!(long.unwrap_err(), OrderError::Actor(1001));
        assert_eq!(plan.plan.len(), 2, "what is refused leaves nothing");
        assert!(!plan.add(ordered.fault) && plan.add("gyro:bias 0.1deg/s@9s".parse().unwrap()));
    }
}
