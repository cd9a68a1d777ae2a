//! Missions that fly with company and without: what company costs them, and whether it changes their tasks.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use super::flight::Flight;

/// Name, orbits and pace of a kind of mission.
pub type Kind = (&'static str, &'static str, &'static str);

/// A mission of one kind and seed, to be flown several times.
pub struct Pairing<'a> {
    domain: u16,
    name: String,
    folder: &'a Path,
    words: Vec<String>,
    expected: String,
    differ: u64,
    shares: BTreeMap<String, Vec<f64>>,
}

impl Pairing<'_> {
    /// Launches it once more, under a name.
    pub fn launch(&self, name: &str) -> Result<Flight> {
        let words: Vec<&str> = self.words.iter().map(String::as_str).collect();
        let out = self.folder.join(format!("{}-{name}", self.name));
        Flight::launch(&self.folder.join("mission.toml"), &out, self.domain, &words)
    }

    /// Notes how a flight ended; its speed [times real time].
    pub fn land(&mut self, name: &str, mut flight: Flight) -> Result<f64> {
        let (well, summary, tasks) = flight.end()?;
        ensure!(well, "the mission failed: {}", flight.said());
        self.differ += u64::from(tasks != self.expected);
        eprintln!("{}, {name}: {:.0} times real time", self.name, summary.real_time_factor);
        Ok(summary.real_time_factor)
    }

    /// Notes which share of the speed without company is left with it.
    pub fn share(&mut self, name: &str, share: f64) {
        self.shares.entry(format!("{name}_share")).or_default().push(share);
    }
}

/// Flies missions of each seed and kind, in one process first; `fly` flies them with company and without. Every share, by
/// kind and name, and how many missions had other tasks than in one process.
pub fn measure(
    seeds: Range<u64>,
    (mission, kinds, domain): (&str, &[Kind], u16),
    mut fly: impl FnMut(&mut Pairing<'_>) -> Result<()>,
) -> Result<Value> {
    let folder = tempfile::tempdir()?;
    std::fs::write(folder.path().join("mission.toml"), mission)?;
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut differ = 0;
    for seed in seeds {
        for (kind, orbits, pace) in kinds {
            let seed = seed.to_string();
            let words = ["--seed", &seed, "--orbits", orbits, "--pace", pace, "--no-bag"].map(str::to_owned);
            let mut pairing = Pairing {
                domain,
                name: format!("{kind}-{seed}"),
                folder: folder.path(),
                words: words.iter().cloned().chain(["--in-process".to_owned()]).collect(),
                expected: String::new(),
                differ: 0,
                shares: BTreeMap::new(),
            };
            pairing.expected = pairing.launch("in-process")?.end()?.2;
            pairing.words = words.to_vec();
            fly(&mut pairing)?;
            differ += pairing.differ;
            for (name, shares) in pairing.shares {
                all.entry(format!("{kind}_{name}")).or_default().extend(shares);
            }
        }
    }
    let mut result = json!(all);
    result["missions_with_other_tasks"] = differ.into();
    Ok(result)
}
