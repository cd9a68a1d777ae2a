//! The shield that Quevedo Mantovani & Schaub made by hand for "shielded AEOS", around a planner that knows of no power.

use super::decision::{Decision, DecisionContext, Planner, PlannerError};
use crate::task::Duty;

/// A planner that charges where the charge is below what the next shadow takes, and desaturates where a wheel has much.
///
/// In the Sun it charges below a requirement, which is a share of the capacity, raised where charging for the next shadow
/// takes longer than the time until that: by what is missing. Else thrusters take momentum out above a share of its limit.
/// Data are sent whenever a station hears a body-fixed antenna.
pub struct Handmade {
    inner: Box<dyn Planner + Send>,
    /// Charge over capacity below which it always charges.
    requirement: f64,
}

/// Share of a wheel's limit at which thrusters take momentum out.
const MOMENTUM_SHARE: f64 = 0.7;
/// Length of what it does itself [s].
const DUTY_S: f64 = 60.0;
/// Load of wheels that image all the time [W].
pub(super) const WHEELS_W: f64 = 60.0;

impl Handmade {
    /// The shield around a planner, with its least requirement.
    #[must_use]
    pub fn new(inner: Box<dyn Planner + Send>, requirement: f64) -> Self {
        Self { inner, requirement }
    }

    fn instead(&self, context: &DecisionContext<'_>) -> Option<Duty> {
        let situation = context.situation;
        let (state, config) = (situation.resources?, context.model.config.resources.as_deref()?);
        let sun = config.sun(context.model.config.earth.radius_m);
        let load_w = config.bus_w + 3.0 * config.wheel_base_w;
        let shadow = sun.next_shadow_s(&situation.r_BN_N, &situation.v_BN_N);
        let mut required = self.requirement;
        if let Some((begin_s, end_s)) = shadow {
            let rate_w = (config.array().full_w() - load_w).max(1.0);
            let taken_j = (end_s - begin_s) * (load_w + WHEELS_W);
            let missing_s = taken_j / rate_w - begin_s;
            required += (missing_s * rate_w / state.capacity_j).max(0.0);
        }
        let lit = shadow.is_none_or(|(begin_s, _)| begin_s > 0.0);
        if lit && state.level() < required {
            return Some(Duty::Charge);
        }
        if config.has_thrusters() && state.momentum_nms > MOMENTUM_SHARE * config.wheel_momentum_max_nms {
            return Some(Duty::Desaturate);
        }
        let sends = config.antenna_needs_task() && state.in_contact && state.to_send_bits > 0;
        sends.then_some(Duty::Downlink)
    }
}

impl Planner for Handmade {
    fn name(&self) -> String {
        format!("{}+handmade:{}", self.inner.name(), self.requirement)
    }

    fn forget(&mut self) {
        self.inner.forget();
    }

    fn minds_resources(&self) -> bool {
        true
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        match self.instead(context) {
            Some(duty) => Ok(Decision::Serve { duty, ticks: context.model.period.ticks_ceil(DUTY_S).max(1) }),
            None => self.inner.decide(context),
        }
    }
}
