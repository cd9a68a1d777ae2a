//! Ground plans and their bounds: what `ground-plan` found, as tables and as JSON.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use swath_sim::vehicle::errors::PlantErrors;
use swath_training::evaluate::{Mission, Spread, spread, spread_of};
use swath_training::ground::Bracket;

use super::missions::{cell, percent, pooled_success, strips};

/// What `ground-plan` found, by seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plans {
    pub width: u64,
    pub branches: u64,
    pub weakness: f64,
    pub plants: Vec<(String, PlantErrors)>,
    pub brackets: Vec<Bracket>,
}

impl Plans {
    fn spread(&self, of: fn(&Bracket) -> f64) -> Option<Spread> {
        spread_of(&self.brackets.iter().map(of).collect::<Vec<f64>>())
    }

    fn best_known(&self) -> Option<Spread> {
        self.spread(|it| it.best_known)
    }

    fn upper_bound(&self) -> Option<Spread> {
        self.spread(|it| it.upper_bound)
    }

    fn flown(&self) -> Vec<Flown> {
        let of_plant = |(number, (plant, errors)): (usize, &(String, PlantErrors))| {
            let missions: Vec<Mission> = self.brackets.iter().map(|it| it.flown[number]).collect();
            let reward_per_orbit = spread(&missions, |it| Some(it.reward_per_orbit));
            let (plant, errors) = (plant.clone(), errors.clone());
            Flown { plant, errors, reward_per_orbit, success_rate: pooled_success(&missions), missions }
        };
        self.plants.iter().enumerate().map(of_plant).collect()
    }

    /// The table.
    pub fn table(&self) -> String {
        table(self.upper_bound(), self.best_known(), &self.flown())
    }

    /// Everything as JSON, after what every result begins with.
    pub fn whole(&self, mut head: Value) -> Value {
        let each = self.brackets.iter().map(|it| {
            json!({ "seed": it.seed, "best_known": it.best_known, "upper_bound": it.upper_bound, "ticks": it.ticks })
        });
        for (key, value) in [
            ("width", json!(self.width)),
            ("branches", json!(self.branches)),
            ("weakness", json!(self.weakness)),
            ("best_known", json!(self.best_known())),
            ("upper_bound", json!(self.upper_bound())),
            ("brackets", each.collect()),
            ("flown_blindly", json!(self.flown())),
        ] {
            head[key] = value;
        }
        head
    }
}

/// The plans as they were flown on one plant.
#[derive(Serialize)]
struct Flown {
    plant: String,
    errors: PlantErrors,
    reward_per_orbit: Option<Spread>,
    success_rate: Option<f64>,
    missions: Vec<Mission>,
}

fn table(bound: Option<Spread>, known: Option<Spread>, flown: &[Flown]) -> String {
    let rewards = |name: &str, reward: Option<Spread>| {
        let (mean, confidence) = (reward.map(|it| it.mean), reward.and_then(|it| it.confidence_95));
        format!("{name:<34} {:>12} {:>8}", cell(mean, 3), cell(confidence, 3))
    };
    let mut table = format!(
        "                                   reward/orbit   ± 95 %\n{}\n{}\n\n\
         plan flown blindly                 reward/orbit   ± 95 %  success\n",
        rewards("no plan exceeds", bound),
        rewards("best plan found", known),
    );
    for it in flown {
        table += &format!("{} {:>8}\n", rewards(&it.plant, it.reward_per_orbit), percent(it.success_rate));
    }
    table + &flown.first().map_or_else(String::new, |it| strips(&it.missions))
}
