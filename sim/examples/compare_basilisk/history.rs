//! Reading a Basilisk history and flying it in Basilisk's own update order.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use nalgebra::Vector3;
use serde::Deserialize;
use swath_sim::config::{RAD_S_PER_RPM, SimConfig};
use swath_sim::time::Tick;
use swath_sim::vehicle::control::TrackingError;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::mrp;
use swath_sim::world::frames::{earth_to_inertial, reference_dcm};
use swath_sim::world::orbit::{Orbit, OrbitPhase};
use swath_sim::world::strip::Strip;
use swath_sim::world::turn::Turn;

/// A recorded history.
#[derive(Deserialize)]
pub struct History {
    pub meta: Meta,
    pub data: Data,
}

/// Inputs of a history.
#[derive(Deserialize)]
pub struct Meta {
    kind: Kind,
    guidance: Option<Reference>,
    #[serde(default)]
    planet_rate: f64,
    #[serde(default)]
    theta0: f64,
    order: Order,
    dt: f64,
    init: Option<InitialBody>,
    case: Option<Case>,
    #[serde(default)]
    strips: Vec<StripMeta>,
    /// a, e, i, Ω, ω, f.
    oe: [f64; 6],
    mu: f64,
    I_diag: [f64; 3],
    Js: f64,
    u_max: f64,
    K1: f64,
    K3: f64,
    omega_max: f64,
    Ki: f64,
    P: f64,
    integralLimit: f64,
    #[serde(default = "earth_radius")]
    planetRadius: f64,
}

fn earth_radius() -> f64 {
    6_378_136.6
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Step,
    Track,
    Chain,
}

/// Which guidance made the reference.
#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Reference {
    /// The paper's: fixed sign, scan direction without planet rotation.
    Paper,
    /// locationPointing's strip mode: the nearer of both signs, scan direction with planet rotation.
    Bsk,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Order {
    /// The target lags one tick; a command acts one tick late.
    Bskrl,
    /// No latency.
    Example,
}

#[derive(Deserialize, Clone)]
struct InitialBody {
    sigma0: [f64; 3],
    omega0: [f64; 3],
    rw_rpm: [f64; 3],
}

#[derive(Deserialize)]
struct Case {
    id: Option<i64>,
    #[serde(flatten)]
    init: InitialBody,
    sigma_RN: Option<[f64; 3]>,
    strip: Option<StripMeta>,
}

#[derive(Deserialize, Clone)]
struct StripMeta {
    r_start_P: [f64; 3],
    r_end_P: [f64; 3],
    v_acq: f64,
    T_pre: f64,
    #[serde(default)]
    t0: f64,
    t_end: Option<f64>,
}

/// Recorded rows.
#[derive(Deserialize)]
pub struct Data {
    pub t: Vec<f64>,
    sigma_BN: Vec<[f64; 3]>,
    omega_BN_B: Vec<[f64; 3]>,
    rw_cmd: Vec<[f64; 3]>,
    rw_speed: Vec<[f64; 3]>,
}

/// Largest differences from a history.
#[derive(Debug, Default)]
pub struct Differences {
    /// Rows compared.
    pub rows: usize,
    /// In σ_BN.
    pub sigma: f64,
    /// In ω_BN_B [rad/s].
    pub omega: f64,
    /// In the unsaturated wheel command [N m].
    pub command: f64,
    /// In wheel speed [rad/s].
    pub wheel_speed: f64,
}

impl Meta {
    /// Number of the case, where the file has one.
    pub fn case_id(&self) -> Option<i64> {
        (self.kind == Kind::Step).then(|| self.case.as_ref()?.id).flatten()
    }

    fn model(&self) -> Result<Model> {
        let mut config = SimConfig::default();
        config.earth.radius_m = self.planetRadius;
        config.earth.rotation_rad_s = self.planet_rate;
        config.earth.angle_at_epoch_deg = self.theta0.to_degrees();
        config.earth.mu_m3_s2 = self.mu;
        config.orbit.altitude_km = (self.oe[0] - self.planetRadius) / 1e3;
        config.orbit.inclination_deg = self.oe[2].to_degrees();
        config.spacecraft.inertia_kg_m2 = self.I_diag;
        config.spacecraft.wheel_inertia_kg_m2 = self.Js;
        config.spacecraft.wheel_torque_max_nm = self.u_max;
        config.control.frequency_hz = 1.0 / self.dt;
        config.control.k1 = self.K1;
        config.control.k3 = self.K3;
        config.control.omega_max_deg_s = self.omega_max.to_degrees();
        config.control.servo_ki = self.Ki;
        config.control.servo_p = self.P;
        config.control.servo_integral_limit = self.integralLimit;
        ensure!(self.oe[1] == 0.0, "eccentricity {} is not 0", self.oe[1]);
        Ok(Model::new(config)?)
    }

    fn initial_body(&self) -> Result<BodyState> {
        let init = match (&self.init, &self.case) {
            (Some(init), _) => init.clone(),
            (None, Some(case)) => case.init.clone(),
            (None, None) => bail!("neither `init` nor `case` gives the initial state"),
        };
        Ok(BodyState {
            sigma_BN: init.sigma0.into(),
            omega_BN_B: init.omega0.into(),
            wheel_speed: Vector3::from(init.rw_rpm) * RAD_S_PER_RPM,
        })
    }

    fn strips(&self) -> Vec<StripMeta> {
        let single = self.case.as_ref().and_then(|case| case.strip.clone());
        single.into_iter().chain(self.strips.iter().cloned()).collect()
    }
}

/// Reads a history file.
pub fn read(path: &Path) -> Result<History> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not a Basilisk history", path.display()))
}

/// Flies a history again, up to `until` [s], and compares every recorded row.
pub fn compare(history: &History, until: Option<f64>) -> Result<Differences> {
    let mut run = Run::new(&history.meta)?;
    let data = &history.data;
    let mut found = Differences::default();
    for (row, &t) in data.t.iter().enumerate() {
        if until.is_some_and(|until| t > until) {
            break;
        }
        let tick = (t / history.meta.dt).round() as u64;
        while run.tick.0 < tick {
            run.advance();
        }
        found.rows += 1;
        let largest = |kept: &mut f64, ours: Vector3<f64>, theirs: [f64; 3]| {
            *kept = kept.max((ours - Vector3::from(theirs)).amax());
        };
        // Both sets of an attitude are the same attitude.
        let theirs = Vector3::from(data.sigma_BN[row]);
        let same_set = if (run.body.sigma_BN - theirs).norm() > 1.0 { mrp::shadow(&theirs) } else { theirs };
        largest(&mut found.sigma, run.body.sigma_BN, same_set.into());
        largest(&mut found.omega, run.body.omega_BN_B, data.omega_BN_B[row]);
        largest(&mut found.command, run.command, data.rw_cmd[row]);
        largest(&mut found.wheel_speed, run.body.wheel_speed, data.rw_speed[row]);
    }
    ensure!(found.rows > 0, "the history has no rows");
    Ok(found)
}

struct Run<'a> {
    meta: &'a Meta,
    model: Model,
    orbit: Orbit,
    earth: Turn,
    strips: Vec<(StripMeta, Strip)>,
    tick: Tick,
    body: BodyState,
    previous_sigma: Option<Vector3<f64>>,
    active: usize,
    integral: Vector3<f64>,
    /// Unsaturated command computed at `tick`.
    command: Vector3<f64>,
    /// Torque in force from `tick` on.
    torque: Vector3<f64>,
}

impl<'a> Run<'a> {
    fn new(meta: &'a Meta) -> Result<Self> {
        let model = meta.model()?;
        let phase = OrbitPhase {
            raan_deg: meta.oe[3].to_degrees(),
            argument_of_latitude_deg: (meta.oe[4] + meta.oe[5]).to_degrees(),
        };
        let strips = meta.strips().into_iter().map(|s| (s.clone(), great_circle(&s, meta.planetRadius))).collect();
        let mut run = Self {
            meta,
            orbit: Orbit::new(&model.config, phase, model.period),
            earth: model.earth.clone(),
            strips,
            tick: Tick(0),
            body: meta.initial_body()?,
            previous_sigma: None,
            active: 0,
            integral: Vector3::zeros(),
            command: Vector3::zeros(),
            torque: Vector3::zeros(),
            model,
        };
        run.command = run.guide();
        if meta.order == Order::Example {
            run.pick_up();
        }
        Ok(run)
    }

    fn pick_up(&mut self) {
        self.torque = self.model.plant.wheels.saturate(&self.command, &self.body.wheel_speed);
    }

    fn advance(&mut self) {
        if self.meta.order == Order::Example {
            self.pick_up();
        }
        let torque = self.torque;
        self.model.plant.step(&mut self.body, &torque);
        self.tick = self.tick.after(1);
        if self.meta.order == Order::Bskrl {
            self.pick_up();
        }
        self.command = self.guide();
    }

    fn guide(&mut self) -> Vector3<f64> {
        let error = if self.meta.kind == Kind::Step {
            let sigma_RN = self.meta.case.as_ref().and_then(|case| case.sigma_RN).unwrap_or_default();
            let sigma_BR = mrp::subtract(&self.body.sigma_BN, &sigma_RN.into());
            TrackingError { sigma_BR, omega_BR_B: self.body.omega_BN_B }
        } else {
            self.track()
        };
        let dt = self.meta.dt;
        // Basilisk's servo takes time 0 for its first call: a run from t = 0 integrates nothing on its first two.
        let integral_step = if self.tick.0 < 2 { 0.0 } else { dt };
        let body = &self.body;
        self.model.law.torque(
            &self.model.plant,
            &error,
            &body.omega_BN_B,
            &body.wheel_speed,
            &mut self.integral,
            integral_step,
        )
    }

    fn track(&mut self) -> TrackingError {
        let dt = self.meta.dt;
        let time = self.tick.0 as f64 * dt;
        // Guidance of a chain's next strip is first evaluated one tick after the last one's end.
        if self.strips[self.active].0.t_end.is_some_and(|end| time > end + 1e-9) {
            self.active += 1;
            self.previous_sigma = None;
        }
        let (meta, strip) = &self.strips[self.active];
        let planet_tick = if self.meta.order == Order::Bskrl { Tick(self.tick.0.saturating_sub(1)) } else { self.tick };
        // Basilisk's target stops at the strip's end.
        let elapsed = (time - meta.t0 - meta.T_pre).min(strip.acquisition_time_s());
        let (target_E, scan_E) = strip.target_E(elapsed);
        let turn = self.earth.cos_sin(planet_tick);
        let target_N = earth_to_inertial(turn, &target_E) * self.meta.planetRadius;
        let mut scan_N = earth_to_inertial(turn, &scan_E);
        let bsk = self.meta.guidance == Some(Reference::Bsk);
        if bsk {
            let spin = Vector3::new(0.0, 0.0, self.meta.planet_rate);
            scan_N = (scan_N * meta.v_acq + spin.cross(&target_N)).normalize();
        }
        let r_BN_N = self.orbit.position(self.tick);
        let error_to = |scan: &Vector3<f64>| {
            let sigma_RN = mrp::from_dcm(&reference_dcm(&r_BN_N, &target_N, scan));
            mrp::subtract(&self.body.sigma_BN, &sigma_RN)
        };
        let mut sigma_BR = error_to(&scan_N);
        if bsk {
            let backward = error_to(&-scan_N);
            if backward.norm_squared() < sigma_BR.norm_squared() {
                sigma_BR = backward;
            }
        }
        // Basilisk reads a switch of MRP sets as a jump: plain difference, unlike `swath_sim::vehicle::guidance::rate_error`.
        let omega_BR_B = self
            .previous_sigma
            .map_or(Vector3::zeros(), |previous| mrp::rate_to_omega(&sigma_BR, &((sigma_BR - previous) / dt)));
        self.previous_sigma = Some(sigma_BR);
        TrackingError { sigma_BR, omega_BR_B }
    }
}

fn great_circle(meta: &StripMeta, radius: f64) -> Strip {
    let (start_E, end_E) = (Vector3::from(meta.r_start_P).normalize(), Vector3::from(meta.r_end_P).normalize());
    let normal = start_E.cross(&end_E);
    Strip {
        start_E,
        along_E: normal.cross(&start_E).normalize(),
        arc: start_E.angle(&end_E),
        angular_speed: meta.v_acq / radius,
        priority: 1.0,
    }
}
