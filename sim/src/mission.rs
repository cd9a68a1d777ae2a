//! How long a mission is, in ticks.

use crate::model::Model;
use crate::time::Tick;

/// How far past the mission's end windows are sought [orbits], so that its end cannot be seen in the observation.
const WINDOW_MARGIN_ORBITS: f64 = 1.5;

/// Tick at which a mission of a number of orbits ends.
#[must_use]
pub fn horizon(model: &Model, orbits: f64) -> Tick {
    Tick((orbits * model.orbit_period_s() / model.period.seconds()).round() as u64)
}

/// Tick up to which a mission that ends at `horizon` seeks windows.
#[must_use]
pub fn windows_until(model: &Model, horizon: Tick) -> Tick {
    horizon.after(model.period.ticks_ceil(model.orbit_period_s() * WINDOW_MARGIN_ORBITS))
}
