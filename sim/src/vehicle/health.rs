//! What flight software can tell of its own wheels and sensors, from what they tell and what was commanded.

use nalgebra::Vector3;

use crate::time::Tick;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::model::Model;
use crate::vehicle::mrp;

/// Share of the commanded torque below which a wheel falls short.
const SHORT: f64 = 0.75;
/// Share of the torque limit that a command must reach before a wheel is judged by it.
const WORTH_JUDGING: f64 = 0.05;
/// The same where magnetorquers and thrusters act on the body too.
const WORTH_JUDGING_AMONG_OTHERS: f64 = 0.5;
/// Share of the torque limit below which a wheel counts as lost.
const LOST: f64 = 0.02;
/// Judgements in one sense, one after the other, before a wheel's health is taken to be another: 1.5 s at 2 Hz.
const JUDGEMENTS: u32 = 3;
/// A rotation about an axis in a tick that no attitude measured twice can hide [rad].
const MOVED: f64 = 1e-9;
/// Difference of gyro and star tracker at which the gyro counts as biased [rad/s].
const BIAS_MIN: f64 = 5e-5;
/// What the mean of two rates may be off the turn between them, as a share of their difference.
const UNSTEADY: f64 = 0.02;

/// What is known of wheels and sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// Share of its torque limit that each wheel gives; 1 when nothing is wrong, 0 when it is lost.
    pub wheels: Vector3<f64>,
    /// Whether there is no new attitude from the star tracker; it is then carried on with the gyro.
    pub tracker_out: bool,
    /// What the gyro is taken to add to the rates, and is corrected by [rad/s]; 0 when nothing is wrong.
    pub gyro_bias: Vector3<f64>,
}

impl Health {
    /// What of it is worth telling when it changes.
    fn signs(&self) -> (Vector3<f64>, bool, bool) {
        (self.wheels, self.tracker_out, self.biased())
    }

    /// Whether the gyro counts as biased.
    #[must_use]
    pub fn biased(&self) -> bool {
        self.gyro_bias != Vector3::zeros()
    }

    /// Whether a wheel is lost.
    #[must_use]
    pub fn wheel_lost(&self) -> bool {
        lost(&self.wheels)
    }
}

/// Whether one of the wheels that give these shares of their torque limits is lost.
#[must_use]
pub fn lost(wheels: &Vector3<f64>) -> bool {
    wheels.min() < LOST
}

impl Default for Health {
    fn default() -> Self {
        Self { wheels: Vector3::repeat(1.0), tracker_out: false, gyro_bias: Vector3::zeros() }
    }
}

/// Watches wheels and sensors, one state after the other.
///
/// A wheel is judged by its momentum: Js·(Ω+ω) changes by the torque that acted times the tick. One that gives less than
/// three quarters of what was commanded for three judgements in a row has the limit that it showed meanwhile; one that
/// gives what was commanded is sound again. When every wheel gives nothing, no command reached them, and none is judged.
///
/// A star tracker that has no attitude repeats its last one, to the last bit, while the gyro tells of a rotation. The
/// gyro is compared with the change of attitude over a tick, as a running mean: over two ticks where sensors are exact,
/// over half a minute where they are as noisy as small satellites' are.
#[derive(Clone, Debug)]
pub struct Watch {
    plant: Plant,
    dt: f64,
    /// Share of the torque limit from which a wheel is judged.
    worth_judging: f64,
    /// Weight of the newest comparison of gyro and star tracker, once for exact sensors and once for noisy ones.
    weight: f64,
    health: Health,
    /// The state before, as it was measured, whether its attitude was new, and what was made of it.
    last: Option<Last>,
    /// Commands of the last two ticks, the older one first; it acts over the tick after its own.
    commands: [Option<(Tick, Vector3<f64>)>; 2],
    judged: [Judged; 3],
    residual: Vector3<f64>,
    /// Change of the rate in a tick, as the same mean [rad/s].
    change: f64,
    compared: u32,
    /// What came to be known, and when.
    changes: Vec<(Tick, Health)>,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    tick: Tick,
    measured: BodyState,
    fresh: bool,
    estimate: BodyState,
}

/// Judgements of a wheel that say something else than its health does.
#[derive(Clone, Copy, Debug, Default)]
struct Judged {
    count: u32,
    /// Whether the last one was that it falls short.
    short: bool,
    /// Greatest torque that it gave meanwhile [N m].
    greatest: f64,
}

impl Watch {
    /// A watch over a sound satellite; `noisy` is whether its sensors are known to be.
    #[must_use]
    pub fn new(model: &Model, noisy: bool) -> Self {
        Self {
            plant: model.plant.clone(),
            dt: model.period.seconds(),
            worth_judging: match model.config.resources {
                Some(_) => WORTH_JUDGING_AMONG_OTHERS,
                None => WORTH_JUDGING,
            },
            weight: if noisy { 1.0 / 60.0 } else { 0.5 },
            health: Health::default(),
            last: None,
            commands: [None; 2],
            judged: [Judged::default(); 3],
            residual: Vector3::zeros(),
            change: 0.0,
            compared: 0,
            changes: Vec::new(),
        }
    }

    /// What is known.
    #[must_use]
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// What came to be known since the last call, each with its tick; first of all that nothing is known to be wrong.
    /// The corrections of a biased gyro go on without being told.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        std::mem::take(&mut self.changes)
    }

    /// What another watch had come to know before this one was there.
    pub(super) fn precede_changes(&mut self, changes: Vec<(Tick, Health)>) {
        self.changes.splice(0..0, changes);
    }

    /// Remembers the torque commanded from the state at a tick [N m].
    pub fn commanded(&mut self, tick: Tick, torque: Vector3<f64>) {
        self.commands = [self.commands[1], Some((tick, torque))];
    }

    /// Others than the wheels take part in turning the satellite: what was commanded says nothing of them.
    pub fn helped(&mut self) {
        self.commands = [None; 2];
    }

    /// Takes the state measured at a tick, and gives attitude and rate as they are best known. The same tick again
    /// changes nothing.
    pub fn look(&mut self, tick: Tick, measured: &BodyState) -> BodyState {
        let last = match self.last {
            Some(last) if last.tick == tick => return last.estimate,
            Some(last) if last.tick.after(1) == tick => last,
            last => {
                if last.is_none() {
                    self.changes.push((tick, self.health));
                }
                return self.remember(tick, measured, true, *measured);
            }
        };
        let before = self.health;
        self.judge_wheels(&last, measured);
        let omega = (measured.omega_BN_B + last.measured.omega_BN_B) * 0.5;
        let repeated = measured.sigma_BN == last.measured.sigma_BN && omega.amax() * self.dt > MOVED;
        self.health.tracker_out = repeated;
        if !repeated && last.fresh {
            self.compare(&last.measured, measured, &omega);
        }
        if self.health.signs() != before.signs() {
            self.changes.push((tick, self.health));
        }
        let mut estimate = *measured;
        estimate.omega_BN_B -= self.health.gyro_bias;
        if repeated {
            let turn_B = (omega - self.health.gyro_bias) * (self.dt / 4.0);
            estimate.sigma_BN = mrp::add(&last.estimate.sigma_BN, &turn_B);
        }
        self.remember(tick, measured, !repeated, estimate)
    }

    fn remember(&mut self, tick: Tick, measured: &BodyState, fresh: bool, estimate: BodyState) -> BodyState {
        self.last = Some(Last { tick, measured: *measured, fresh, estimate });
        estimate
    }

    /// Judges each wheel by the change of its momentum since the state before.
    fn judge_wheels(&mut self, last: &Last, now: &BodyState) {
        let acted = self.commands.iter().flatten().find(|(tick, _)| tick.after(1) == last.tick);
        let Some((_, command)) = acted else { return };
        let before = &last.measured;
        let commanded = self.plant.wheels.saturate(command, &before.wheel_speed);
        let spin = |body: &BodyState| body.wheel_speed + body.omega_BN_B;
        let given = (spin(now) - spin(before)) * (self.plant.wheels.inertia / self.dt);
        let max = self.plant.wheels.torque_max;
        let gave_nothing = |wheel: usize| given[wheel].abs() < LOST * max[wheel];
        if (0..3).all(gave_nothing) {
            return;
        }
        for wheel in 0..3 {
            let (wanted, gave) = (commanded[wheel].abs(), given[wheel] * commanded[wheel].signum());
            if wanted > self.worth_judging * max[wheel] {
                self.judge(wheel, wanted, gave / max[wheel], gave < SHORT * wanted);
            }
        }
    }

    fn judge(&mut self, wheel: usize, wanted: f64, share: f64, short: bool) {
        let known = self.health.wheels[wheel];
        // A weak wheel that is asked for no more than it can give tells nothing.
        let tells = short || wanted > known.max(LOST) * self.plant.wheels.torque_max[wheel] / SHORT;
        if !tells {
            return;
        }
        let judged = &mut self.judged[wheel];
        let same = if short { (share - known).abs() < 1.0 - SHORT && known < 1.0 } else { known == 1.0 };
        if same {
            *judged = Judged::default();
            return;
        }
        if judged.short != short {
            *judged = Judged { short, ..Judged::default() };
        }
        judged.count += 1;
        judged.greatest = judged.greatest.max(share);
        if judged.count >= JUDGEMENTS {
            let share = if judged.greatest < LOST { 0.0 } else { judged.greatest.min(1.0) };
            self.health.wheels[wheel] = if short { share } else { 1.0 };
            *judged = Judged::default();
        }
    }

    /// Compares the gyro with the change of attitude over a tick.
    fn compare(&mut self, before: &BodyState, now: &BodyState, omega: &Vector3<f64>) {
        // A rotation by θ has the MRP tan(θ/4).
        let sigma = mrp::subtract(&now.sigma_BN, &before.sigma_BN);
        let norm = sigma.norm();
        let turned_B = if norm > 0.0 { sigma * (4.0 * libm::atan(norm) / (norm * self.dt)) } else { sigma };
        self.compared += 1;
        // A mean of all, until there are as many as the running one weighs.
        let weight = self.weight.max(1.0 / f64::from(self.compared));
        self.residual += (omega - turned_B - self.residual) * weight;
        self.change += ((now.omega_BN_B - before.omega_BN_B).amax() - self.change) * weight;
        let settled = f64::from(self.compared) * self.weight >= 1.0;
        let biased = settled && self.residual.amax() > BIAS_MIN + UNSTEADY * self.change;
        self.health.gyro_bias = if biased { self.residual } else { Vector3::zeros() };
    }
}
