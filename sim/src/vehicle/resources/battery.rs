//! Solar array, wheel power and battery, with books in whole nanojoules that close exactly.

use nalgebra::Vector3;

use crate::world::sun::{ASTRONOMICAL_UNIT, SOLAR_FLUX};

/// Nanojoules in a joule.
pub const NJ_PER_J: f64 = 1e9;

/// A flat solar array, fixed to the body.
#[derive(Clone, Debug)]
pub struct SolarArray {
    /// Unit normal in B.
    pub normal_B: Vector3<f64>,
    /// Power at normal incidence of the full Sun at one astronomical unit [W].
    full_w: f64,
}

impl SolarArray {
    /// An array of an area [m²], an efficiency, and a normal of any length.
    #[must_use]
    pub fn new(area_m2: f64, efficiency: f64, normal_B: Vector3<f64>) -> Self {
        Self { normal_B: normal_B.normalize(), full_w: SOLAR_FLUX * area_m2 * efficiency }
    }

    /// Power [W] from the Sun at `r_SB_N` from the satellite [m], seen by a share, the array's normal being in N.
    #[inline]
    #[must_use]
    pub fn power_w(&self, normal_N: &Vector3<f64>, r_SB_N: &Vector3<f64>, illumination: f64) -> f64 {
        let toward = normal_N.dot(r_SB_N);
        if toward <= 0.0 {
            return 0.0;
        }
        let inverse = 1.0 / r_SB_N.norm();
        let scale = ASTRONOMICAL_UNIT * inverse;
        self.full_w * (scale * scale) * illumination * (toward * inverse)
    }

    /// Power at normal incidence of the full Sun at one astronomical unit [W].
    #[must_use]
    pub fn full_w(&self) -> f64 {
        self.full_w
    }
}

/// Electric power of wheels.
#[derive(Clone, Copy, Debug)]
pub struct WheelPower {
    /// Always there [W].
    pub base_w: f64,
    /// Share of the electric power that becomes work.
    pub motor_efficiency: f64,
    /// Share of the work that comes back in braking; below 0, braking costs what driving costs.
    pub recovery: f64,
}

impl WheelPower {
    /// Power that a wheel takes [W]; negative where it gives some back.
    #[inline]
    #[must_use]
    pub fn power_w(&self, wheel_speed: f64, torque: f64) -> f64 {
        let work = wheel_speed * torque;
        if work > 0.0 || self.recovery < 0.0 {
            self.base_w + work.abs() / self.motor_efficiency
        } else {
            self.base_w + self.recovery * work
        }
    }
}

/// Energy that came, went and stayed since the epoch [nJ].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EnergyBooks {
    /// Charge at the epoch.
    pub initial_nj: u64,
    /// From the array, and from braking wheels.
    pub generated_nj: u128,
    /// What all loads asked for.
    pub asked_nj: u128,
    /// What came when the battery was full.
    pub spilled_nj: u128,
    /// What was asked for when the battery was empty.
    pub unmet_nj: u128,
}

/// A battery without losses between nothing and its capacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Battery {
    capacity_nj: u64,
    charge_nj: u64,
    books: EnergyBooks,
}

impl Battery {
    /// A battery of a capacity [J] with a charge [J], which is clamped to it.
    #[must_use]
    pub fn new(capacity_j: f64, charge_j: f64) -> Self {
        let capacity_nj = nanojoules(capacity_j);
        let charge_nj = nanojoules(charge_j).min(capacity_nj);
        Self { capacity_nj, charge_nj, books: EnergyBooks { initial_nj: charge_nj, ..EnergyBooks::default() } }
    }

    /// Takes what comes and gives what is asked for [J]; says whether all that was asked for was there.
    #[inline]
    pub fn flow(&mut self, generated_j: f64, asked_j: f64) -> bool {
        let (generated, asked) = (nanojoules(generated_j), nanojoules(asked_j));
        self.books.generated_nj += u128::from(generated);
        self.books.asked_nj += u128::from(asked);
        let available = self.charge_nj + generated;
        if available < asked {
            self.books.unmet_nj += u128::from(asked - available);
            self.charge_nj = 0;
            return false;
        }
        let rest = available - asked;
        self.charge_nj = rest.min(self.capacity_nj);
        self.books.spilled_nj += u128::from(rest - self.charge_nj);
        true
    }

    /// Charge [J].
    #[must_use]
    pub fn charge_j(&self) -> f64 {
        self.charge_nj as f64 / NJ_PER_J
    }

    /// Capacity [J].
    #[must_use]
    pub fn capacity_j(&self) -> f64 {
        self.capacity_nj as f64 / NJ_PER_J
    }

    /// Charge over capacity.
    #[must_use]
    pub fn level(&self) -> f64 {
        self.charge_nj as f64 / self.capacity_nj as f64
    }

    /// What came, went and stayed.
    #[must_use]
    pub fn books(&self) -> &EnergyBooks {
        &self.books
    }

    /// Whether the books close: what was there and what came is what went, what is there and what was spilled.
    #[must_use]
    pub fn books_close(&self) -> bool {
        let books = &self.books;
        u128::from(books.initial_nj) + books.generated_nj + books.unmet_nj
            == u128::from(self.charge_nj) + books.asked_nj + books.spilled_nj
    }
}

/// Joules in whole nanojoules; negative ones and NaN are none.
#[inline]
fn nanojoules(joules: f64) -> u64 {
    (joules * NJ_PER_J + 0.5) as u64
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_array_gives_its_cosine_and_nothing_from_behind() {
        let array = SolarArray::new(2.0, 0.3, Vector3::new(0.0, 0.0, -5.0));
        let sun = Vector3::new(0.0, 0.0, -ASTRONOMICAL_UNIT);
        let power = |normal: Vector3<f64>| array.power_w(&normal, &sun, 0.5);
        assert_relative_eq!(power(array.normal_B), 1361.0 * 2.0 * 0.3 * 0.5, max_relative = 1e-14);
        let slanted = Vector3::new(0.6, 0.0, -0.8);
        assert_relative_eq!(power(slanted), 0.8 * power(array.normal_B), max_relative = 1e-14);
        assert_eq!(power(Vector3::z()), 0.0);
    }

    #[test]
    fn a_wheel_that_brakes_costs_gives_or_does_neither() {
        let wheel = |recovery| WheelPower { base_w: 20.4, motor_efficiency: 0.5, recovery };
        assert_relative_eq!(wheel(0.4).power_w(-100.0, -0.2), 60.4);
        assert_relative_eq!(wheel(0.4).power_w(-100.0, 0.2), 20.4 - 8.0);
        assert_relative_eq!(wheel(0.0).power_w(-100.0, 0.2), 20.4);
        assert_relative_eq!(wheel(-1.0).power_w(-100.0, 0.2), 60.4);
    }

    proptest! {
        #[test]
        fn the_books_close_whatever_comes_and_goes(flows in prop::collection::vec((0.0..300.0, 0.0..300.0), 1..400)) {
            let mut battery = Battery::new(1000.0, 400.0);
            let mut short = false;
            for (generated, asked) in flows {
                short |= !battery.flow(generated, asked);
                prop_assert!(battery.books_close());
                prop_assert!(battery.charge_j() <= battery.capacity_j());
            }
            prop_assert_eq!(short, battery.books().unmet_nj > 0);
        }
    }

    #[test]
    fn a_full_battery_spills_and_an_empty_one_says_so() {
        let mut battery = Battery::new(10.0, 9.0);
        assert!(battery.flow(3.0, 1.0));
        assert_eq!((battery.charge_j(), battery.books().spilled_nj), (10.0, 1_000_000_000));
        assert!(!battery.flow(0.0, 11.5));
        assert_eq!((battery.charge_j(), battery.books().unmet_nj), (0.0, 1_500_000_000));
        assert!(battery.books_close());
    }
}
