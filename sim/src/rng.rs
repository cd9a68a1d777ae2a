//! Seeded random streams: one seed gives independent streams for each use.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The generator that everything random draws from.
pub type Rng = ChaCha8Rng;

/// Stream of the initial state.
pub const INITIAL_STATE: u64 = 0;
/// Stream of the random catalogue.
pub const CATALOGUE: u64 = 1;
/// Stream of a planner that draws at random.
pub const PLANNER: u64 = 2;

/// Stream of the sensors' noise.
pub const SENSORS: u64 = 3;
/// Stream of the times at which requests come in flight.
pub const ARRIVALS: u64 = 4;

/// Stream `number` of a seed.
#[must_use]
pub fn stream(seed: u64, number: u64) -> Rng {
    let mut rng = Rng::seed_from_u64(seed);
    rng.set_stream(number);
    rng
}
