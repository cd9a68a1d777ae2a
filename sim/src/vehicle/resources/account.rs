//! What a tick costs and brings: the spacecraft's power, data and momentum, and when they fail it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::config::resources::{Antenna, Desaturation, ResourcesConfig};
use crate::time::Tick;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::model::Model;
use crate::vehicle::mrp::Rotation;
use crate::vehicle::resources::battery::{Battery, SolarArray, WheelPower};
use crate::vehicle::resources::momentum::{External, Rods, Thrusters};
use crate::vehicle::resources::storage::Storage;
use crate::world::contacts::{ContactPlan, View};
use crate::world::magnetic::DipoleField;
use crate::world::orbit::Orbit;
use crate::world::strip::StripId;
use crate::world::sun::Sun;
use crate::world::turn::Turn;

/// What the imager does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Imager {
    /// It is off.
    #[default]
    Off,
    /// It warms up: it takes power and records nothing.
    Warm,
    /// It records a strip.
    Records(StripId),
}

/// What the satellite does over a tick besides turning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Activity {
    /// What the imager does.
    pub imager: Imager,
    /// Whether a body-fixed antenna may send.
    pub downlink: bool,
    /// Number of the tick of a desaturation.
    pub desaturate: Option<u32>,
    /// Where a task that images has ended before this tick: what its image is worth, 0 for one that failed.
    pub image_worth: Option<f64>,
}

/// What the satellite cannot go on without.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Failure {
    /// The loads asked for more than the battery had.
    BatteryEmpty,
    /// A wheel's momentum exceeded its limit.
    WheelMomentum,
}

/// What came to the ground, and what failed, since the epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Delivered {
    /// Images whose last bit is on the ground.
    pub strips: u64,
    /// Sum of their strips' priorities.
    pub reward: f64,
    /// Times that safe mode was come into: the battery was empty or a wheel over its limit.
    pub failures: u64,
    /// Times that the charge fell below the battery's floor.
    #[serde(default)]
    pub floor_violations: u64,
}

impl Delivered {
    /// Nothing.
    pub const NONE: Self = Self { strips: 0, reward: 0.0, failures: 0, floor_violations: 0 };
}

/// How power and data stand at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResourceState {
    /// Charge of the battery [J].
    pub charge_j: f64,
    /// Capacity of the battery [J].
    pub capacity_j: f64,
    /// Share of the Sun's disc that is seen.
    pub illumination: f64,
    /// Power of the array over the last tick [W].
    pub generated_w: f64,
    /// Power of all loads over the last tick [W].
    pub asked_w: f64,
    /// Bits stored.
    pub stored_bits: u64,
    /// Bits that wait to be sent.
    pub to_send_bits: u64,
    /// Bits that there is room for in all.
    pub storage_bits: u64,
    /// Whether a station heard the satellite at the last tick.
    pub in_contact: bool,
    /// The time in contact with any station that is under way or comes next: its first tick, and the first one after it.
    pub contact: Option<(Tick, Tick)>,
    /// Bits sent over the last tick.
    pub sent_bits: u64,
    /// Dipole of the rods over the last tick, in B [A m²].
    pub rod_dipole_B: Vector3<f64>,
    /// Momentum of the wheel that has most [N m s].
    pub momentum_nms: f64,
    /// What failed and is not mended yet: until it is, the satellite only sees to that.
    pub safe_mode: Option<Failure>,
    /// What came to the ground, and what failed.
    pub delivered: Delivered,
}

impl ResourceState {
    /// Charge over capacity.
    #[must_use]
    pub fn level(&self) -> f64 {
        self.charge_j / self.capacity_j
    }
}

/// Power, data and momentum of a spacecraft: the truth of them.
#[derive(Clone, Debug)]
pub struct Onboard {
    config: ResourcesConfig,
    sun: Sun,
    field: DipoleField,
    earth: Turn,
    array: SolarArray,
    wheel_power: WheelPower,
    rods: Option<Rods>,
    thrusters: Option<Thrusters>,
    antenna_B: Vector3<f64>,
    cos_antenna: f64,
    /// 3μ/r³ [1/s²].
    gradient: f64,
    /// (R/r)³ of the field.
    field_scale: f64,
    /// 1/r [1/m], and 1/(2·cos(n·dt/2)): the sum of two unit vectors a tick apart times this is the one between them.
    inverse_radius: f64,
    middle_scale: f64,
    dt: f64,
    bits_a_tick: (u64, u64),
    contacts: ContactPlan,
    views: Vec<View>,
    battery: Battery,
    storage: Storage,
    state: ResourceState,
}

/// Share of its limit to which a wheel's momentum must fall before it counts as mended.
const MENDED_SHARE: f64 = 0.9;

/// A rate over a tick in whole bits.
#[must_use]
pub fn bits(rate_bps: f64, dt: f64) -> u64 {
    (rate_bps * dt).round() as u64
}

impl Onboard {
    /// Power, data and momentum at the epoch, where the model's configuration has them.
    #[must_use]
    pub fn new(model: &Model, orbit: &Orbit) -> Option<Self> {
        let config = model.config.resources.as_deref()?;
        let earth_radius = model.config.earth.radius_m;
        let stations = model.stations.clone();
        let dt = model.period.seconds();
        let capacity_j = config.battery_capacity_j();
        let battery = Battery::new(capacity_j, config.battery_initial * capacity_j);
        let mu = model.config.earth.mu_m3_s2;
        let by = |wanted| config.desaturation == wanted;
        let field = DipoleField::default();
        let mut onboard = Self {
            sun: config.sun(earth_radius),
            field_scale: field.scale(orbit.radius),
            field,
            inverse_radius: 1.0 / orbit.radius,
            middle_scale: 0.5 / libm::cos(0.5 * orbit.mean_motion * dt),
            earth: model.earth.clone(),
            array: config.array(),
            wheel_power: config.wheel_power(),
            rods: by(Desaturation::Rods)
                .then_some(Rods { gain: config.rod_gain_per_s, dipole_max: config.rod_dipole_max_am2 }),
            thrusters: by(Desaturation::Thrusters).then_some(Thrusters {
                torque_max: config.thruster_torque_max_nm,
                pulse_every: config.thruster_pulse_every,
            }),
            antenna_B: Vector3::from(config.antenna_axis_b).normalize(),
            cos_antenna: libm::cos(config.antenna_half_angle_deg.to_radians()),
            gradient: if config.gravity_gradient {
                3.0 * mu / (orbit.radius * orbit.radius * orbit.radius)
            } else {
                0.0
            },
            dt,
            bits_a_tick: (bits(config.imager_rate_bps, dt), bits(config.transmitter_rate_bps, dt)),
            views: stations.iter().map(|it| View::new(it, &model.config, model.period)).collect(),
            contacts: ContactPlan::new(stations, &model.config, orbit, model.period),
            storage: Storage::new(config.storage_capacity_bits),
            state: ResourceState::at_epoch(&battery, config.storage_capacity_bits),
            battery,
            config: config.clone(),
        };
        onboard.state.contact = onboard.contacts.around(Tick(0)).next(Tick(0));
        Some(onboard)
    }

    /// Torques that turn the body at start, middle and end of the tick that begins at `now`, and what the wheels' torque
    /// must be changed by for those that are commanded [N m].
    #[inline]
    pub(crate) fn torques(
        &mut self,
        now: Tick,
        positions_N: &[Vector3<f64>; 2],
        body: &BodyState,
        plant: &Plant,
        activity: Activity,
    ) -> ([Vector3<f64>; 3], Vector3<f64>) {
        let (start_N, end_N) = (positions_N[0] * self.inverse_radius, positions_N[1] * self.inverse_radius);
        let momentum_B = body.wheel_speed * plant.wheels.inertia;
        let field_N = self.field.field_above_N(&start_N, self.field_scale, self.earth.cos_sin(now));
        let mut feed_forward = Vector3::zeros();
        self.state.rod_dipole_B = Vector3::zeros();
        if let Some(rods) = &self.rods {
            let field_B = Rotation::new(&body.sigma_BN).apply(&field_N);
            self.state.rod_dipole_B = rods.dipole(&momentum_B, &field_B);
            feed_forward = self.state.rod_dipole_B.cross(&field_B);
        }
        let mut torque_B = Vector3::from(self.config.disturbance_nm);
        if let (Some(thrusters), Some(since)) = (&self.thrusters, activity.desaturate) {
            let torque = thrusters.torque(&momentum_B, since, self.dt);
            torque_B += torque;
            feed_forward += torque;
        }
        let dipole_B = self.state.rod_dipole_B + Vector3::from(self.config.residual_dipole_am2);
        let up_N = [start_N, (start_N + end_N) * self.middle_scale, end_N];
        let external = External { torque_B, dipole_B, field_N, up_N, gradient: self.gradient };
        (external.over_tick(&body.sigma_BN, &body.omega_BN_B, &plant.inertia, self.dt), feed_forward)
    }

    /// Books the tick that ended at `now` in a state, under a torque of the wheels [N m].
    #[inline]
    pub(crate) fn book(
        &mut self,
        now: Tick,
        r_BN_N: &Vector3<f64>,
        body: &BodyState,
        plant: &Plant,
        torque: &Vector3<f64>,
        activity: Activity,
    ) {
        if let Some(worth) = activity.image_worth {
            self.storage.keep(worth);
        }
        match activity.imager {
            Imager::Records(strip) => _ = self.storage.record(strip, self.bits_a_tick.0),
            // What ended without a word of its worth was cut short.
            Imager::Off | Imager::Warm => self.storage.discard(),
        }
        self.transmit(now, r_BN_N, body, activity);
        let met = self.power(r_BN_N, body, torque, activity);
        self.state.stored_bits = self.storage.stored();
        self.state.to_send_bits = self.storage.to_send();
        self.state.momentum_nms = body.wheel_speed.amax() * plant.wheels.inertia;
        let floor_j = self.config.battery_floor * self.state.capacity_j;
        let was_above = self.state.charge_j >= floor_j;
        self.state.charge_j = self.battery.charge_j();
        self.state.delivered.floor_violations += u64::from(was_above && self.state.charge_j < floor_j);
        self.mind_failures(met);
    }

    /// Comes into safe mode when the battery is empty or a wheel has failed, and out of it when that is mended.
    fn mind_failures(&mut self, met: bool) {
        let (state, limit) = (&mut self.state, self.config.wheel_momentum_max_nms);
        let failed = if !met {
            Some(Failure::BatteryEmpty)
        } else {
            (state.momentum_nms > limit).then_some(Failure::WheelMomentum)
        };
        let mended = state.level() >= self.config.battery_floor && state.momentum_nms <= MENDED_SHARE * limit;
        if failed.is_some() {
            state.delivered.failures += u64::from(state.safe_mode.is_none());
            state.safe_mode = failed;
        } else if mended {
            state.safe_mode = None;
        }
    }

    /// Says whether the battery had what was asked for.
    fn power(&mut self, r_BN_N: &Vector3<f64>, body: &BodyState, torque: &Vector3<f64>, activity: Activity) -> bool {
        let config = &self.config;
        self.state.illumination = self.sun.illumination(r_BN_N);
        let mut generated_w = 0.0;
        if self.state.illumination > 0.0 {
            let normal_N = Rotation::new(&body.sigma_BN).back().apply(&self.array.normal_B);
            generated_w = self.array.power_w(&normal_N, &(self.sun.r_SE_N - r_BN_N), self.state.illumination);
        }
        let mut asked_w = config.bus_w;
        for (speed, torque) in body.wheel_speed.iter().zip(torque.iter()) {
            let power_w = self.wheel_power.power_w(*speed, *torque);
            generated_w += (-power_w).max(0.0);
            asked_w += power_w.max(0.0);
        }
        if activity.imager != Imager::Off {
            asked_w += config.imager_w;
        }
        if self.state.sent_bits > 0 {
            asked_w += config.transmitter_w;
        }
        if let Some(rods) = &self.rods
            && rods.dipole_max > 0.0
        {
            asked_w += config.rod_w * self.state.rod_dipole_B.lp_norm(1) / rods.dipole_max;
        }
        if activity.desaturate.is_some() && self.thrusters.is_some() {
            asked_w += config.thruster_w;
        }
        (self.state.generated_w, self.state.asked_w) = (generated_w, asked_w);
        self.battery.flow(generated_w * self.dt, asked_w * self.dt)
    }

    fn transmit(&mut self, now: Tick, r_BN_N: &Vector3<f64>, body: &BodyState, activity: Activity) {
        if self.state.contact.is_some_and(|(_, set)| set <= now) {
            self.state.contact = self.contacts.around(now).next(now);
        }
        self.state.in_contact = self.state.contact.is_some_and(|(rise, _)| rise <= now);
        self.state.sent_bits = 0;
        if !self.state.in_contact || self.storage.to_send() == 0 || !self.heard(now, r_BN_N, body, activity) {
            return;
        }
        let delivered = &mut self.state.delivered;
        let order = self.config.downlink_order;
        self.state.sent_bits = self.storage.send(self.bits_a_tick.1, order, |file| {
            delivered.strips += 1;
            delivered.reward += file.worth;
        });
    }

    /// Whether the antenna points at a station that is in contact.
    fn heard(&mut self, now: Tick, r_BN_N: &Vector3<f64>, body: &BodyState, activity: Activity) -> bool {
        if self.config.antenna == Antenna::Steerable {
            return true;
        }
        if !activity.downlink {
            return false;
        }
        let boresight_N = Rotation::new(&body.sigma_BN).back().apply(&self.antenna_B);
        let views = &mut self.views;
        self.contacts.around(now).at(now).any(|contact| {
            let Some(view) = views.get_mut(contact.station) else { return false };
            let line_N = view.position_N(now) - r_BN_N;
            boresight_N.dot(&line_N) >= self.cos_antenna * line_N.norm()
        })
    }

    /// How power and data stand.
    #[must_use]
    pub fn state(&self) -> &ResourceState {
        &self.state
    }

    /// The settings.
    #[must_use]
    pub fn config(&self) -> &ResourcesConfig {
        &self.config
    }

    /// Whether momentum is taken out by thrusters, which takes a task.
    #[must_use]
    pub fn has_thrusters(&self) -> bool {
        self.config.has_thrusters()
    }

    /// The battery.
    #[must_use]
    pub fn battery(&self) -> &Battery {
        &self.battery
    }

    /// The storage.
    #[must_use]
    pub fn storage(&self) -> &Storage {
        &self.storage
    }

    /// Contacts around a tick.
    pub fn contacts(&mut self, tick: Tick) -> &crate::world::contacts::Contacts {
        self.contacts.around(tick)
    }
}

impl ResourceState {
    fn at_epoch(battery: &Battery, storage_bits: u64) -> Self {
        Self {
            charge_j: battery.charge_j(),
            capacity_j: battery.capacity_j(),
            illumination: 1.0,
            generated_w: 0.0,
            asked_w: 0.0,
            stored_bits: 0,
            to_send_bits: 0,
            storage_bits,
            in_contact: false,
            contact: None,
            sent_bits: 0,
            rod_dipole_B: Vector3::zeros(),
            momentum_nms: 0.0,
            safe_mode: None,
            delivered: Delivered::NONE,
        }
    }
}

impl ResourcesConfig {
    /// The Sun over an Earth of a radius [m].
    #[must_use]
    pub fn sun(&self, earth_radius: f64) -> Sun {
        Sun::at(self.sun_right_ascension_deg, self.sun_declination_deg, self.sun_distance_au, earth_radius)
    }

    /// The solar array.
    #[must_use]
    pub fn array(&self) -> SolarArray {
        SolarArray::new(self.panel_area_m2, self.panel_efficiency, self.panel_normal_b.into())
    }

    /// The wheels' power.
    #[must_use]
    pub fn wheel_power(&self) -> WheelPower {
        WheelPower {
            base_w: self.wheel_base_w,
            motor_efficiency: self.wheel_motor_efficiency,
            recovery: self.wheel_recovery,
        }
    }
}
