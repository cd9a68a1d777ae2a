//! Campaigns in parts: each a share of the missions, flown wherever there is room, and `swath-train merge`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use swath_training::evaluate::{Mission, Shard, attempted};

use super::comparison::{Evaluation, Sweep};
use super::output::{JsonTarget, print};
use super::plans::Plans;

/// Options of `swath-train merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The parts that `evaluate`, `sweep` or `ground-plan` wrote with --shard, in any order
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// Write everything, every mission included, to this file (- for standard output)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// A share of a campaign as it is kept in a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    shard: Shard,
    /// What every result of the whole campaign begins with.
    head: Value,
    #[serde(flatten)]
    campaign: Campaign,
}

/// What was flown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Campaign {
    /// By `evaluate`.
    Evaluate(Evaluation),
    /// By `sweep`.
    Sweep(Sweep),
    /// By `ground-plan`.
    GroundPlan(Plans),
}

impl Part {
    /// A share of a campaign.
    pub fn new(shard: Shard, head: Value, campaign: Campaign) -> Self {
        Self { shard, head, campaign }
    }

    /// Writes the part.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, json: &JsonTarget) -> Result<()> {
        json.write(&json!(self))
    }

    fn read(path: &Path) -> Result<Self> {
        let text = fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("{} is no part of a campaign", path.display()))
    }

    /// All that must be the same in every part.
    fn settings(&self) -> Value {
        let mut campaign = self.campaign.clone();
        campaign.forget_missions();
        json!({ "shards": self.shard.of(), "campaign": campaign, "head": self.head })
    }
}

impl Campaign {
    /// Every list of missions, by planner and plant.
    fn lists(&mut self) -> Vec<&mut Vec<Mission>> {
        match self {
            Self::Evaluate(found) => found.plants.iter_mut().flat_map(|plant| &mut plant.flown).collect(),
            Self::Sweep(found) => found.flown.iter_mut().collect(),
            Self::GroundPlan(_) => Vec::new(),
        }
    }

    /// Removes the missions, which is what parts differ in.
    fn forget_missions(&mut self) {
        self.lists().into_iter().for_each(Vec::clear);
        if let Self::GroundPlan(found) = self {
            found.brackets.clear();
        }
    }

    /// Adds the missions of another part of the same campaign.
    fn add(&mut self, mut other: Self) {
        if let (Self::GroundPlan(own), Self::GroundPlan(more)) = (&mut *self, &mut other) {
            own.brackets.append(&mut more.brackets);
        }
        for (own, more) in self.lists().into_iter().zip(other.lists()) {
            own.append(more);
        }
    }

    /// Puts all missions in the order of their seeds, and says which seeds each list has.
    fn sort(&mut self) -> Vec<Vec<u64>> {
        let mut seeds: Vec<Vec<u64>> = Vec::new();
        for own in self.lists() {
            own.sort_by_key(|mission| mission.seed);
            seeds.push(own.iter().map(|mission| mission.seed).collect());
        }
        if let Self::GroundPlan(found) = self {
            found.brackets.sort_by_key(|it| it.seed);
            seeds.push(found.brackets.iter().map(|it| it.seed).collect());
        }
        seeds
    }

    /// The tables and the whole result, as if all had been flown here.
    fn report(&self, head: Value) -> Result<(String, Value)> {
        Ok(match self {
            Self::Evaluate(found) => {
                for plant in &found.plants {
                    attempted(plant.flown.iter().flatten())?;
                }
                (found.plants.iter().map(|plant| found.table(plant)).collect(), found.whole(head))
            }
            Self::Sweep(found) => (found.table()?, found.whole(head)?),
            Self::GroundPlan(found) => {
                attempted(found.brackets.iter().flat_map(|it| &it.flown))?;
                (found.table(), found.whole(head))
            }
        })
    }
}

/// Runs `merge`: the result is that of the campaign in one piece, byte by byte.
pub fn merge(args: &MergeArgs) -> Result<()> {
    let json = JsonTarget::new(args.json.as_deref())?;
    let parts = args.parts.iter().map(|path| Ok((path.as_path(), Part::read(path)?))).collect::<Result<Vec<_>>>()?;
    let (head, mut campaign) = join(parts)?;
    let seeds = campaign.sort();
    let number = |key: &str| head["missions"][key].as_u64().with_context(|| format!("the parts do not say {key}"));
    let (first, count) = (number("first_seed")?, number("episodes")?);
    if seeds.iter().any(|own| !own.iter().copied().eq((0..count).map(|index| first + index))) {
        bail!("the parts do not hold the missions of all seeds from {first}, {count} of them, once each");
    }
    let (tables, whole) = campaign.report(head)?;
    if json.leaves_stdout() {
        print(&tables)?;
    }
    json.write(&whole)
}

/// All parts in one; none may be missing, there twice, or of another campaign.
fn join(parts: Vec<(&Path, Part)>) -> Result<(Value, Campaign)> {
    let mut files: BTreeMap<Shard, &Path> = BTreeMap::new();
    let mut joined: Option<(Value, &Path, Value, Campaign)> = None;
    for (path, part) in parts {
        let settings = part.settings();
        if let Some(before) = files.insert(part.shard, path) {
            bail!("shard {} is there twice: {} and {}", part.shard, before.display(), path.display());
        }
        match &mut joined {
            None => joined = Some((settings, path, part.head, part.campaign)),
            Some((wanted, first, _, campaign)) => {
                if let Some((key, here, there)) = difference(wanted, &settings, String::new()) {
                    let (path, first) = (path.display(), first.display());
                    bail!("{path} is of another campaign: {key} is {there} there and {here} in {first}");
                }
                campaign.add(part.campaign);
            }
        }
    }
    let Some((_, _, head, campaign)) = joined else { bail!("no part is given") };
    let found: BTreeSet<u64> = files.keys().map(|shard| shard.number()).collect();
    let of = files.keys().next().map_or(0, |shard| shard.of());
    let missing: Vec<String> = (1..=of).filter(|it| !found.contains(it)).map(|it| format!("{it}/{of}")).collect();
    if !missing.is_empty() {
        bail!("{} of {of} shards are missing: {}", missing.len(), missing.join(", "));
    }
    Ok((head, campaign))
}

/// The first key whose values differ, and both values.
fn difference(one: &Value, other: &Value, key: String) -> Option<(String, Value, Value)> {
    if one == other {
        return None;
    }
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    if let (Value::Object(a), Value::Object(b)) = (one, other) {
        let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
        return names.into_iter().find_map(|name| {
            let of = |table: &serde_json::Map<String, Value>| table.get(name).cloned().unwrap_or(Value::Null);
            difference(&of(a), &of(b), below(name))
        });
    }
    Some((key, one.clone(), other.clone()))
}
