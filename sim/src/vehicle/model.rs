//! A configuration turned into SI constants, shared by everything that flies it.

use crate::config::SimConfig;
use crate::config::station::Station;
use crate::error::SimError;
use crate::time::TickPeriod;
use crate::vehicle::control::ControlLaw;
use crate::vehicle::dynamics::Plant;
use crate::world::turn::{Turn, earth_turn};

/// A validated configuration with what follows from it.
#[derive(Clone, Debug)]
pub struct Model {
    /// The configuration.
    pub config: SimConfig,
    /// Length of a control tick.
    pub period: TickPeriod,
    /// Body and wheels.
    pub plant: Plant,
    /// Steering law and servo.
    pub law: ControlLaw,
    /// The Earth's rotation angle.
    pub earth: Turn,
    /// Stations that the satellite sends to.
    pub stations: Vec<Station>,
}

impl Model {
    /// Validates a configuration and derives its constants.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn new(config: SimConfig) -> Result<Self, SimError> {
        config.validate()?;
        let period = TickPeriod::from_frequency(config.control.frequency_hz)?;
        Ok(Self {
            plant: Plant::new(&config.spacecraft, period.seconds()),
            law: ControlLaw::new(&config.control),
            earth: earth_turn(&config, period),
            stations: config.resources.as_ref().map_or(Ok(Vec::new()), |resources| resources.all_stations())?,
            period,
            config,
        })
    }

    /// Radius of the orbit [m].
    #[must_use]
    pub fn orbit_radius(&self) -> f64 {
        self.config.earth.radius_m + self.config.orbit.altitude_km * 1e3
    }

    /// Period of the orbit [s].
    #[must_use]
    pub fn orbit_period_s(&self) -> f64 {
        let radius = self.orbit_radius();
        std::f64::consts::TAU * (radius * radius * radius / self.config.earth.mu_m3_s2).sqrt()
    }

    /// Longest transition in whole ticks.
    #[must_use]
    pub fn t_pre_max(&self) -> u32 {
        self.period.ticks_ceil(self.config.planning.t_pre_max_s)
    }
}
