//! Numbers out of a history, with errors that say which one is missing.

use anyhow::{Context, Result, bail};
use nalgebra::Vector3;
use serde::de::DeserializeOwned;
use serde_json::Value;
use swath_sim::config::{RAD_S_PER_RPM, SimConfig};
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::orbit::Orbit;

/// An object of a history.
pub struct Input<'a>(&'a Value, &'static str);

/// Rows of three numbers.
pub type Rows = Vec<[f64; 3]>;

impl<'a> Input<'a> {
    pub fn new(history: &'a Value, name: &'static str) -> Result<Self> {
        Ok(Self(history.get(name).with_context(|| format!("no `{name}`"))?, name))
    }

    /// A value of any kind.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Result<T> {
        let value = self.0.get(name).with_context(|| format!("no `{}.{name}`", self.1))?;
        serde_json::from_value(value.clone()).with_context(|| format!("`{}.{name}` is something else", self.1))
    }

    /// A value that may be missing or null.
    pub fn maybe<T: DeserializeOwned>(&self, name: &str) -> Result<Option<T>> {
        if self.0.get(name).is_none_or(Value::is_null) { Ok(None) } else { self.get(name).map(Some) }
    }

    pub fn number(&self, name: &str) -> Result<f64> {
        self.get(name)
    }

    pub fn vector(&self, name: &str) -> Result<Vector3<f64>> {
        self.get::<[f64; 3]>(name).map(Vector3::from)
    }

    /// Ticks of the rows.
    pub fn ticks(&self, period: TickPeriod) -> Result<Vec<Tick>> {
        let times: Vec<f64> = self.get("t")?;
        if times.is_empty() {
            bail!("the history has no rows");
        }
        Ok(times.iter().map(|t| Tick((t / period.seconds()).round() as u64)).collect())
    }

    pub fn period(&self) -> Result<TickPeriod> {
        Ok(TickPeriod::from_frequency(1.0 / self.number("dt")?)?)
    }

    /// The orbit through `r0` and `v0`.
    pub fn orbit(&self) -> Result<Orbit> {
        Ok(Orbit::through(&self.vector("r0")?, &self.vector("v0")?, Tick(0), self.period()?))
    }

    pub fn config(&self) -> Result<SimConfig> {
        let mut config = SimConfig::default();
        config.earth.mu_m3_s2 = self.number("mu")?;
        if let Some(radius) = self.maybe("planet_radius")?.or(self.maybe("R_E")?) {
            config.earth.radius_m = radius;
        }
        if let Some(rate) = self.maybe("omega_E")? {
            config.earth.rotation_rad_s = rate;
        }
        config.earth.angle_at_epoch_deg = self.maybe("theta0_deg")?.unwrap_or(0.0);
        config.orbit.altitude_km = (self.vector("r0")?.norm() - config.earth.radius_m) / 1e3;
        config.control.frequency_hz = 1.0 / self.number("dt")?;
        Ok(config)
    }

    /// The closed loop's model.
    pub fn model(&self) -> Result<Model> {
        let mut config = self.config()?;
        config.spacecraft.inertia_kg_m2 = self.get("I_diag")?;
        config.spacecraft.wheel_inertia_kg_m2 = self.number("Js")?;
        config.spacecraft.wheel_torque_max_nm = self.number("u_max")?;
        config.control.k1 = self.number("K1")?;
        config.control.k3 = self.number("K3")?;
        config.control.omega_max_deg_s = self.number("omega_max")?.to_degrees();
        config.control.servo_ki = self.number("Ki")?;
        config.control.servo_p = self.number("P")?;
        config.control.servo_integral_limit = self.number("integralLimit")?;
        Ok(Model::new(config)?)
    }

    pub fn body(&self) -> Result<BodyState> {
        let wheels = self.maybe::<[f64; 3]>("rw_rpm")?.unwrap_or_default();
        Ok(BodyState {
            sigma_BN: self.vector("sigma0")?,
            omega_BN_B: self.vector("omega0")?,
            wheel_speed: Vector3::from(wheels) * RAD_S_PER_RPM,
        })
    }
}
