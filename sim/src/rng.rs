//! Seeded random streams: one seed gives independent streams for each use.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The generator that everything random draws from.
pub type Rng = ChaCha8Rng;

/// Stream of the initial state.
pub const INITIAL_STATE: u64 = 0;
/// Stream of the random catalogue.
pub const CATALOGUE: u64 = 1;
/// Stream of the sensors' noise.
pub const SENSORS: u64 = 3;
/// Stream of the times at which requests come in flight.
pub const ARRIVALS: u64 = 4;
/// Stream of the faults that a mission leaves to its seed.
pub const FAULTS: u64 = 5;

/// First of the streams of a planner that draws at random, one for each task; other streams lie below it, but for those
/// of the radio.
const PLANNER: u64 = 1 << 32;
/// First of the streams of the radio, two for each tick.
const RADIO: u64 = 1 << 62;

/// Stream of a planner that draws at random, for a task.
#[must_use]
pub fn planner(seed: u64, task: u64) -> Rng {
    stream(seed, PLANNER.saturating_add(task))
}

/// Stream of the frames that are lost on their way up, or down, of those sent at a tick.
#[must_use]
pub fn radio(seed: u64, tick: u64, up: bool) -> Rng {
    stream(seed, RADIO.saturating_add(tick.saturating_mul(2)).saturating_add(u64::from(up)))
}

/// Stream `number` of a seed.
#[must_use]
pub fn stream(seed: u64, number: u64) -> Rng {
    let mut rng = Rng::seed_from_u64(seed);
    rng.set_stream(number);
    rng
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;

    #[test]
    fn no_task_of_a_planner_draws_what_something_else_draws() {
        let first = |mut rng: Rng| rng.random::<u64>();
        let fixed = [INITIAL_STATE, CATALOGUE, SENSORS, ARRIVALS, FAULTS].map(|number| first(stream(7, number)));
        for task in 0..100 {
            assert!(!fixed.contains(&first(planner(7, task))), "task {task}");
        }
        let radio: Vec<u64> = (0..200).map(|it| first(radio(7, it / 2, it % 2 == 1))).collect();
        let mut others: Vec<u64> = (0..100).map(|task| first(planner(7, task))).chain(fixed).chain(radio).collect();
        others.sort_unstable();
        assert!(others.windows(2).all(|two| two[0] != two[1]), "two uses draw the same");
    }
}
