//! What a learned policy sees: Table 1 of the paper, and sets that add what decides how fast a slew can be.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::planner::DecisionContext;
use crate::requests::catalogue::Candidate;
use crate::vehicle::mrp;
use crate::world::frames::{earth_to_inertial, hill_dcm, reference_dcm};
use crate::world::turn::Turn;

/// Scale of the attitude error rate [rad/s].
pub const RATE_SCALE: f64 = 0.05;
/// Scale of times relative to now [s].
pub const WINDOW_SCALE_S: f64 = 300.0;
/// Scale of the wheels' momentum [N m s]: that of a wheel at 1500 rpm.
pub const MOMENTUM_SCALE: f64 = 12.5;

/// Scale of shadows and contacts relative to now [s].
pub const ORBIT_SCALE_S: f64 = 3000.0;
/// Length of each of four bins of the priorities that come [s].
const DENSITY_BIN_S: f64 = 180.0;
/// Scale of the priorities of a bin.
pub const DENSITY_SCALE: f64 = 10.0;
/// Number of features of power and data.
const RESOURCES: usize = 16;

/// Which features a policy sees of each strip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObservationSet {
    /// The paper's 13 features.
    #[default]
    Table1,
    /// Table 1 and the wheels' stored momentum in the body frame: 16 features.
    Table1Momentum,
    /// Table 1, the momentum, and the attitude and rate errors as vectors in the body frame: 22 features.
    Dynamics,
    /// The same, and how power and data stand and what comes: 38 features; the last 16 are the same for each strip.
    Resources,
}

impl ObservationSet {
    /// Number of features of a strip.
    #[must_use]
    pub fn features(self) -> usize {
        match self {
            Self::Table1 => 13,
            Self::Table1Momentum => 16,
            Self::Dynamics => 22,
            Self::Resources => 22 + RESOURCES,
        }
    }
}

/// Writes the observation: `features` has one row of `set.features()` numbers for each of the N slots, `mask` says which
/// slots hold a strip. Empty slots are zero.
///
/// # Panics
/// When the slices are not N × features and N long, N being `mask.len()` and at least the number of candidates.
pub fn observe(context: &DecisionContext<'_>, set: ObservationSet, features: &mut [f32], mask: &mut [bool]) {
    let width = set.features();
    assert_eq!(features.len(), mask.len() * width, "features must be slots x {width}");
    assert!(context.candidates.len() <= mask.len(), "more candidates than slots");
    features.fill(0.0);
    mask.fill(false);
    let mut frame = Frame::new(context);
    for ((row, filled), candidate) in features.chunks_exact_mut(width).zip(mask).zip(context.candidates) {
        frame.observe(context, candidate, set, row);
        *filled = true;
    }
}

/// Charge over capacity and over the floor, Sun seen, begin and end of the shadow, storage filled and to send, begin and
/// end of the contact, the Sun in B, and the priorities of strips whose windows open in the next four times three minutes.
/// Where resources have no bounds: a full battery in an endless day, an empty storage.
fn resources(context: &DecisionContext<'_>) -> [f64; RESOURCES] {
    let (model, situation) = (context.model, context.situation);
    let mut row = [0.0; RESOURCES];
    for candidate in context.candidates {
        let opens_s = candidate.window.open.since(situation.now) as f64 * model.period.seconds();
        let bin = (opens_s / DENSITY_BIN_S).max(0.0) as usize;
        if let Some(density) = row.get_mut(12 + bin) {
            *density += candidate.strip.priority / DENSITY_SCALE;
        }
    }
    let (Some(state), Some(config)) = (&situation.resources, model.config.resources.as_deref()) else {
        (row[0], row[1], row[2]) = (1.0, 1.0, 1.0);
        return row;
    };
    let sun = config.sun(model.config.earth.radius_m);
    let shadow = sun.next_shadow_s(&situation.r_BN_N, &situation.v_BN_N).unwrap_or_default();
    let relative = |tick: crate::time::Tick| tick.since(situation.now) as f64 * model.period.seconds();
    let contact = state.contact.map_or((0.0, 0.0), |(rise, set)| (relative(rise), relative(set)));
    let of_storage = |bits: u64| bits as f64 / state.storage_bits.max(1) as f64;
    let sun_B = mrp::Rotation::new(&situation.body.sigma_BN).apply(sun.direction_N());
    let own = [
        state.level(),
        state.level() - config.battery_floor,
        state.illumination,
        shadow.0 / ORBIT_SCALE_S,
        shadow.1 / ORBIT_SCALE_S,
        of_storage(state.stored_bits),
        of_storage(state.to_send_bits),
        contact.0 / ORBIT_SCALE_S,
        contact.1 / ORBIT_SCALE_S,
        sun_B.x,
        sun_B.y,
        sun_B.z,
    ];
    row.iter_mut().zip(own).for_each(|(slot, value)| *slot = value);
    row
}

/// What all strips of one observation share.
struct Frame {
    earth: Turn,
    dcm_HN: nalgebra::Matrix3<f64>,
    momentum_B: Vector3<f64>,
    resources: [f64; RESOURCES],
}

impl Frame {
    fn new(context: &DecisionContext<'_>) -> Self {
        let situation = context.situation;
        Self {
            earth: context.model.earth.clone(),
            dcm_HN: hill_dcm(&situation.r_BN_N, &situation.v_BN_N),
            momentum_B: situation.body.wheel_speed * (context.model.plant.wheels.inertia / MOMENTUM_SCALE),
            resources: resources(context),
        }
    }

    fn observe(&mut self, context: &DecisionContext<'_>, candidate: &Candidate, set: ObservationSet, row: &mut [f32]) {
        let (model, situation) = (context.model, context.situation);
        let now = situation.now;
        let radius = model.config.earth.radius_m;
        let strip = &candidate.strip;
        let turn = self.earth.cos_sin(now);
        let (dcm_HN, r_BN_N) = (self.dcm_HN, situation.r_BN_N);
        let hill = |point_E: &Vector3<f64>| dcm_HN * (earth_to_inertial(turn, point_E) * radius - r_BN_N) / radius;
        let (start_H, end_H) = (hill(&strip.start_E), hill(&strip.end_E()));
        let (sigma_BR, omega_BR_B) = self.error_without_transition(context, candidate);
        // ‖B(σ)ω‖ = (1+σ²)‖ω‖.
        let sigma_rate = 0.25 * (1.0 + sigma_BR.norm_squared()) * omega_BR_B.norm();
        let relative = |tick: crate::time::Tick| tick.since(now) as f64 * model.period.seconds() / WINDOW_SCALE_S;
        let table1 = [
            strip.priority,
            start_H.x,
            start_H.y,
            start_H.z,
            end_H.x,
            end_H.y,
            end_H.z,
            strip.arc * radius / (model.config.requests.length_max_km * 1e3),
            strip.angular_speed * radius / model.config.requests.speed_max_m_s,
            mrp::principal_angle(&sigma_BR) / std::f64::consts::PI,
            sigma_rate / RATE_SCALE,
            relative(candidate.window.open),
            relative(candidate.window.close),
        ];
        let vectors = [self.momentum_B, sigma_BR, omega_BR_B / RATE_SCALE];
        let extra = vectors.iter().flat_map(|v| v.iter().copied()).chain(self.resources);
        for (slot, value) in row.iter_mut().zip(table1.into_iter().chain(extra)) {
            *slot = value as f32;
        }
        debug_assert_eq!(row.len(), set.features());
    }

    /// σ_BR and ω_BR if the strip's imaging began now, with T_pre = 0. The reference's rate is its change over the next
    /// tick while the satellite moves in a straight line.
    fn error_without_transition(
        &mut self,
        context: &DecisionContext<'_>,
        candidate: &Candidate,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let situation = context.situation;
        let dt = context.model.period.seconds();
        let radius = context.model.config.earth.radius_m;
        let mut reference = |ticks: u32, r_BN_N: Vector3<f64>| {
            let turn = self.earth.cos_sin(situation.now.after(ticks));
            let (target_N, scan_N) = candidate.strip.target_N(f64::from(ticks) * dt, turn, radius);
            mrp::euler_parameters_from_dcm(&reference_dcm(&r_BN_N, &target_N, &scan_N))
        };
        let rn = reference(0, situation.r_BN_N);
        let rn_next = reference(1, situation.r_BN_N + situation.v_BN_N * dt);
        let bn = mrp::to_euler_parameters(&situation.body.sigma_BN);
        let br = mrp::relative_euler_parameters(&bn, &rn);
        let sigma_BR = mrp::from_euler_parameters(&br);
        // Rotation of R over a tick, σ ≈ ω·dt/4, taken from R to B components by dcm_BR.
        let turn_R = mrp::from_euler_parameters(&mrp::relative_euler_parameters(&rn_next, &rn)) * (4.0 / dt);
        let omega_RN_B = mrp::to_dcm(&sigma_BR) * turn_R;
        (sigma_BR, situation.body.omega_BN_B - omega_RN_B)
    }
}
