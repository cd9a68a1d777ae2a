//! The radio channel: when it is open, how long a frame takes, and which frames are lost.

use rand::RngExt as _;
use swath_sim::rng;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::model::Model;
use swath_sim::world::contacts::{Contacts, View};
use swath_sim::world::orbit::Orbit;

use super::config::{LinkConfig, LinkMode};
use super::end::{Rates, Sent};
use super::passes::range_mask_m;
use crate::faults::FaultPlan;
use crate::faults::plan::Scheduled;
use crate::file::{Mission, MissionError};

/// Speed of light [m/s].
const LIGHT_M_S: f64 = 299_792_458.0;
/// Silence in a pass after which an end sends a frame without items [s].
const HELLO_S: f64 = 60.0;

/// A direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the satellite.
    Up,
    /// To the ground.
    Down,
}

/// The radio channel of a mission. It knows nothing of what it carries, and nothing of before.
#[derive(Clone, Debug)]
pub struct Radio {
    config: LinkConfig,
    seed: u64,
    period: TickPeriod,
    contacts: Contacts,
    views: Vec<View>,
    orbit: Orbit,
    delay_max: u64,
    horizon: Tick,
    /// When frames are lost besides, by order, and which share.
    disturbed: Vec<(Scheduled, f64)>,
}

impl Radio {
    /// The channel of a mission; none if it has no `[link]`.
    ///
    /// # Errors
    /// When a station is not there.
    pub fn of(mission: &Mission, model: &Model) -> Result<Option<Self>, MissionError> {
        let Some(config) = mission.link.clone() else { return Ok(None) };
        let stations = config.all_stations()?;
        let (orbit, horizon) = (mission.orbit(model), mission.horizon(model));
        let contacts = Contacts::new(&stations, &model.config, &orbit, model.period, horizon);
        let views = stations.iter().map(|station| View::new(station, &model.config, model.period)).collect();
        let farthest = stations.iter().map(|station| range_mask_m(station, model, &orbit)).fold(0.0, f64::max);
        let (period, seed) = (model.period, mission.seed);
        let delay_max = delay(&config, farthest, period);
        let disturbed = mission.faults.frames_lost(period);
        Ok(Some(Self { config, seed, period, contacts, views, orbit, delay_max, horizon, disturbed }))
    }

    /// The faults of the mission are these from now on.
    pub fn disturb(&mut self, faults: &FaultPlan) {
        self.disturbed = faults.frames_lost(self.period);
    }

    /// Probability that a frame that leaves at a tick does not arrive.
    fn loss(&self, tick: Tick) -> f64 {
        let acts = |(it, _): &&(Scheduled, f64)| it.from <= tick && tick < it.until;
        let shares = self.disturbed.iter().filter(acts).map(|(_, share)| share);
        shares.fold(self.config.loss, |loss, share| loss + (1.0 - loss) * share)
    }

    /// What the ends' transmitters can do: the ground's, the satellite's.
    #[must_use]
    pub fn rates(&self) -> (Rates, Rates) {
        let bits = |bps: f64| ((bps * self.period.seconds()) as u64).max(1);
        let (up, down) = (bits(self.config.uplink_bps), bits(self.config.downlink_bps));
        let hello = u64::from(self.period.ticks_ceil(HELLO_S));
        (Rates::new(up, down, self.delay_max, hello), Rates::new(down, up, self.delay_max, hello))
    }

    /// The settings.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        &self.config
    }

    /// Whether it is open at a tick.
    #[must_use]
    pub fn open(&self, tick: Tick) -> bool {
        match self.config.mode {
            LinkMode::Always => true,
            LinkMode::Passes => self.contacts.any(tick),
        }
    }

    /// The first tick from `tick` on at which it is open; none before the mission's end.
    #[must_use]
    pub fn next_open(&self, tick: Tick) -> Option<Tick> {
        match self.config.mode {
            LinkMode::Always => Some(tick),
            LinkMode::Passes => self.contacts.next(tick).map(|(rise, _)| rise.max(tick)),
        }
        .filter(|open| *open < self.horizon)
    }

    /// The passes.
    #[must_use]
    pub fn contacts(&self) -> &Contacts {
        &self.contacts
    }

    /// Time that a frame takes that leaves at a tick [ticks], by way of the nearest station; 1 at least.
    fn delay(&mut self, tick: Tick) -> u64 {
        if self.config.mode == LinkMode::Always {
            return self.delay_max;
        }
        let r_BN_N = self.orbit.position(tick);
        let views = &mut self.views;
        let ranges = self
            .contacts
            .at(tick)
            .filter_map(|contact| views.get_mut(contact.station).map(|view| view.elevation_and_range(tick, &r_BN_N).1));
        let nearest = ranges.fold(f64::INFINITY, f64::min);
        if nearest.is_finite() { delay(&self.config, nearest, self.period) } else { self.delay_max }
    }

    /// Carries what leaves at a tick: each frame that arrives, with the tick at which it does.
    pub fn carry(&mut self, direction: Direction, now: Tick, frames: Vec<Sent>) -> Vec<(Tick, Vec<u8>)> {
        if frames.is_empty() || !self.open(now) {
            return Vec::new();
        }
        let mut rng = rng::radio(self.seed, now.0, direction == Direction::Up);
        let (delay, loss) = (self.delay(now), self.loss(now));
        let mut arriving = Vec::new();
        for Sent { bytes, air_ticks } in frames {
            let lost = rng.random::<f64>() < loss;
            // The station must hear a frame to its last bit.
            let left = Tick(now.0.saturating_add(air_ticks));
            if !lost && self.open(left) {
                arriving.push((Tick(left.0.saturating_add(delay)), bytes));
            }
        }
        arriving
    }
}

/// Time that a frame takes over a distance [m], in ticks, rounded up once.
fn delay(config: &LinkConfig, range_m: f64, period: TickPeriod) -> u64 {
    let range_m = if config.mode == LinkMode::Always { 0.0 } else { range_m };
    u64::from(period.ticks_ceil(range_m / LIGHT_M_S + config.processing_s)).max(1)
}
