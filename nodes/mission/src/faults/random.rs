//! Faults drawn from a seed: those that a mission in one process can fly.

use rand::RngExt;
use swath_sim::rng;
use swath_sim::rng::Rng;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::faults::{Fault, WheelFault};

use super::grammar::{Failure, PlannedFault, Process, What};

/// Longest fault that is drawn [s].
const LONGEST_S: f64 = 120.0;

/// Share of the faults that are the radio's, where there is one.
const OF_RADIO: f64 = 0.4;

/// Faults of a mission of this length; some may contradict others.
#[must_use]
pub fn draw(seed: u64, count: u32, radio: bool, horizon: Tick, period: TickPeriod) -> Vec<PlannedFault> {
    let mut rng = rng::stream(seed, rng::FAULTS);
    let end_s = period.time_s(horizon);
    (0..count).map(|_| fault(&mut rng, radio, end_s)).collect()
}

fn fault(rng: &mut Rng, radio: bool, end_s: f64) -> PlannedFault {
    let of_radio = radio && rng.random_bool(OF_RADIO);
    let what = if of_radio { of_the_radio(rng) } else { what(rng) };
    let at_s = tenths(rng.random_range(0.02..0.9) * end_s);
    let lasts = tenths(rng.random_range(1.0..LONGEST_S));
    // Half of the wheels' faults stay; so do none of the others, so that what comes after them is seen too.
    let stays = matches!(what, What::Vehicle(Fault::Wheel(..))) && rng.random_bool(0.5);
    let at_once = match what {
        What::Process(process, _) if process.is_of_radio() => true,
        What::Process(..) => rng.random_bool(0.5),
        _ => false,
    };
    PlannedFault { what, at_s: Some(at_s), for_s: (!stays && !at_once).then_some(lasts) }
}

fn what(rng: &mut Rng) -> What {
    let process = Process::IN_PROCESS[rng.random_range(0..Process::IN_PROCESS.len())];
    let wheel = rng.random_range(0..3);
    let percent = f64::from(rng.random_range(5..=95u32)) / 100.0;
    let dropped = f64::from(rng.random_range(5..=30u32)) / 100.0;
    match rng.random_range(0..13u32) {
        0..3 => What::Process(process, Failure::Kill),
        3..5 => What::Process(process, Failure::Hang),
        5 => What::Vehicle(Fault::Wheel(wheel, WheelFault::Dead)),
        6 => What::Vehicle(Fault::Wheel(wheel, WheelFault::Stuck)),
        7 => What::Vehicle(Fault::Wheel(wheel, WheelFault::Weak(percent))),
        8 => What::Drop(dropped),
        9 => What::StoreFull,
        10 => What::BagFull,
        11 => What::Vehicle(Fault::GyroBias((f64::from(rng.random_range(5..=100u32)) / 1000.0).to_radians())),
        _ => What::Vehicle(Fault::StarTrackerOut),
    }
}

fn of_the_radio(rng: &mut Rng) -> What {
    let process = if rng.random_bool(0.5) { Process::Link } else { Process::Catalogue };
    let failure = if rng.random_bool(0.7) { Failure::Kill } else { Failure::Hang };
    let lost = f64::from(rng.random_range(5..=95u32)) / 100.0;
    if rng.random_bool(0.5) { What::FramesLost(lost) } else { What::Process(process, failure) }
}

fn tenths(seconds: f64) -> f64 {
    (seconds * 10.0).round() / 10.0
}
