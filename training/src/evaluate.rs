//! Missions flown by planners on the same seeds, and statistics of what came out.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::Planner;
use swath_sim::task::Totals;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::model::Model;

use crate::error::{Result, TrainingError};
use crate::planners::Prepared;

pub use swath_sim::learn::statistics::Score as Mission;

/// Which missions to fly.
#[derive(Debug, Clone, PartialEq)]
pub struct Missions {
    /// The satellite.
    pub simulation: SimConfig,
    /// Length and requests.
    pub episode: EpisodeConfig,
    /// How the satellite flown differs from the one that planners believe in.
    pub plant: PlantErrors,
    /// Seed of the first mission; the others follow it.
    pub first_seed: u64,
    /// How many.
    pub count: u64,
    /// The share of them that is flown here; all without.
    pub shard: Option<Shard>,
}

/// A share of missions: of every `of` that follow each other the one with this number, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Shard {
    number: u64,
    of: u64,
}

impl Shard {
    /// Its number, from 1.
    #[must_use]
    pub fn number(self) -> u64 {
        self.number
    }

    /// How many shares there are.
    #[must_use]
    pub fn of(self) -> u64 {
        self.of
    }

    /// How many of `count` missions are its own.
    fn count(self, count: u64) -> u64 {
        count / self.of + u64::from(self.number <= count % self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let parts = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match parts {
            Some((number, of)) if (1..=of).contains(&number) => Ok(Self { number, of }),
            _ => Err(format!("`{text}` is no share: expected I/N with I from 1 to N, such as 2/8")),
        }
    }
}

impl TryFrom<String> for Shard {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse()
    }
}

impl From<Shard> for String {
    fn from(shard: Shard) -> Self {
        shard.to_string()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// A mean over missions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation over missions; one mission has none.
    pub deviation: Option<f64>,
    /// Half the width of the mean's 95 % confidence interval; one mission has none.
    pub confidence_95: Option<f64>,
}

impl Missions {
    /// The seeds of the missions that are flown here.
    ///
    /// # Errors
    /// No mission, seeds that run beyond the greatest one, or a share without a mission.
    pub fn seeds(&self) -> Result<impl IndexedParallelIterator<Item = u64> + use<>> {
        let refused = |value: u64, limit: String| TrainingError::Setting {
            key: "seed of the first mission".into(),
            value: value.to_string(),
            limit,
        };
        let after =
            self.count.checked_sub(1).ok_or_else(|| TrainingError::NoResult("no mission is asked for".into()))?;
        if self.first_seed.checked_add(after).is_none() {
            let limit =
                format!("at most {}: the seeds of all {} missions follow each other", u64::MAX - after, self.count);
            return Err(refused(self.first_seed, limit));
        }
        let first = self.first_seed;
        let whole = Shard { number: 1, of: 1 };
        let shard = self.shard.unwrap_or(whole);
        let own = shard.count(self.count);
        if own == 0 {
            let none = format!("shard {shard} has no mission: there are only {} of them", self.count);
            return Err(TrainingError::NoResult(none));
        }
        let own = usize::try_from(own).map_err(|_| refused(self.count, "a number of missions".into()))?;
        Ok((0..own).into_par_iter().map(move |index| first + index as u64 * shard.of + (shard.number - 1)))
    }

    /// How many missions are flown here.
    #[must_use]
    pub fn own(&self) -> u64 {
        self.shard.map_or(self.count, |shard| shard.count(self.count))
    }
}

/// Flies every mission with every planner; results are by planner, then by seed. `each` is called after every mission.
///
/// ```
/// use swath_sim::learn::episode::EpisodeConfig;
/// use swath_training::evaluate::{Missions, fly, spread};
/// use swath_training::planners::Prepared;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let missions = Missions {
///     simulation: Default::default(),
///     episode: EpisodeConfig { orbits: 0.5, ..EpisodeConfig::evaluation() },
///     plant: Default::default(),
///     first_seed: 7,
///     count: 2,
///     shard: None,
/// };
/// let planners = [Prepared::new(&"heuristic:80".parse()?)?, Prepared::new(&"hop-ppo".parse()?)?];
/// let flown = fly(&missions, &planners, || {})?;
/// let reward = |planner: usize| spread(&flown[planner], |mission| Some(mission.reward_per_orbit));
/// assert!(reward(0).zip(reward(1)).is_some_and(|(fixed, learned)| learned.mean > fixed.mean));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// A planner that fails; settings out of range; missions in which no planner attempts anything.
pub fn fly(missions: &Missions, planners: &[Prepared], each: impl Fn() + Sync) -> Result<Vec<Vec<Mission>>> {
    missions.episode.validate()?;
    let model = Arc::new(Model::new(missions.simulation.clone())?);
    let by_seed: Vec<Vec<Mission>> = missions
        .seeds()?
        .map(|seed| {
            // One catalogue serves all planners: its windows take longer than flying.
            let mut env = Env::episode(model.clone(), &missions.episode, seed);
            env.differ(&missions.plant, seed)?;
            let flown = planners.iter().map(|planner| {
                let mut planner = planner.make(seed)?;
                mission(env.clone(), planner.as_mut(), &missions.episode, seed)
            });
            let flown = flown.collect::<Result<Vec<Mission>>>();
            each();
            flown
        })
        .collect::<Result<_>>()?;
    if missions.shard.is_none() {
        attempted(by_seed.iter().flatten())?;
    }
    let of = |index: usize| by_seed.iter().map(|row| row[index]).collect();
    Ok((0..planners.len()).map(of).collect())
}

/// Refuses missions that tell nothing because nothing was attempted in any of them.
///
/// # Errors
/// [`TrainingError::NoResult`].
pub fn attempted<'a>(missions: impl Iterator<Item = &'a Mission> + Clone) -> Result<()> {
    if missions.clone().any(|it| it.attempts_per_orbit > 0.0) {
        return Ok(());
    }
    let most = |quantity: fn(&Mission) -> usize| missions.clone().map(quantity).max().unwrap_or(0);
    let (requests, reachable) = (most(|it| it.requests), most(|it| it.reachable));
    Err(TrainingError::NoResult(format!(
        "nothing was attempted in any mission: at most {requests} strips were asked for and {reachable} reachable"
    )))
}

/// Flies one mission of a seed to its end and adds up.
///
/// # Errors
/// When the planner fails.
pub fn mission(mut env: Env, planner: &mut dyn Planner, episode: &EpisodeConfig, seed: u64) -> Result<Mission> {
    let mut totals = Totals::default();
    env.run(planner, |record| totals.add(record)).map_err(TrainingError::environment)?;
    Ok(Mission::of(&env, &totals, episode.orbits, seed, episode.scenario.count_of(seed)))
}

/// Mean, deviation and confidence of a quantity over the missions that have it; `None` when none has.
pub fn spread(missions: &[Mission], quantity: impl Fn(&Mission) -> Option<f64>) -> Option<Spread> {
    let values: Vec<f64> = missions.iter().filter_map(quantity).collect();
    spread_of(&values)
}

/// Mean, deviation and confidence of numbers; `None` of no numbers.
///
/// ```
/// use swath_training::evaluate::spread_of;
///
/// let rewards = spread_of(&[24.0, 26.0, 28.0]).expect("there are numbers");
/// assert_eq!((rewards.mean, rewards.deviation), (26.0, Some(2.0)));
/// assert_eq!(spread_of(&[26.0]).and_then(|one| one.confidence_95), None);
/// assert_eq!(spread_of(&[]), None);
/// ```
#[must_use]
pub fn spread_of(values: &[f64]) -> Option<Spread> {
    if values.is_empty() {
        return None;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let deviation = (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt());
    let confidence_95 = deviation.map(|deviation| student_975(count - 1.0) * deviation / count.sqrt());
    Some(Spread { mean, deviation, confidence_95 })
}

/// The 97.5 % quantile of Student's t with at least one degree of freedom, by the expansion of Abramowitz & Stegun 26.7.5.
fn student_975(freedom: f64) -> f64 {
    let x: f64 = 1.959_963_984_540_054;
    let g1 = (x.powi(3) + x) / 4.0;
    let g2 = (5.0 * x.powi(5) + 16.0 * x.powi(3) + 3.0 * x) / 96.0;
    let g3 = (3.0 * x.powi(7) + 19.0 * x.powi(5) + 17.0 * x.powi(3) - 15.0 * x) / 384.0;
    x + g1 / freedom + g2 / freedom.powi(2) + g3 / freedom.powi(3)
}

#[cfg(test)]
mod tests {
    use approx::{assert_abs_diff_eq, assert_relative_eq};
    use swath_sim::planner::PlannerSpec;

    use super::*;

    #[test]
    fn spreads_follow_student() {
        let found = spread_of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]).unwrap();
        assert_relative_eq!(found.mean, 6.0);
        assert_relative_eq!(found.deviation.unwrap(), 11.0f64.sqrt(), epsilon = 1e-12);
        // t(0.975, 10) = 2.2281
        assert_abs_diff_eq!(found.confidence_95.unwrap(), 2.2281, epsilon = 2e-3);
    }

    fn missions(strips: u32, first_seed: u64, count: u64) -> Missions {
        let mut episode = EpisodeConfig { orbits: 1.0, ..EpisodeConfig::default() };
        episode.scenario.count = [strips; 2];
        Missions {
            simulation: SimConfig::default(),
            episode,
            plant: PlantErrors::default(),
            first_seed,
            count,
            shard: None,
        }
    }

    fn heuristic() -> [Prepared; 1] {
        [Prepared::new(&PlannerSpec::Heuristic(90.0)).unwrap()]
    }

    #[test]
    fn shards_share_the_seeds_out_and_leave_none() {
        for (count, of) in [(10, 3), (10, 1), (7, 7), (100, 8)] {
            let of_shard = |number: u64| {
                let shard = Some(format!("{number}/{of}").parse().unwrap());
                let missions = Missions { shard, ..missions(50, 5, count) };
                let seeds: Vec<u64> = missions.seeds().unwrap().collect();
                assert_eq!(seeds.len() as u64, missions.own());
                seeds
            };
            let mut all: Vec<u64> = (1..=of).flat_map(of_shard).collect();
            all.sort_unstable();
            assert_eq!(all, (5..5 + count).collect::<Vec<u64>>());
        }
        for text in ["5/4", "0/4", "1/0", "1", "a/b", "-1/2", "1/2/3"] {
            assert!(text.parse::<Shard>().unwrap_err().contains("expected I/N"), "{text}");
        }
        let empty = Missions { shard: Some("3/4".parse().unwrap()), ..missions(50, 0, 2) };
        let error = empty.seeds().map(|_| ()).unwrap_err().to_string();
        assert!(error.ends_with("shard 3/4 has no mission: there are only 2 of them"), "{error}");
    }

    #[test]
    fn seeds_that_run_over_are_refused_and_the_last_one_is_flown() {
        let error = fly(&missions(50, u64::MAX - 1, 3), &heuristic(), || {}).unwrap_err().to_string();
        assert!(error.contains("18446744073709551614, which is not at most 18446744073709551613"), "{error}");
        let flown = fly(&missions(200, u64::MAX, 1), &heuristic(), || {}).unwrap();
        assert_eq!(flown[0][0].seed, u64::MAX);
        assert!(matches!(missions(50, 0, 0).seeds().map(|_| ()), Err(TrainingError::NoResult(_))));
    }

    #[test]
    fn nothing_attempted_is_no_result_and_what_is_unknown_is_not_a_number() {
        let error = fly(&missions(0, 0, 2), &heuristic(), || {}).unwrap_err().to_string();
        let wanted = "there is no result: nothing was attempted in any mission: \
                      at most 0 strips were asked for and 0 reachable";
        assert_eq!(error, wanted);
        let flown = fly(&missions(4, 0, 12), &heuristic(), || {}).unwrap().remove(0);
        let idle = flown.iter().find(|it| it.attempts_per_orbit == 0.0).unwrap();
        assert_eq!((idle.success_rate, idle.t_pre_s, idle.priority), (None, None, None));
        assert_eq!(spread(&flown, |it| it.t_pre_s).unwrap().mean, 90.0, "over those that attempted something");
        assert!(flown.iter().all(|it| it.requests == 4 && it.reachable <= 4));
        assert!(flown.iter().any(|it| it.reachable < 4));
    }
}
