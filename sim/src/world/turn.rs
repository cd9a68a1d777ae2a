//! Angles that turn uniformly: the Earth's rotation and the argument of latitude.

use crate::config::SimConfig;
use crate::time::{Tick, TickPeriod};

/// A uniformly turning angle: cosine and sine at any tick.
///
/// The angle of a tick is that of its block of [`Turn::BLOCK`] ticks plus the rest, whose cosine and sine stand in a
/// table: four products a tick instead of a sine and a cosine. The result is a pure function of the tick; what is
/// cached is only the last block's.
#[derive(Clone, Debug)]
pub struct Turn {
    phase: f64,
    rate_per_tick: f64,
    rest: Vec<(f64, f64)>,
    block: u64,
    block_cos_sin: (f64, f64),
}

impl Turn {
    const BLOCK: u64 = 256;

    /// An angle that is `phase` [rad] at tick 0 and grows by `rate` [rad/s].
    #[must_use]
    pub fn new(phase: f64, rate: f64, period: TickPeriod) -> Self {
        let rate_per_tick = rate * period.seconds();
        let cos_sin = |angle: f64| (libm::cos(angle), libm::sin(angle));
        Self {
            phase,
            rate_per_tick,
            rest: (0..Self::BLOCK).map(|i| cos_sin(rate_per_tick * i as f64)).collect(),
            block: 0,
            block_cos_sin: cos_sin(phase),
        }
    }

    /// Cosine and sine of the angle at a tick.
    #[inline]
    pub fn cos_sin(&mut self, tick: Tick) -> (f64, f64) {
        let block = tick.0 / Self::BLOCK;
        if block != self.block {
            let angle = self.phase + self.rate_per_tick * (block * Self::BLOCK) as f64;
            self.block = block;
            self.block_cos_sin = (libm::cos(angle), libm::sin(angle));
        }
        let (c1, s1) = self.block_cos_sin;
        let (c2, s2) = self.rest[(tick.0 % Self::BLOCK) as usize];
        (c1 * c2 - s1 * s2, s1 * c2 + c1 * s2)
    }

    /// Angle at a time since the epoch [rad], unwrapped.
    #[must_use]
    pub fn angle_at(&self, time_s: f64, period: TickPeriod) -> f64 {
        self.phase + self.rate_per_tick * (time_s / period.seconds())
    }
}

/// The Earth's rotation angle.
#[must_use]
pub fn earth_turn(config: &SimConfig, period: TickPeriod) -> Turn {
    Turn::new(config.earth.angle_at_epoch_deg.to_radians(), config.earth.rotation_rad_s, period)
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn a_turn_is_the_sine_and_cosine_of_its_angle() {
        let period = TickPeriod::from_frequency(2.0).unwrap();
        let mut turn = Turn::new(0.3, 1.1e-3, period);
        for tick in [0, 1, 255, 256, 172_800, 511] {
            let angle: f64 = 0.3 + 1.1e-3 * 0.5 * tick as f64;
            let (c, s) = turn.cos_sin(Tick(tick));
            assert_relative_eq!(c, libm::cos(angle), epsilon = 1e-13);
            assert_relative_eq!(s, libm::sin(angle), epsilon = 1e-13);
        }
    }
}
