//! Episodes as learners fly them: digests of every observation, reward and duration, which the tests of the Python
//! package read too.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::EpisodeConfig;
use swath_sim::learn::hybrid::{Action, Episode, Progress};
use swath_sim::learn::observation::ObservationSet;
use swath_sim::vehicle::model::Model;

/// An episode and what came of it. The digest is FNV-1a over 32-bit words: features, action mask, reward and duration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Flown {
    seed: u64,
    observation: ObservationSet,
    strips: u32,
    arrivals: f64,
    resources: Option<Value>,
    orbits: f64,
    steps: usize,
    reward: f64,
    ended: String,
    digest: String,
}

/// Seed, observation, strips, arrivals, and whether there is a battery, which is nearly empty.
const EPISODES: [(u64, ObservationSet, u32, f64, bool); 5] = [
    (7, ObservationSet::Table1, 3000, 0.0, false),
    (8, ObservationSet::Dynamics, 400, 0.5, false),
    (u64::MAX, ObservationSet::Table1Momentum, 1500, 0.0, false),
    (0, ObservationSet::Table1, 3, 0.0, false),
    (9, ObservationSet::Resources, 2000, 0.0, true),
];

struct Digest(u64);

impl Digest {
    fn word(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3);
    }

    fn number(&mut self, number: f64) {
        self.word(number.to_bits() as u32);
        self.word((number.to_bits() >> 32) as u32);
    }

    fn seen(&mut self, episode: &Episode) -> usize {
        let shape = episode.shape();
        let (mut features, mut valid) = (vec![0.0; shape.len()], vec![false; shape.tokens]);
        episode.observe(&mut features, &mut valid).unwrap();
        features.iter().for_each(|feature| self.word(feature.to_bits()));
        valid.iter().for_each(|it| self.word(u32::from(*it)));
        valid.iter().filter(|it| **it).count()
    }
}

fn fly((seed, observation, strips, arrivals, battery): (u64, ObservationSet, u32, f64, bool)) -> Flown {
    let resources = battery.then(|| json!({ "profile": "minisat", "battery_initial": 0.05 }));
    let bounded = resources.clone().map(|it| serde_json::from_value(it).unwrap());
    let model = Model::new(SimConfig { resources: bounded, ..SimConfig::default() }).unwrap();
    let mut config = EpisodeConfig { orbits: 0.7, arrivals, ..EpisodeConfig::default() };
    config.scenario.count = [strips; 2];
    let orbits = config.orbits;
    let mut episode = Episode::new(Arc::new(model), config, observation);
    episode.begin(seed).unwrap();
    let (mut digest, mut steps, mut reward) = (Digest(0xcbf2_9ce4_8422_2325), 0, 0.0);
    let mut offered = digest.seen(&episode);
    loop {
        let action = Action { token: steps * 7 % offered, parameter: (steps * 3 % 11) as f64 / 10.0 };
        let outcome = episode.step(action).unwrap();
        offered = digest.seen(&episode);
        digest.number(outcome.reward);
        digest.number(outcome.duration_s);
        steps += 1;
        reward += outcome.reward;
        if outcome.progress != Progress::Continues {
            let ended = format!("{:?}", outcome.progress).to_lowercase();
            let digest = format!("{:016x}", digest.0);
            return Flown { seed, observation, strips, arrivals, resources, orbits, steps, reward, ended, digest };
        }
    }
}

#[test]
fn episodes_are_flown_as_ever_bit_by_bit() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/episodes.json");
    let flown: Vec<Flown> = EPISODES.into_iter().map(fly).collect();
    assert!(flown.iter().any(|it| it.ended == "terminated") && flown.iter().any(|it| it.ended == "truncated"));
    if std::env::var_os("SWATH_BLESS").is_some() {
        std::fs::write(path, serde_json::to_string_pretty(&flown).unwrap() + "\n").unwrap();
    }
    let kept: Vec<Flown> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    assert_eq!(flown, kept);
}
