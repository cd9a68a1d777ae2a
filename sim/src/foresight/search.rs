//! The search for a plan: a beam that goes through the whole mission.

use std::collections::{BTreeMap, BTreeSet};

use super::passes::Passes;
use super::plan::{Plan, PlannedTask};
use crate::learn::episode::Env;
use crate::planner::{Allowance, Search};
use crate::requests::catalogue::Candidate;
use crate::vehicle::flight::Situation;
use crate::vehicle::model::Model;
use crate::vehicle::mrp;
use crate::world::frames::reference_dcm;
use crate::world::orbit::Orbit;
use crate::world::strip::StripId;
use crate::world::turn::Turn;

/// How hard to search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundSettings {
    /// Beginnings of plans that are kept for each [`BUCKET_S`] of the mission.
    pub width: usize,
    /// Strips that each is continued with.
    pub branches: usize,
    /// Margin against errors of the model: share of the wheels' torque limit that is not counted on.
    pub weakness: f64,
}

impl Default for GroundSettings {
    fn default() -> Self {
        Self { width: 4, branches: 8, weakness: 0.0 }
    }
}

/// Beginnings of plans are compared that end within this time of each other [s].
pub const BUCKET_S: f64 = 10.0;
/// Beginnings with the same last strip that are kept in a bucket.
const ALIKE: usize = 2;
/// Time over which the first guess of the reward rate is believed [s].
const PRIOR_S: f64 = 1000.0;
/// First guess of the reward rate: a strip of middling priority each 200 s [1/s].
const PRIOR_RATE: f64 = 0.5 / 200.0;

/// Seeks a plan for the rest of an episode, whose whole catalogue it knows, by flying it in the head with the model.
///
/// A beam goes through the mission: of the beginnings of plans that end at about the same time, those are kept that have
/// the most reward, less what their later end costs at the average rate. The result is a function of the arguments; the
/// wider the beam, the better the plan, at a time in proportion. (Taking parts of the plan out and seeking them anew with
/// a wider beam, a large-neighbourhood search, found next to nothing for the time that makes this beam three times
/// wider.)
///
/// ```
/// use std::sync::Arc;
///
/// use swath_sim::config::SimConfig;
/// use swath_sim::foresight::{CANDIDATES, GroundSettings, plan, upper_bound};
/// use swath_sim::learn::episode::{Env, EpisodeConfig};
/// use swath_sim::vehicle::model::Model;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut config = SimConfig::default();
/// config.planning.candidates = CANDIDATES;
/// let episode = EpisodeConfig { orbits: 0.1, ..EpisodeConfig::default() };
/// let env = Env::episode(Arc::new(Model::new(config)?), &episode, 7);
/// let best = plan(&env, &GroundSettings { width: 1, branches: 3, ..GroundSettings::default() });
/// assert!(!best.tasks.is_empty() && best.reward < upper_bound(&env));
/// # Ok(())
/// # }
/// ```
#[must_use]
pub fn plan(env: &Env, settings: &GroundSettings) -> Plan {
    let mut ground = Ground::new(env, settings);
    let labels = ground.beam(*env.context().situation);
    let best = (0..labels.len()).max_by(|&a, &b| labels[a].reward.total_cmp(&labels[b].reward).then(b.cmp(&a)));
    Plan {
        tasks: best.map(|best| ground.tasks(&labels, best)).unwrap_or_default(),
        reward: best.map_or(0.0, |best| labels[best].reward),
        ticks: ground.search.ticks,
    }
}

/// The beginning of a plan.
#[derive(Clone)]
struct Label {
    end: Situation,
    reward: f64,
    /// The label that it continues, with what; none for the root.
    last: Option<(usize, usize, u32)>,
    strip: Option<StripId>,
}

struct Ground<'a> {
    env: &'a Env,
    settings: &'a GroundSettings,
    model: &'a Model,
    passes: Passes,
    search: Search<'a>,
    orbit: Orbit,
    earth: Turn,
    bucket: u64,
    /// Reward per tick of the best plan so far.
    rate: f64,
}

impl<'a> Ground<'a> {
    fn new(env: &'a Env, settings: &'a GroundSettings) -> Self {
        let model: &Model = env.model();
        let situation = env.context().situation;
        let allowance = Allowance { weakness: settings.weakness, ..Allowance::default() };
        Self {
            env,
            settings,
            model,
            passes: Passes::new(env.catalogue()),
            search: Search::new(model, situation, &allowance),
            orbit: Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, model.period),
            earth: model.earth.clone(),
            bucket: u64::from(model.period.ticks_ceil(BUCKET_S)).max(1),
            rate: PRIOR_RATE * model.period.seconds(),
        }
    }

    /// Beginnings of plans from a situation.
    fn beam(&mut self, begin: Situation) -> Vec<Label> {
        let mut labels: Vec<Label> = Vec::new();
        let mut buckets: BTreeMap<u64, Vec<Label>> = BTreeMap::new();
        buckets.insert(0, vec![Label { end: begin, reward: 0.0, last: None, strip: None }]);
        let prior = f64::from(self.model.period.ticks_ceil(PRIOR_S));
        let prior_reward = self.rate * prior;
        let mut best = 0.0f64;
        while let Some((_, bucket)) = buckets.pop_first() {
            let first = labels.len();
            labels.extend(bucket);
            for at in first..labels.len() {
                let elapsed = labels[at].end.now.since(begin.now) as f64;
                best = best.max((labels[at].reward + prior_reward) / (elapsed + prior));
                self.rate = best;
                for child in self.children(&labels, at) {
                    let number = child.end.now.since(begin.now) as u64 / self.bucket;
                    self.keep(buckets.entry(number).or_default(), child, self.settings.width);
                }
            }
        }
        labels
    }

    /// Puts a label into its bucket, which stays sorted by worth, unless there are better ones enough.
    fn keep(&self, bucket: &mut Vec<Label>, label: Label, width: usize) {
        let worth = |label: &Label| label.reward - self.rate * label.end.now.0 as f64;
        let at = bucket.partition_point(|other| worth(other) >= worth(&label));
        if bucket[..at].iter().filter(|other| other.strip == label.strip).count() >= ALIKE {
            return;
        }
        bucket.insert(at, label);
        let strip = bucket[at].strip;
        let mut alike = 0;
        bucket.retain(|other| {
            alike += usize::from(other.strip == strip);
            other.strip != strip || alike <= ALIKE
        });
        bucket.truncate(width);
    }

    /// A label with one more strip each: those that promise most.
    fn children(&mut self, labels: &[Label], at: usize) -> Vec<Label> {
        let label = &labels[at];
        let imaged = self.imaged(labels, at);
        let mut order = self.promising(&label.end, &imaged);
        order.truncate(self.settings.branches);
        let mut children = Vec::with_capacity(order.len());
        for (_, pass) in order {
            let candidate = self.passes.all()[pass];
            let longest = self.env.horizon().since(label.end.now) - i64::from(candidate.t_acq);
            let Some(found) = self.search.shortest(&label.end, &candidate, longest.max(0) as u32) else { continue };
            children.push(Label {
                end: found.end,
                reward: label.reward + candidate.strip.priority,
                last: Some((at, pass, found.t_pre)),
                strip: Some(candidate.id),
            });
        }
        children
    }

    /// Strips that a label has imaged, twins included.
    fn imaged(&self, labels: &[Label], at: usize) -> BTreeSet<StripId> {
        let mut imaged = BTreeSet::new();
        let mut at = at;
        while let Some((parent, pass, _)) = labels[at].last {
            let id = self.passes.all()[pass].id;
            imaged.insert(id);
            imaged.extend(self.env.catalogue().get(id).and_then(|entry| entry.linked));
            at = parent;
        }
        imaged
    }

    /// Windows within reach, by the priority that they promise less what their time costs at the average rate.
    fn promising(&mut self, from: &Situation, imaged: &BTreeSet<StripId>) -> Vec<(f64, usize)> {
        let latest = from.now.after(self.model.t_pre_max());
        let open: Vec<usize> = self.passes.open_between(from.now, latest).collect();
        let mut order = Vec::with_capacity(open.len());
        for i in open {
            let candidate = self.passes.all()[i];
            let Some((earliest, _)) = self.search.starts(from.now, &candidate) else { continue };
            if imaged.contains(&candidate.id) || from.now.after(earliest + candidate.t_acq) > self.env.horizon() {
                continue;
            }
            let duration = candidate.t_acq + self.guess(from, &candidate).max(earliest);
            order.push((candidate.strip.priority - self.rate * f64::from(duration), i));
        }
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        order
    }

    /// A transition time from the angle to turn by, as if from rest to rest at full torque [ticks].
    fn guess(&mut self, from: &Situation, candidate: &Candidate) -> u32 {
        let spacecraft = &self.model.config.spacecraft;
        let start = from.now.after(self.model.period.ticks_ceil(30.0)).max(candidate.window.open);
        let turn = self.earth.cos_sin(start);
        let (target_N, scan_N) = candidate.strip.target_N(0.0, turn, self.model.config.earth.radius_m);
        let dcm_RN = reference_dcm(&self.orbit.position(start), &target_N, &scan_N);
        let angle = mrp::principal_angle(&mrp::subtract(&from.body.sigma_BN, &mrp::from_dcm(&dcm_RN)));
        // ‖σ‖ = tan(θ/4).
        let allowed = 4.0 * libm::atan(self.model.config.imaging.sigma_max);
        let inertia = spacecraft.inertia_kg_m2.iter().sum::<f64>() / 3.0;
        let seconds = 2.0 * ((angle - 0.8 * allowed).max(0.0) * inertia / spacecraft.wheel_torque_max_nm).sqrt();
        self.model.period.ticks_ceil(seconds)
    }

    /// The tasks that lead to a label.
    fn tasks(&self, labels: &[Label], at: usize) -> Vec<PlannedTask> {
        let mut tasks = Vec::new();
        let mut at = at;
        while let Some((parent, pass, t_pre)) = labels[at].last {
            let Candidate { id, t_acq, .. } = self.passes.all()[pass];
            tasks.push(PlannedTask { strip: id, begin: labels[parent].end.now, t_pre, t_acq });
            at = parent;
        }
        tasks.reverse();
        tasks
    }
}
