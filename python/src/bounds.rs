//! What the features of an observation can be at most, so that its space has an end.

use swath_sim::config::RAD_S_PER_RPM;
use swath_sim::learn::episode::EpisodeConfig;
use swath_sim::learn::observation::{
    DENSITY_SCALE, MOMENTUM_SCALE, ORBIT_SCALE_S, ObservationSet, RATE_SCALE, WINDOW_SCALE_S,
};
use swath_sim::mission::{horizon, windows_until};
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::model::Model;

/// Slack for the rounding to 32 bits.
const ROUNDING: f64 = 1e-5;
/// What the noise of sensors reaches at most: Box and Muller's numbers from 53 bits end at 8.6 [sigma].
const NOISE_SIGMAS: f64 = 9.0;
/// Contacts are looked for this far past twice the present time [s].
const CONTACTS_AHEAD_S: f64 = 2.0 * 86_400.0;

/// Least and greatest value of each feature of a strip, in the order of [`swath_sim::learn::observation::observe`].
pub fn of(model: &Model, episode: &EpisodeConfig, plant: &PlantErrors, set: ObservationSet) -> (Vec<f32>, Vec<f32>) {
    let config = &model.config;
    let hill = 2.0 + config.orbit.altitude_km * 1e3 / config.earth.radius_m;
    let time_s = model.period.time_s(windows_until(model, horizon(model, episode.orbits)));
    let window = time_s / WINDOW_SCALE_S;
    let (momentum, rate) = (momentum(model, plant), rate(model, plant));
    let length = config.requests.length_max_km;
    let either = |most: f64| (-most, most);
    let table1 = [(0.0, 1.0), either(hill), either(hill), either(hill), either(hill), either(hill), either(hill)];
    // A metre of rounding is let pass where a strip's length is checked; ‖B(σ)ω‖/4 ≤ ‖ω‖/2 with ‖σ‖ ≤ 1.
    let rest = [
        (0.0, (length + 1e-3) / length),
        (0.0, 1.0),
        (0.0, 1.0),
        (0.0, 0.5 * rate / RATE_SCALE),
        either(window),
        either(window),
    ];
    let extra = [momentum / MOMENTUM_SCALE, 1.0, rate / RATE_SCALE].into_iter().flat_map(|most| [either(most); 3]);
    let all = table1.into_iter().chain(rest).chain(extra).chain(resources(model, time_s)).take(set.features());
    all.map(|(low, high)| ((low - ROUNDING) as f32, (high * (1.0 + ROUNDING) + ROUNDING) as f32)).unzip()
}

/// Features of power and data, up to a time [s].
fn resources(model: &Model, time_s: f64) -> [(f64, f64); 16] {
    let shadow = 2.0 * model.orbit_period_s() / ORBIT_SCALE_S;
    let contact = (2.0 * time_s + CONTACTS_AHEAD_S) / ORBIT_SCALE_S;
    let density = model.config.planning.candidates as f64 / DENSITY_SCALE;
    let (share, either) = ((0.0, 1.0), |most: f64| (-most, most));
    let relative = [either(shadow), either(shadow), share, share, either(contact), either(contact)];
    let mut all = [(0.0, density); 16];
    let own = [share, either(1.0), share].into_iter().chain(relative).chain([either(1.0); 3]);
    all.iter_mut().zip(own).for_each(|(slot, bound)| *slot = bound);
    all
}

/// Most momentum that a wheel can have [N m s]. A wheel at its limit takes no more torque, so it passes it by less than
/// a tick's worth; twice that leaves room for the body's own turning.
fn momentum(model: &Model, plant: &PlantErrors) -> f64 {
    let craft = &model.config.spacecraft;
    let tick = craft.wheel_torque_max_nm * plant.torque_limit_scale * model.period.seconds();
    2.0 * (craft.wheel_inertia_kg_m2 * craft.wheel_speed_max_rpm * RAD_S_PER_RPM + tick)
}

/// Fastest that body and reference can turn against each other [rad/s]: the momentum of body and wheels is conserved,
/// and the reference's rate is 4σ over a tick with ‖σ‖ ≤ 1.
fn rate(model: &Model, plant: &PlantErrors) -> f64 {
    let craft = &model.config.spacecraft;
    let inertias = craft.inertia_kg_m2.map(|inertia| inertia * plant.inertia_scale);
    let least = inertias.iter().copied().fold(f64::INFINITY, f64::min) - craft.wheel_inertia_kg_m2;
    let most = inertias.iter().copied().fold(0.0, f64::max);
    let sqrt3 = 3f64.sqrt();
    let conserved = sqrt3 * (most * craft.rate_initial_max_rad_s + momentum(model, plant));
    let body = (conserved + sqrt3 * momentum(model, plant)) / least;
    body + 4.0 / model.period.seconds() + NOISE_SIGMAS * sqrt3 * plant.rate_noise_rad_s
}
