//! A shield around any planner: it never lets the battery below its floor, and sees to momentum and downlink.

use super::{Decision, DecisionContext, Planner, PlannerError};
use crate::task::Duty;
use crate::vehicle::model::Model;
use crate::vehicle::resources::Failure;
use crate::world::sun::Sun;

/// What a decision may cost, and what is done instead of one that costs too much.
///
/// A task is let pass when the satellite, should it do nothing but charge from its end on, comes through the next shadow
/// above the floor. The task is taken to bring nothing and to cost all loads at once; the shadow is known exactly. So
/// charging begins as late as it can, as in the hand-made shield of Quevedo Mantovani & Schaub ("shielded AEOS"), which
/// raises its floor by what the next eclipse takes.
#[derive(Clone, Debug)]
pub struct Shield {
    sun: Sun,
    floor_j: f64,
    /// Power at normal incidence [W].
    full_w: f64,
    /// Load of a task with everything on, and of charging [W].
    loads_w: (f64, f64),
    /// Momentum of a wheel at which thrusters take it out [N m s].
    momentum_limit: f64,
    thrusters: bool,
    antenna_needs_task: bool,
    /// Length of a duty [ticks].
    ticks: u32,
}

/// Work of the wheels that a task may take on average [W]: the densest tracking takes about 110 W.
const TASK_WHEELS_W: f64 = 150.0;
/// The same in charging, slew included [W].
const CHARGE_WHEELS_W: f64 = 40.0;
/// How long it takes to turn to the Sun, in which nothing comes [s].
const SLEW_S: f64 = 120.0;
/// Share of a wheel's limit at which thrusters take momentum out.
const MOMENTUM_SHARE: f64 = 0.7;
/// Length of a duty [s].
const DUTY_S: f64 = 60.0;

/// What comes next: safe mode decides, or the shield, or the planner within what the shield allows.
///
/// # Errors
/// When the planner gave no usable decision.
pub fn decide(
    shield: Option<&Shield>,
    context: &DecisionContext<'_>,
    planner: &mut dyn Planner,
) -> Result<Decision, PlannerError> {
    if let Some(decision) = safe_decision(context) {
        return Ok(decision);
    }
    let Some(shield) = shield else { return planner.decide(context) };
    match shield.before(context, planner.minds_resources()) {
        Some(decision) => Ok(decision),
        None => Ok(shield.check(context, planner.decide(context)?)),
    }
}

/// What safe mode does next: it sees to what failed, for a while, before it looks again. Nothing while all is well.
fn safe_decision(context: &DecisionContext<'_>) -> Option<Decision> {
    let failure = context.situation.resources?.safe_mode?;
    let thrusters = context.model.config.resources.as_ref().is_some_and(|it| it.has_thrusters());
    let duty = if failure == Failure::WheelMomentum && thrusters { Duty::Desaturate } else { Duty::Charge };
    Some(Decision::Serve { duty, ticks: context.model.period.ticks_ceil(DUTY_S).max(1) })
}

impl Shield {
    /// The shield of a mission; none where resources have no bounds or it is switched off.
    #[must_use]
    pub fn new(model: &Model) -> Option<Self> {
        let config = model.config.resources.as_deref().filter(|config| config.shield)?;
        let earth_radius = model.config.earth.radius_m;
        let always = config.bus_w + 3.0 * (config.wheel_base_w + config.rod_w) + config.transmitter_w;
        Some(Self {
            sun: config.sun(earth_radius),
            floor_j: config.battery_floor * config.battery_capacity_j(),
            full_w: config.array().full_w(),
            loads_w: (always + config.imager_w + TASK_WHEELS_W, always + CHARGE_WHEELS_W),
            momentum_limit: MOMENTUM_SHARE * config.wheel_momentum_max_nms,
            thrusters: config.has_thrusters(),
            antenna_needs_task: config.antenna_needs_task(),
            ticks: model.period.ticks_ceil(DUTY_S).max(1),
        })
    }

    /// What must be done before a planner is asked: momentum out of the wheels, and, where it does not see to that itself,
    /// data down while a station hears them.
    #[must_use]
    pub fn before(&self, context: &DecisionContext<'_>, minds_resources: bool) -> Option<Decision> {
        let resources = context.situation.resources?;
        let serve = |duty| Decision::Serve { duty, ticks: self.ticks };
        let momentum = context.situation.body.wheel_speed.amax() * context.model.plant.wheels.inertia;
        if self.thrusters && momentum > self.momentum_limit {
            return Some(self.check(context, serve(Duty::Desaturate)));
        }
        let sends = !minds_resources && self.antenna_needs_task && resources.in_contact && resources.to_send_bits > 0;
        sends.then(|| self.check(context, serve(Duty::Downlink)))
    }

    /// The decision itself, where the battery allows it; else to charge.
    #[must_use]
    pub fn check(&self, context: &DecisionContext<'_>, decision: Decision) -> Decision {
        let ticks = match decision {
            Decision::Image { candidate, t_pre } => {
                context.candidates.get(candidate).map_or(0, |candidate| candidate.t_acq) + t_pre
            }
            Decision::Wait { ticks } => ticks,
            Decision::Serve { duty: Duty::Charge, .. } => return decision,
            Decision::Serve { ticks, .. } => ticks,
        };
        // A long wait is cut short: there is time to look again.
        let (decision, ticks) = match decision {
            Decision::Wait { .. } if ticks > self.ticks => (Decision::Wait { ticks: self.ticks }, self.ticks),
            _ => (decision, ticks),
        };
        let lasts = self.lasts(context, context.model.period.duration_s(ticks));
        if lasts { decision } else { Decision::Serve { duty: Duty::Charge, ticks: self.ticks } }
    }

    /// Whether the battery comes through the next shadow when a task of a length [s] is flown first.
    fn lasts(&self, context: &DecisionContext<'_>, task_s: f64) -> bool {
        let situation = context.situation;
        let Some(resources) = situation.resources else { return true };
        let (task_w, charge_w) = self.loads_w;
        let after_j = resources.charge_j - task_w * task_s;
        let turned_j = after_j - charge_w * SLEW_S;
        let shadow = self.sun.next_shadow_s(&situation.r_BN_N, &situation.v_BN_N);
        let through_j = shadow.map_or(f64::INFINITY, |(begin_s, end_s)| {
            let charging_s = (begin_s - task_s - SLEW_S).max(0.0);
            let before_j = (turned_j + charging_s * (self.full_w - charge_w)).min(resources.capacity_j);
            before_j - charge_w * (end_s - begin_s.max(task_s)).max(0.0)
        });
        turned_j.min(through_j) >= self.floor_j
    }
}
