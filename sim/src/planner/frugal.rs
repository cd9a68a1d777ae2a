//! A beam search that pays for energy and data, and charges and sends where that costs least.

use super::decision::{Decision, DecisionContext, Planner, PlannerError, wait_for_a_window};
use super::handmade::WHEELS_W;
use super::lookahead::{BeamSearch, Experience, Meter, Prices, Search};
use crate::config::resources::ResourcesConfig;
use crate::task::Duty;
use crate::vehicle::resources::ResourceState;

/// Beam search with prices.
///
/// A joule has a price in priority that rises as the charge falls which would be left after the next shadow, were nothing
/// but imaged until then; a bit has one that rises as the storage fills. A sequence of strips is worth its priorities
/// less what its flight takes of both, and is flown unless charging pays more a second: so the satellite charges where the
/// Sun is low over what it images, where there is little to image, and where it points at the Sun already. With a
/// body-fixed antenna it sends all at once, as late in a contact as that can be, or as soon as the storage is half full.
#[derive(Clone, Debug)]
pub struct Frugal {
    search: BeamSearch,
    tariff: Tariff,
    experience: Experience,
}

/// How prices follow from what is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tariff {
    /// Price of a kilojoule where the charge left is the floor and a reserve.
    pub kilojoule: f64,
    /// Share of the capacity that is kept above the floor.
    pub reserve: f64,
    /// Share of the capacity over which the price changes by a factor e.
    pub scale: f64,
    /// Price of an image that takes a hundredth of the storage, in a full storage.
    pub hundredth: f64,
    /// Share of the storage over which that changes by a factor e.
    pub storage_scale: f64,
}

impl Default for Tariff {
    fn default() -> Self {
        Self { kilojoule: 0.005, reserve: 0.05, scale: 0.2, hundredth: 0.3, storage_scale: 0.3 }
    }
}

/// Shares of the time of a satellite that images all the time in which the imager and the transmitter work.
const IMAGER_SHARE: f64 = 0.75;
const TRANSMITTER_SHARE: f64 = 0.15;
/// Steps in which the light until the next shadow is added up.
const STEPS: u32 = 24;
/// For how long charging is tried in the head [s]: the price of a slew spreads over it.
const CHARGES_S: [f64; 2] = [120.0, 360.0];
/// How long it is charged before the next decision [s].
const CHARGE_S: f64 = 60.0;
/// The same where nothing else is to be done [s].
const REST_S: f64 = 20.0;
/// How long it takes to turn the antenna to the Earth [s].
const TURN_S: f64 = 60.0;
/// What a task with an image takes of a contact that waits for it [s].
const TASK_S: f64 = 100.0;
/// Share of the storage from which on it is sent at once.
const FULL_ENOUGH: f64 = 0.5;

impl Default for Frugal {
    /// Narrower than the beam that pays for nothing: what energy costs is known of fewer sequences in the same time.
    fn default() -> Self {
        Self::new(BeamSearch { width: 4, depth: 3, budget: 60_000 }, Tariff::default())
    }
}

impl Frugal {
    /// A planner with no experience yet.
    #[must_use]
    pub fn new(search: BeamSearch, tariff: Tariff) -> Self {
        Self { search, tariff, experience: Experience::default() }
    }

    fn choose(&self, context: &DecisionContext<'_>, search: &mut Search<'_>) -> Decision {
        let candidates = context.candidates;
        let (Some(state), Some(config)) = (&context.situation.resources, &context.model.config.resources) else {
            let best = self.search.priced(search, candidates, &Prices::default()).into_iter().next();
            return best.map_or_else(|| wait_for_a_window(context), |it| image(it.imaged[0], it.first_t_pre));
        };
        if let Some(decision) = send(context, state, config) {
            return decision;
        }
        let prices = search.meter().map(|meter| self.tariff.prices(context, meter, state, config)).unwrap_or_default();
        let best = self.search.priced(search, candidates, &prices).into_iter().next();
        let charge = Decision::Serve { duty: Duty::Charge, ticks: ticks(context, CHARGE_S) };
        let charging = charging(context, search, &prices);
        match best {
            Some(best) if best.ratio() >= charging => image(best.imaged[0], best.first_t_pre),
            Some(_) => charge,
            // Nothing is worth what it costs: there is time to charge.
            None => Decision::Serve { duty: Duty::Charge, ticks: ticks(context, REST_S) },
        }
    }
}

impl Planner for Frugal {
    fn name(&self) -> String {
        "frugal".to_owned()
    }

    fn forget(&mut self) {
        self.experience.forget();
    }

    fn minds_wheels(&self) -> bool {
        true
    }

    fn minds_resources(&self) -> bool {
        true
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let allowance = self.experience.learn(context);
        let mut search = Search::new(context.model, context.situation, &allowance).metered();
        let decision = self.choose(context, &mut search);
        self.experience.remember(context, decision);
        Ok(decision)
    }
}

impl Tariff {
    fn prices(
        &self,
        context: &DecisionContext<'_>,
        meter: &Meter,
        state: &ResourceState,
        config: &ResourcesConfig,
    ) -> Prices {
        let left = charge_left(context, meter, state, config) / state.capacity_j;
        let short = (config.battery_floor + self.reserve - left) / self.scale;
        let storage = (state.storage_bits as f64).max(1.0);
        let full = state.stored_bits as f64 / storage;
        let data = self.hundredth * libm::exp((full - 1.0) / self.storage_scale);
        // In contact room is made while an image is taken.
        let room = if state.in_contact { f64::INFINITY } else { storage - state.stored_bits as f64 };
        Prices { joule: 1e-3 * self.kilojoule * libm::exp(short.clamp(-6.0, 6.0)), bit: data / (0.01 * storage), room }
    }
}

/// The charge that is left at the end of the next shadow when the satellite images until then [J]. While it images, its
/// array points up on average.
fn charge_left(context: &DecisionContext<'_>, meter: &Meter, state: &ResourceState, config: &ResourcesConfig) -> f64 {
    let situation = context.situation;
    let load_w = config.bus_w
        + 3.0 * config.wheel_base_w
        + WHEELS_W
        + IMAGER_SHARE * config.imager_w
        + TRANSMITTER_SHARE * config.transmitter_w;
    let (r_BN_N, v_BN_N) = (&situation.r_BN_N, &situation.v_BN_N);
    let orbit_s = context.model.orbit_period_s();
    let (begin_s, end_s) = meter.sun().next_shadow_s(r_BN_N, v_BN_N).unwrap_or((orbit_s, orbit_s));
    let sunlit_s = begin_s.max(0.0);
    let (up, along) = (r_BN_N.normalize(), v_BN_N.normalize());
    let step_s = sunlit_s / f64::from(STEPS);
    let light_j: f64 = (0..STEPS)
        .map(|step| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * (f64::from(step) + 0.5) * step_s / orbit_s);
            let height = (up * cos + along * sin).dot(meter.sun().direction_N());
            meter.full_w() * height.max(0.0) * step_s
        })
        .sum();
    let before_j = (state.charge_j + light_j - load_w * sunlit_s).min(state.capacity_j);
    before_j - load_w * (end_s - sunlit_s)
}

/// What charging pays a tick, which is less than nothing, as with images: the longer it is tried, the better or not.
fn charging(context: &DecisionContext<'_>, search: &mut Search<'_>, prices: &Prices) -> f64 {
    let lengths = CHARGES_S.map(|seconds| ticks(context, seconds));
    let begin = search.begin;
    let taken = search.serve(&begin, Duty::Charge, lengths);
    let pay = |(taken_j, ticks): (f64, u32)| -prices.joule * taken_j / f64::from(ticks);
    taken.into_iter().zip(lengths).map(pay).fold(f64::NEG_INFINITY, f64::max)
}

/// Sends where a body-fixed antenna has to be pointed for it and it is time to.
fn send(context: &DecisionContext<'_>, state: &ResourceState, config: &ResourcesConfig) -> Option<Decision> {
    if !config.antenna_needs_task() || state.to_send_bits == 0 || config.transmitter_rate_bps <= 0.0 {
        return None;
    }
    let (rise, set) = state.contact?;
    let now = context.situation.now;
    let seconds = |ticks: i64| ticks as f64 * context.model.period.seconds();
    let (to_rise_s, left_s) = (seconds(rise.since(now)).max(0.0), seconds(set.since(now)));
    let send_s = state.to_send_bits as f64 / config.transmitter_rate_bps;
    let full = state.stored_bits as f64 >= FULL_ENOUGH * state.storage_bits as f64;
    let due = left_s - to_rise_s.max(TURN_S) <= send_s + TASK_S;
    if to_rise_s > TURN_S || !(due || full) {
        return None;
    }
    let wanted_s = (to_rise_s.max(TURN_S) + send_s).min(left_s);
    Some(Decision::Serve { duty: Duty::Downlink, ticks: ticks(context, wanted_s) })
}

fn image(candidate: usize, t_pre: u32) -> Decision {
    Decision::Image { candidate, t_pre }
}

fn ticks(context: &DecisionContext<'_>, seconds: f64) -> u32 {
    context.model.period.ticks_ceil(seconds).max(1)
}
