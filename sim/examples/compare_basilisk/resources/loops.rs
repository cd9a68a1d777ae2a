//! Closed loops in Basilisk's update order, with magnetic rods and gravity gradient.

use anyhow::{Result, bail};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use swath_sim::config::RAD_S_PER_RPM;
use swath_sim::time::Tick;
use swath_sim::vehicle::control::TrackingError;
use swath_sim::vehicle::dynamics::{BodyState, Stage};
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::mrp;
use swath_sim::vehicle::resources::momentum::{External, Rods};
use swath_sim::world::frames::hill_dcm;
use swath_sim::world::magnetic::DipoleField;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::turn::Turn;

use super::read::{Input, Rows};
use super::sunlight::{rigid, same_set};
use super::{Check, Comparison};

/// What the satellite points at.
#[derive(Clone, Copy)]
enum Guidance {
    /// A constant attitude.
    Inertial(Vector3<f64>),
    /// The Hill frame, turned by an offset: `dcm_RR0`.
    Nadir(Matrix3<f64>),
}

/// Rods and their law.
#[derive(Clone, Deserialize)]
struct Torquers {
    law: String,
    gain: f64,
    max_dipole: f64,
    #[serde(default)]
    bias_rpm: [f64; 3],
}

#[derive(Deserialize)]
struct DipoleMeta {
    g10_T: f64,
    g11_T: f64,
    h11_T: f64,
    radius_m: f64,
}

/// A dipole that Basilisk got wrong.
#[derive(Deserialize)]
struct BadTick {
    t: f64,
    dipole_cmd: [f64; 3],
}

/// A closed loop, one tick after the other.
pub struct ClosedLoop {
    pub model: Model,
    pub orbit: Orbit,
    pub body: BodyState,
    pub now: Tick,
    /// Torque in force from now on [N m].
    pub torque: Vector3<f64>,
    guidance: Guidance,
    earth: Turn,
    integral: Vector3<f64>,
    /// Unsaturated command computed now [N m].
    command: Vector3<f64>,
    gradient: f64,
    field: Option<DipoleField>,
    torquers: Option<Torquers>,
    bad_ticks: Vec<(Tick, Vector3<f64>)>,
    /// Dipole commanded now [A m²].
    dipole_B: Vector3<f64>,
    field_N: Vector3<f64>,
    /// Torques of rods and of gravity at the last stage of the step that ended now [N m].
    last_torques: (Vector3<f64>, Vector3<f64>),
}

impl ClosedLoop {
    pub fn new(meta: &Input<'_>) -> Result<Self> {
        let model = meta.model()?;
        let guidance = match meta.maybe::<String>("guidance")?.as_deref() {
            Some("nadir") => Guidance::Nadir(mrp::to_dcm(&meta.vector("sigma_R0R")?).transpose()),
            None | Some("inertial") => Guidance::Inertial(meta.vector("sigma_RN")?),
            Some(other) => bail!("unknown guidance `{other}`"),
        };
        let dipole: Option<DipoleMeta> = meta.maybe("dipole")?;
        let field = dipole.map(|it| DipoleField::new(Vector3::new(it.g11_T, it.h11_T, it.g10_T), it.radius_m));
        let bad_ticks: Vec<BadTick> = meta.maybe("svd_bad_ticks")?.unwrap_or_default();
        let orbit = meta.orbit()?;
        let gravity: bool = meta.maybe("gravity_gradient")?.unwrap_or(false);
        let mu = meta.number("mu")?;
        let period = model.period;
        let mut this = Self {
            earth: model.earth.clone(),
            body: meta.body()?,
            now: Tick(0),
            torque: Vector3::zeros(),
            guidance,
            integral: Vector3::zeros(),
            command: Vector3::zeros(),
            gradient: if gravity { 3.0 * mu / (orbit.radius * orbit.radius * orbit.radius) } else { 0.0 },
            field,
            torquers: meta.maybe("mtb")?,
            bad_ticks: bad_ticks
                .iter()
                .map(|it| (Tick((it.t / period.seconds()).round() as u64), it.dipole_cmd.into()))
                .collect(),
            dipole_B: Vector3::zeros(),
            field_N: Vector3::zeros(),
            last_torques: (Vector3::zeros(), Vector3::zeros()),
            orbit,
            model,
        };
        this.look();
        Ok(this)
    }

    pub fn advance(&mut self) {
        let then = self.now.after(1);
        let up_N = [self.orbit.position(self.now).normalize(), self.orbit.position(then).normalize()];
        let external = External {
            torque_B: Vector3::zeros(),
            dipole_B: self.dipole_B,
            field_N: self.field_N,
            up_N: [up_N[0], (up_N[0] + up_N[1]).normalize(), up_N[1]],
            gradient: self.gradient,
        };
        let (plant, torque) = (&self.model.plant, self.torque);
        let mut last = (Vector3::zeros(), Vector3::zeros());
        plant.step_under(&mut self.body, &torque, |stage, sigma| {
            if stage == Stage::End {
                let gravity = External { dipole_B: Vector3::zeros(), ..external };
                let rods = External { gradient: 0.0, ..external };
                last = (rods.torque(stage, sigma, &plant.inertia), gravity.torque(stage, sigma, &plant.inertia));
            }
            external.torque(stage, sigma, &plant.inertia)
        });
        self.last_torques = last;
        self.now = then;
        self.torque = plant.wheels.saturate(&self.command, &self.body.wheel_speed);
        self.look();
    }

    /// Field, guidance, control and rods at the present tick.
    fn look(&mut self) {
        let r_BN_N = self.orbit.position(self.now);
        let error = self.error();
        // Basilisk's servo takes time 0 for its first call: it integrates nothing on its first two.
        let dt = if self.now.0 < 2 { 0.0 } else { self.model.period.seconds() };
        let (law, plant, body) = (&self.model.law, &self.model.plant, &self.body);
        self.command = law.torque(plant, &error, &body.omega_BN_B, &body.wheel_speed, &mut self.integral, dt);
        let (Some(field), Some(torquers)) = (&self.field, &self.torquers) else { return };
        self.field_N = field.field_N(&r_BN_N, self.earth.cos_sin(self.now));
        let field_B = mrp::to_dcm(&self.body.sigma_BN) * self.field_N;
        let bias = Vector3::from(torquers.bias_rpm) * RAD_S_PER_RPM;
        let momentum = (self.body.wheel_speed - bias) * self.model.plant.wheels.inertia;
        self.dipole_B = Rods { gain: torquers.gain, dipole_max: torquers.max_dipole }.dipole(&momentum, &field_B);
        if let Some((_, dipole)) = self.bad_ticks.iter().find(|(tick, _)| *tick == self.now) {
            self.dipole_B = *dipole;
        }
        self.command += self.dipole_B.cross(&field_B);
    }

    pub fn error(&mut self) -> TrackingError {
        let body = &self.body;
        match self.guidance {
            Guidance::Inertial(sigma_RN) => {
                TrackingError { sigma_BR: mrp::subtract(&body.sigma_BN, &sigma_RN), omega_BR_B: body.omega_BN_B }
            }
            Guidance::Nadir(dcm_RH) => {
                let (r_BN_N, v_BN_N) = (self.orbit.position(self.now), self.orbit.velocity(self.now));
                let dcm_BN = mrp::to_dcm(&body.sigma_BN);
                let dcm_RN = dcm_RH * hill_dcm(&r_BN_N, &v_BN_N);
                let omega_RN_N = r_BN_N.cross(&v_BN_N) / r_BN_N.norm_squared();
                TrackingError {
                    sigma_BR: mrp::from_dcm(&(dcm_BN * dcm_RN.transpose())),
                    omega_BR_B: body.omega_BN_B - dcm_BN * omega_RN_N,
                }
            }
        }
    }
}

/// Wheels emptied by rods, and gravity on a held attitude.
pub fn momentum(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let mut flown = ClosedLoop::new(meta)?;
    let rods = flown.torquers.as_ref().map(|it| it.law.as_str());
    if rods.is_some_and(|law| law != "cross" && law != "svd") {
        bail!("unknown law {rods:?}");
    }
    let ticks = data.ticks(flown.model.period)?;
    let (sigmas, omegas, speeds): (Rows, Rows, Rows) =
        (data.get("sigma_BN")?, data.get("omega_BN_B")?, data.get("rw_speed")?);
    let fields: Option<Rows> = data.maybe("magField_N")?;
    let dipoles: Option<Rows> = data.maybe("dipole_cmd")?;
    let rod_torques: Option<Rows> = data.maybe("mtb_torque_B")?;
    let gravity: Option<Rows> = data.maybe("gg_torque_B")?;
    let mut checks = vec![
        Check::new("sigma", 1e-8),
        Check::new("omega rad/s", 1e-8),
        Check::new("wheel rad/s", 1e-8),
        Check::new("field T", 1e-12),
        Check::new("dipole A m2", 1e-7),
        Check::new("rod torque N m", 1e-10),
        Check::new("gravity N m", 1e-9),
    ];
    for (row, &tick) in ticks.iter().enumerate() {
        while flown.now < tick {
            flown.advance();
        }
        let body = &flown.body;
        checks[0].add_all(body.sigma_BN.as_slice(), same_set(&body.sigma_BN, sigmas[row]).as_slice());
        checks[1].add_all(body.omega_BN_B.as_slice(), &omegas[row]);
        checks[2].add_all(body.wheel_speed.as_slice(), &speeds[row]);
        let mut compare = |check: usize, ours: &Vector3<f64>, theirs: &Option<Rows>| {
            if let Some(theirs) = theirs {
                checks[check].add_all(ours.as_slice(), &theirs[row]);
            }
        };
        compare(3, &flown.field_N, &fields);
        compare(4, &flown.dipole_B, &dipoles);
        compare(5, &flown.last_torques.0, &rod_torques);
        if tick.0 > 0 {
            compare(6, &flown.last_torques.1, &gravity);
        }
    }
    Ok(Comparison { rows: ticks.len(), checks })
}

/// A rigid body without wheels, turned by gravity alone.
pub fn gravity_tumble(meta: &Input<'_>, data: &Input<'_>) -> Result<Comparison> {
    let (mut orbit, period) = (meta.orbit()?, meta.period()?);
    let inertia = meta.maybe("I_diag")?.unwrap_or(swath_sim::config::SpacecraftConfig::default().inertia_kg_m2);
    let (plant, mut body) = (rigid(inertia, period.seconds()), meta.body()?);
    let gradient = 3.0 * meta.number("mu")? / (orbit.radius * orbit.radius * orbit.radius);
    let ticks = data.ticks(period)?;
    let (sigmas, omegas, torques): (Rows, Rows, Rows) =
        (data.get("sigma_BN")?, data.get("omega_BN_B")?, data.get("gg_torque_B")?);
    let mut checks = [Check::new("sigma", 1e-8), Check::new("omega rad/s", 1e-8), Check::new("gravity N m", 1e-9)];
    let (mut now, mut last) = (Tick(0), Vector3::zeros());
    for (row, &tick) in ticks.iter().enumerate() {
        while now < tick {
            let up_N = [orbit.position(now).normalize(), orbit.position(now.after(1)).normalize()];
            let zero = Vector3::zeros();
            let up_N = [up_N[0], (up_N[0] + up_N[1]).normalize(), up_N[1]];
            let external = External { torque_B: zero, dipole_B: zero, field_N: zero, up_N, gradient };
            plant.step_under(&mut body, &zero, |stage, sigma| {
                last = external.torque(stage, sigma, &plant.inertia);
                last
            });
            now = now.after(1);
        }
        checks[0].add_all(body.sigma_BN.as_slice(), same_set(&body.sigma_BN, sigmas[row]).as_slice());
        checks[1].add_all(body.omega_BN_B.as_slice(), &omegas[row]);
        if tick.0 > 0 {
            checks[2].add_all(last.as_slice(), &torques[row]);
        }
    }
    Ok(Comparison { rows: ticks.len(), checks: checks.into() })
}
