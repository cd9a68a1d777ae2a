//! Planners compared on the same missions: what `evaluate` and `sweep` flew, as tables and as JSON.

use anyhow::Result;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use swath_sim::learn::statistics::ResourceScore;
use swath_sim::planner::PlannerSpec;
use swath_sim::vehicle::errors::PlantErrors;
use swath_training::TrainingError;
use swath_training::evaluate::{Mission, Spread, spread, spread_of};

use super::missions::{cell, percent, pooled_success, strips};

/// What `evaluate` flew.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    planners: Vec<PlannerSpec>,
    /// Whether plants were asked for by name.
    named: bool,
    pub plants: Vec<OnPlant>,
}

/// Missions on one plant, by planner, then by seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OnPlant {
    plant: String,
    errors: PlantErrors,
    pub flown: Vec<Vec<Mission>>,
}

impl OnPlant {
    /// Missions on a plant of a name.
    pub fn new(plant: String, errors: PlantErrors, flown: Vec<Vec<Mission>>) -> Self {
        Self { plant, errors, flown }
    }
}

impl Evaluation {
    /// An evaluation of these planners that has flown nothing; `named` when plants were asked for by name.
    pub fn new(planners: Vec<PlannerSpec>, named: bool) -> Self {
        Self { planners, named, plants: Vec::new() }
    }

    /// The table of a plant.
    pub fn table(&self, own: &OnPlant) -> String {
        let mut table = if self.named { format!("plant {}\n", own.plant) } else { String::new() };
        table += HEADING;
        let base = best_fixed(&self.planners, &own.flown);
        for (planner, missions) in self.planners.iter().zip(&own.flown) {
            table += &row(&planner.to_string(), missions, &own.flown[0], base);
        }
        table + &strips(&own.flown[0]) + &self.delivered(own)
    }

    /// A table of what came to the ground, where resources have bounds.
    fn delivered(&self, own: &OnPlant) -> String {
        let rows = self.planners.iter().zip(&own.flown).filter_map(|(planner, missions)| {
            let delivered = spread(missions, delivered_per_orbit)?;
            let base = own.flown.first().and_then(|first| spread(first, delivered_per_orbit));
            let count =
                |of: fn(&ResourceScore) -> u64| missions.iter().filter_map(|it| it.resources.as_ref()).map(of).sum();
            let (violations, failures): (u64, u64) = (count(|it| it.floor_violations), count(|it| it.failures));
            Some(format!(
                "{:<34} {:>15} {:>8} {:>9} {:>7} {violations:>10} {failures:>8}\n",
                planner.to_string(),
                cell(Some(delivered.mean), 3),
                cell(delivered.confidence_95, 3),
                percent(base.filter(|base| base.mean > 0.0).map(|base| delivered.mean / base.mean - 1.0)),
                cell(spread(missions, |it| it.resources.map(|it| it.strips_per_orbit)).map(|it| it.mean), 1),
            ))
        });
        let rows: String = rows.collect();
        if rows.is_empty() { rows } else { format!("\n{DELIVERED_HEADING}{rows}") }
    }

    /// Everything as JSON, after what every result begins with.
    pub fn whole(&self, mut head: Value) -> Value {
        let by_plant = self.plants.iter().map(|own| {
            let base = best_fixed(&self.planners, &own.flown);
            let results = self.planners.iter().zip(&own.flown);
            let entries: Vec<Value> =
                results.map(|(planner, missions)| entry(planner, missions, &own.flown[0], base)).collect();
            json!({ "plant": own.plant, "errors": own.errors, "planners": entries })
        });
        let mut by_plant: Vec<Value> = by_plant.collect();
        if self.named {
            head["plants"] = json!(by_plant);
        } else {
            head["planners"] = by_plant.first_mut().map_or(Value::Null, |own| own["planners"].take());
        }
        head
    }
}

/// Missions of the heuristic with the best fixed transition time, if one was flown.
fn best_fixed<'a>(planners: &[PlannerSpec], flown: &'a [Vec<Mission>]) -> Option<&'a [Mission]> {
    let fixed = planners.iter().zip(flown).filter(|(planner, _)| matches!(planner, PlannerSpec::Heuristic(_)));
    fixed.map(|(_, own)| own.as_slice()).max_by(|a, b| mean_reward(a).total_cmp(&mean_reward(b)))
}

/// Mean reward per orbit; every mission has one.
fn mean_reward(own: &[Mission]) -> f64 {
    spread(own, |it| Some(it.reward_per_orbit)).map_or(0.0, |reward| reward.mean)
}

/// What `sweep` flew: missions by transition time, then by seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    pub flown: Vec<Vec<Mission>>,
}

impl Sweep {
    fn times_s() -> impl Iterator<Item = f64> {
        (1..=12).map(|k| 10.0 * f64::from(k))
    }

    /// The planners that are swept.
    pub fn planners() -> Vec<PlannerSpec> {
        Self::times_s().map(PlannerSpec::Heuristic).collect()
    }

    /// The transition time that earns most [s].
    fn best_s(&self) -> Result<f64> {
        let rewarded = Self::times_s().zip(&self.flown).map(|(t, own)| (t, mean_reward(own)));
        let best = rewarded.filter(|(_, reward)| *reward > 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
        let none = || TrainingError::NoResult("no strip was imaged with any transition time".into());
        Ok(best.ok_or_else(none)?.0)
    }

    /// The table.
    ///
    /// # Errors
    /// When nothing was imaged.
    pub fn table(&self) -> Result<String> {
        let planners = Self::planners();
        let mut table = String::from(HEADING);
        for (planner, own) in planners.iter().zip(&self.flown) {
            table += &row(&planner.to_string(), own, &self.flown[0], best_fixed(&planners, &self.flown));
        }
        Ok(format!("{table}{}\nbest: T* = {} s\n", strips(&self.flown[0]), self.best_s()?))
    }

    /// Everything as JSON, after what every result begins with.
    ///
    /// # Errors
    /// When nothing was imaged.
    pub fn whole(&self, mut head: Value) -> Result<Value> {
        head["best_t_pre_s"] = json!(self.best_s()?);
        let entries = Self::times_s().zip(&self.flown).map(|(t_pre_s, own)| {
            let mut entry = summary(own);
            entry["t_pre_fixed_s"] = json!(t_pre_s);
            entry
        });
        head["sweep"] = entries.collect();
        Ok(head)
    }
}

const HEADING: &str = "\
planner                            reward/orbit   ± 95 %  deviation  of first    of T*  success  attempts  imaged  T_pre s  T_acq s  priority\n";

const DELIVERED_HEADING: &str = "\
planner                            delivered/orbit   ± 95 %  of first  strips  violations failures\n";

/// Priority on the ground per orbit, where resources have bounds.
fn delivered_per_orbit(mission: &Mission) -> Option<f64> {
    mission.resources.map(|it| it.delivered_per_orbit)
}

fn row(name: &str, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> String {
    let reward = spread(own, |it| Some(it.reward_per_orbit));
    let mean = |quantity: fn(&Mission) -> Option<f64>| spread(own, quantity).map(|it| it.mean);
    format!(
        "{name:<34} {:>12} {:>8} {:>10} {:>9} {:>8} {:>8} {:>9} {:>7} {:>8} {:>8} {:>9}\n",
        cell(reward.map(|it| it.mean), 3),
        cell(reward.and_then(|it| it.confidence_95), 3),
        cell(reward.and_then(|it| it.deviation), 3),
        percent(gain(own, first).map(|it| it.mean)),
        percent(best_fixed.and_then(|base| gain(own, base)).map(|it| it.mean)),
        percent(pooled_success(own)),
        cell(mean(|it| Some(it.attempts_per_orbit)), 1),
        cell(mean(|it| Some(it.imaged_per_orbit)), 1),
        cell(mean(|it| it.t_pre_s), 1),
        cell(mean(|it| it.t_acq_s), 1),
        cell(mean(|it| it.priority), 3),
    )
}

/// Relative gain of the mean reward over another planner, with the spread of the paired differences; `None` over one
/// that earns nothing.
fn gain(own: &[Mission], other: &[Mission]) -> Option<Spread> {
    let base = mean_reward(other);
    let pairs = own.iter().zip(other);
    let differences: Vec<f64> =
        pairs.map(|(own, other)| (own.reward_per_orbit - other.reward_per_orbit) / base).collect();
    spread_of(&differences).filter(|_| base > 0.0)
}

fn entry(planner: &PlannerSpec, own: &[Mission], first: &[Mission], best_fixed: Option<&[Mission]>) -> Value {
    let mut entry = summary(own);
    entry["planner"] = json!(planner.to_string());
    entry["gain_over_first"] = json!(gain(own, first));
    entry["gain_over_best_fixed"] = json!(best_fixed.and_then(|base| gain(own, base)));
    entry["by_density"] = json!(by_density(own));
    entry["missions"] = json!(own);
    entry
}

fn summary(own: &[Mission]) -> Value {
    let of = |quantity: fn(&Mission) -> Option<f64>| json!(spread(own, quantity));
    let mut summary = json!({
        "success_rate": pooled_success(own),
        "requests": of(|it| Some(it.requests as f64)),
        "reachable": of(|it| Some(it.reachable as f64)),
        "reward_per_orbit": of(|it| Some(it.reward_per_orbit)),
        "attempts_per_orbit": of(|it| Some(it.attempts_per_orbit)),
        "imaged_per_orbit": of(|it| Some(it.imaged_per_orbit)),
        "t_pre_s": of(|it| it.t_pre_s),
        "t_acq_s": of(|it| it.t_acq_s),
        "priority": of(|it| it.priority),
        "wait_s_per_orbit": of(|it| Some(it.wait_s_per_orbit)),
        "failed_attitude": of(|it| it.failed_attitude),
        "failed_elevation": of(|it| it.failed_elevation),
    });
    if own.iter().any(|it| it.resources.is_some()) {
        let count =
            |of: fn(&ResourceScore) -> u64| own.iter().filter_map(|it| it.resources.as_ref()).map(of).sum::<u64>();
        summary["resources"] = json!({
            "delivered_per_orbit": of(delivered_per_orbit),
            "strips_per_orbit": of(|it| it.resources.map(|it| it.strips_per_orbit)),
            "floor_violations": count(|it| it.floor_violations),
            "failures": count(|it| it.failures),
        });
    }
    summary
}

/// Summaries of missions grouped by thousands of strips asked for.
fn by_density(own: &[Mission]) -> Vec<Value> {
    let mut groups: std::collections::BTreeMap<usize, Vec<Mission>> = Default::default();
    for mission in own {
        groups.entry(mission.requests / 1000 * 1000).or_default().push(*mission);
    }
    let summarised = groups.iter().map(|(least, missions)| {
        let mut entry = summary(missions);
        entry["requests"] = json!([least, least + 999]);
        entry["missions"] = json!(missions.len());
        entry
    });
    summarised.collect()
}
