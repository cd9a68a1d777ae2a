//! A mission: what is flown, for how long, for whom and by which planner.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use swath_sim::config::SimConfig;
use swath_sim::config::resources::ResourcesConfig;
use swath_sim::error::SimError;
use swath_sim::mission::horizon;
use swath_sim::planner::PlannerSpec;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::faults::{Fault as VehicleFault, TimedFault};
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::stations::NeverSeen;
use thiserror::Error;

use crate::approval::ApprovalConfig;
use crate::faults::{FaultPlan, FaultPlanError};
use crate::link::config::{LinkConfig, LinkConfigError};
use crate::orders::feature_strips::{Cutting, SWATH_KM};
use crate::orders::found::Fault;
use crate::orders::import::{RequestsFileError, import};
use crate::orders::order::Order;
use crate::orders::rows::Rows;
use crate::orders::short_lines::ShortLines;
use crate::origin::Origins;
use crate::requests::logic::Rules;
use crate::requests::refusal::ATTEMPTS_MAX;
use crate::supervision::SupervisionConfig;

/// In a paced mission, the wall-clock time that planning a task may take where ticks are shorter than that; the time lost
/// is made up.
pub const PACED_PATIENCE: Duration = Duration::from_millis(100);

/// Why a mission cannot be flown.
#[derive(Debug, Error)]
pub enum MissionError {
    /// A file cannot be read.
    #[error("cannot read mission {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file is no mission.
    #[error("{path} is not a valid mission")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: Box<toml::de::Error>,
    },
    /// A setting is out of range.
    #[error("mission setting {0}")]
    Setting(#[from] SimError),
    /// A number is out of range.
    #[error("mission setting {name} is {value}, outside {min} to {max}")]
    OutOfRange {
        /// Path of the setting.
        name: &'static str,
        /// Value given.
        value: f64,
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// Faults that cannot be flown.
    #[error("mission setting faults: {0}")]
    Faults(#[from] FaultPlanError),
    /// A radio that cannot be flown.
    #[error("mission setting link: {0}")]
    Link(#[from] LinkConfigError),
    /// A file of requests cannot be used.
    #[error(transparent)]
    Requests(#[from] RequestsFileError),
}

/// A mission file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mission {
    /// Name for people.
    pub name: String,
    /// Seed of everything random: initial state, random requests, random planner.
    pub seed: u64,
    /// Length [orbits].
    pub orbits: f64,
    /// 0: as fast as the nodes can go; 1: real time; x: x times real time.
    pub pace: f64,
    /// Simulated time of the mission's epoch [s since 1970-01-01 UTC].
    pub epoch_unix_s: u32,
    /// Planner: `beam`, `beam:WIDTHxDEPTH`, `repair`, `aspen`, `lookahead`, `lookahead:TICKS` of margin,
    /// `heuristic:SECONDS`, `random`, or a kind of policy, such as `hop-ppo` for the shipped one and `hop-ppo:FILE` for
    /// another; see [`PlannerSpec`].
    pub planner: PlannerSpec,
    /// Strips known from the start, and what holds for all.
    pub requests: MissionRequests,
    /// What the planner may do by itself.
    pub approval: ApprovalConfig,
    /// Longest wait for a task in lockstep [s of wall clock]; after it the attitude is held for `hold_s`.
    pub planning_deadline_s: f64,
    /// How long the attitude is held when no task came in time [s of simulated time].
    pub hold_s: f64,
    /// Initial state; drawn from the seed when it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<InitialState>,
    /// Physics and the planning problem.
    pub sim: SimConfig,
    /// Power, data and momentum of the satellite, a shorter way to write `[sim.resources]`; reading a mission puts it
    /// there.
    #[serde(skip_serializing)]
    pub resources: Option<Box<ResourcesConfig>>,
    /// How the satellite that is flown differs from what guidance and planner believe of it.
    #[serde(skip_serializing_if = "is_default")]
    pub plant: PlantErrors,
    /// What fails on the way.
    #[serde(skip_serializing_if = "FaultPlan::is_empty")]
    pub faults: FaultPlan,
    /// The radio between ground and satellite; without it the ground is always connected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkConfig>,
    /// Who starts the nodes whose place another program may take.
    #[serde(skip_serializing_if = "is_default")]
    pub nodes: Origins,
    /// What the launcher does about nodes that end or hang.
    #[serde(skip_serializing_if = "is_usual")]
    pub supervision: SupervisionConfig,
}

fn is_usual(supervision: &SupervisionConfig) -> bool {
    *supervision == SupervisionConfig::default()
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Strips known from the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MissionRequests {
    /// Files with lines and areas, of any format that is read, relative to the mission file.
    pub files: Vec<PathBuf>,
    /// Attempts before a request fails, for requests that do not say; attempts that were cut short do not count.
    pub max_attempts: u32,
    /// Width of what the camera shows [km]: lines are followed and areas are covered by strips of it.
    pub swath_km: f64,
    /// Direction of the strips of areas: `fewest`, `passes`, or a heading in degrees as text.
    #[serde(skip_serializing_if = "is_default")]
    pub rows: Rows,
    /// What becomes of lines that are shorter than a strip may be: `refuse`, `stretch` or `join`.
    #[serde(skip_serializing_if = "is_default")]
    pub short_lines: ShortLines,
    /// Random strips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub random: Option<ScenarioConfig>,
}

impl Default for MissionRequests {
    fn default() -> Self {
        Self {
            files: Vec::new(),
            max_attempts: 10,
            swath_km: SWATH_KM,
            rows: Rows::default(),
            short_lines: ShortLines::default(),
            random: None,
        }
    }
}

impl Default for Mission {
    fn default() -> Self {
        Self {
            name: String::new(),
            seed: 0,
            orbits: 1.0,
            pace: 0.0,
            // 2026-01-01T00:00:00Z.
            epoch_unix_s: 1_767_225_600,
            planner: PlannerSpec::default(),
            requests: MissionRequests::default(),
            approval: ApprovalConfig::default(),
            planning_deadline_s: 10.0,
            hold_s: 10.0,
            initial: None,
            sim: SimConfig::default(),
            resources: None,
            plant: PlantErrors::default(),
            faults: FaultPlan::default(),
            link: None,
            nodes: Origins::default(),
            supervision: SupervisionConfig::default(),
        }
    }
}

impl Mission {
    /// Reads a mission file; paths in it become relative to where the file lies.
    ///
    /// # Errors
    /// When the file cannot be read, has unknown keys, or a setting is out of range.
    pub fn read(path: &Path) -> Result<Self, MissionError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| MissionError::Read { path: path.to_owned(), source })?;
        Self::parse(&text, path)
    }

    /// As [`Self::read`], of a text as it stands in a file.
    ///
    /// # Errors
    /// When it has unknown keys, or a setting is out of range.
    pub fn parse(text: &str, path: &Path) -> Result<Self, MissionError> {
        let mut mission: Self = toml::from_str(text)
            .map_err(|source| MissionError::Parse { path: path.to_owned(), source: Box::new(source) })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        mission.planner.resolve(&std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned()));
        for file in &mut mission.requests.files {
            *file = folder.join(&*file);
        }
        mission.sim.resources = mission.resources.take().or(mission.sim.resources);
        mission.validate()?;
        Ok(mission)
    }

    /// Stations of the mission that its orbit never sees.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn stations_never_seen(&self) -> Result<Vec<NeverSeen>, MissionError> {
        let model = self.model()?;
        let mut unseen: Vec<_> =
            model.stations.iter().filter_map(|station| station.never_seen(&model.config)).collect();
        if let Some(link) = &self.link {
            unseen.extend(link.never_seen(&model.config)?);
        }
        unseen.dedup();
        Ok(unseen)
    }

    /// The satellite's orbit.
    #[must_use]
    pub fn orbit(&self, model: &Model) -> Orbit {
        Orbit::new(&model.config, self.initial().orbit, model.period)
    }

    /// Checks every setting's range.
    ///
    /// # Errors
    /// The first setting that is out of range.
    pub fn validate(&self) -> Result<(), MissionError> {
        for (name, value, min, max) in [
            ("orbits", self.orbits, 0.01, 10_000.0),
            ("pace", self.pace, 0.0, 1e6),
            ("planning_deadline_s", self.planning_deadline_s, 0.01, 3600.0),
            ("hold_s", self.hold_s, 0.1, 3600.0),
            ("requests.max_attempts", f64::from(self.requests.max_attempts), 1.0, f64::from(ATTEMPTS_MAX)),
            ("approval.deadline_s", self.approval.deadline_s, 0.1, 1e6),
            ("approval.look_again_s", self.approval.look_again_s, 0.1, 3600.0),
            ("requests.swath_km", self.requests.swath_km, 0.1, 1000.0),
            ("supervision.backoff_s", self.supervision.backoff_s, 0.01, 3600.0),
            ("supervision.backoff_max_s", self.supervision.backoff_max_s, 0.01, 3600.0),
            ("supervision.starts", f64::from(self.supervision.starts), 0.0, 1000.0),
            ("supervision.within_s", self.supervision.within_s, 1.0, 1e6),
            ("supervision.warn_s", self.supervision.warn_s, 1.0, 3600.0),
            ("supervision.kill_s", self.supervision.kill_s, 2.0, 3600.0),
            ("supervision.startup_s", self.supervision.startup_s, 1.0, 3600.0),
            ("supervision.orphaned_s", self.supervision.orphaned_s, 1.0, 1e9),
        ] {
            if !(min..=max).contains(&value) {
                return Err(MissionError::OutOfRange { name, value, min, max });
            }
        }
        if let Some(scenario) = &self.requests.random {
            scenario.validate()?;
        }
        self.plant.validate()?;
        self.sim.validate()?;
        if let Some(link) = &self.link {
            link.validate(&self.sim)?;
        }
        if !self.faults.is_empty() {
            let model = self.model()?;
            self.faults.validate(self.horizon(&model), model.period)?;
            if self.link.is_none() {
                self.faults.fits_no_radio()?;
            }
            self.nodes.fits(&self.faults)?;
        }
        Ok(())
    }

    /// The same mission with everything drawn that is left to its seed: initial state and faults.
    #[must_use]
    pub fn resolved(mut self) -> Self {
        self.initial = Some(self.initial());
        if let Ok(model) = self.model() {
            let horizon = self.horizon(&model);
            self.faults = self.faults.resolved(self.seed, self.link.is_some(), horizon, model.period);
        }
        self
    }

    /// Whether what is measured of the satellite may differ from what is, now or later.
    #[must_use]
    pub fn tells_truth_apart(&self, period: TickPeriod) -> bool {
        let of_sensors = |it: &TimedFault| matches!(it.fault, VehicleFault::GyroBias(_) | VehicleFault::StarTrackerOut);
        self.plant.noisy() || self.faults.vehicle(period).iter().any(of_sensors)
    }

    /// The initial state.
    #[must_use]
    pub fn initial(&self) -> InitialState {
        self.initial.unwrap_or_else(|| InitialState::draw(&self.sim, &mut rng::stream(self.seed, rng::INITIAL_STATE)))
    }

    /// The satellite at the epoch, with its errors and the faults that will befall it.
    ///
    /// # Errors
    /// When what the errors make of the configuration is out of range.
    pub fn spacecraft(&self, model: &Model) -> Result<Spacecraft, MissionError> {
        let mut spacecraft = Spacecraft::new(model, &self.initial());
        spacecraft.differ(model, &self.plant, self.seed)?;
        let faults = self.faults.vehicle(model.period);
        if !faults.is_empty() {
            spacecraft.suffer(faults);
        }
        Ok(spacecraft)
    }

    /// The constants of the physics and the planning problem.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn model(&self) -> Result<Model, MissionError> {
        Ok(Model::new(self.sim.clone())?)
    }

    /// What the mission says of its requests.
    #[must_use]
    pub fn rules(&self) -> Rules {
        Rules { epoch_ns: u64::from(self.epoch_unix_s) * 1_000_000_000, max_attempts: self.requests.max_attempts }
    }

    /// What the requests of a mission rest on, as a text that differs when two missions differ in it: the satellite,
    /// its orbit, the length and the limits. The pace and the planner may change.
    #[must_use]
    pub fn identity(&self) -> String {
        let identity = (self.seed, self.orbits.to_bits(), self.epoch_unix_s, self.initial(), &self.sim);
        serde_json::to_string(&identity).unwrap_or_default()
    }

    /// Epoch [s since 1970-01-01 UTC] and control tick of the mission of an identity.
    #[must_use]
    pub fn clock_of(identity: &str) -> Option<(u32, TickPeriod)> {
        let identity: serde_json::Value = serde_json::from_str(identity).ok()?;
        let epoch_unix_s = identity.get(2)?.as_u64()?.try_into().ok()?;
        let frequency_hz = identity.get(4)?.pointer("/control/frequency_hz")?.as_f64()?;
        Some((epoch_unix_s, TickPeriod::from_frequency(frequency_hz).ok()?))
    }

    /// Tick at which the mission ends.
    #[must_use]
    pub fn horizon(&self, model: &Model) -> Tick {
        horizon(model, self.orbits)
    }

    /// How lines and areas become strips.
    #[must_use]
    pub fn cutting(&self) -> Cutting {
        let MissionRequests { swath_km, rows, short_lines, .. } = self.requests;
        Cutting { swath_km, tolerance_km: 0.5 * swath_km, rows, short_lines, ..Cutting::of(&self.sim) }
    }

    /// The strips known from the start: those of the files, in order, then the random ones; and what in the files is no
    /// strip.
    ///
    /// # Errors
    /// When a file as a whole cannot be used.
    pub fn initial_requests(&self) -> Result<(Vec<Order>, Vec<Fault>), MissionError> {
        let (mut requests, mut faults) = (Vec::new(), Vec::new());
        for file in &self.requests.files {
            let import = import(file, &self.cutting())?;
            requests.extend(import.orders);
            faults.extend(import.refused);
        }
        if let Some(scenario) = &self.requests.random {
            let mut rng = rng::stream(self.seed, rng::CATALOGUE);
            let count = scenario.draw_count(&mut rng);
            let random = scenario.generate(&mut rng, count, self.sim.earth.radius_m);
            requests.extend(
                (1..).zip(random).map(|(number, request)| {
                    Order::new(format!("random-{number}"), format!("random {number}"), request)
                }),
            );
        }
        Ok((requests, faults))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Mission, String> {
        let mission: Mission = toml::from_str(text).map_err(|error| error.to_string())?;
        mission.validate().map_err(|error| error.to_string())?;
        Ok(mission)
    }

    #[test]
    fn a_mission_survives_its_own_text() {
        let mission = Mission { seed: 7, ..Mission::default() }.resolved();
        assert_eq!(parse(&toml::to_string(&mission).unwrap()), Ok(mission));
    }

    #[test]
    fn resources_are_read_with_their_profile_and_stations_never_seen_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mission.toml");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Mission::read(&path).map_err(|error| error.to_string())
        };
        let mission = read("[resources]\nbus_w = 55.0\nstations = [\"boulder\", \"svalbard\"]").unwrap();
        let resources = mission.sim.resources.clone().unwrap();
        assert_eq!((resources.bus_w, resources.panel_area_m2), (55.0, 1.18));
        let unseen: Vec<String> = mission.stations_never_seen().unwrap().iter().map(ToString::to_string).collect();
        assert_eq!(unseen.len(), 1);
        assert!(unseen[0].starts_with("station svalbard at latitude 78.2° never sees"), "{unseen:?}");
        // What is resolved says it once, and is the same mission.
        let text = toml::to_string(&mission).unwrap();
        assert!(text.contains("[sim.resources]") && !text.contains("\n[resources]"), "{text}");
        assert_eq!(read(&text), Ok(mission));
        let error = read("[resources]\npanel_efficiency = 1.5").unwrap_err();
        assert_eq!(error, "mission setting resources.panel_efficiency is 1.5, outside 0 to 1");
        let error = read("[resources]\nstations = []").unwrap_err();
        assert!(error.contains("no stations to send to"), "{error}");
    }

    #[test]
    fn how_lines_and_areas_become_strips_is_a_setting() {
        let mission = parse("[requests]\nrows = \"passes\"\nshort_lines = \"join\"\nswath_km = 20.0").unwrap();
        let cutting = mission.cutting();
        assert_eq!((cutting.rows, cutting.short_lines), (Rows::Passes, ShortLines::Join));
        assert_eq!((cutting.swath_km, cutting.tolerance_km), (20.0, 10.0));
        assert_eq!(parse(&toml::to_string(&mission).unwrap()), Ok(mission));
        let error = parse("[requests]\nrows = \"north\"").unwrap_err();
        assert!(error.contains("`north` is neither `fewest`, `passes` nor a heading"), "{error}");
        assert!(parse("[requests]\nshort_lines = \"melt\"").unwrap_err().contains("unknown variant `melt`"));
    }

    #[test]
    fn a_link_is_read_checked_and_written() {
        let text = "[link]\nstations = [\"weilheim\", \"svalbard\"]\nloss = 0.2\nuplink_bps = 64000\n";
        let mission = parse(text).unwrap();
        assert_eq!(mission.link.as_ref().map(|link| (link.loss, link.stations.len())), Some((0.2, 2)));
        assert_eq!(parse(&toml::to_string(&mission).unwrap()), Ok(mission.clone()));
        let unseen = mission.stations_never_seen().unwrap();
        assert_eq!(unseen.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["svalbard"]);
        let error = parse("[link]\nstations = [\"tokyo\"]\nuplink_bps = 0").unwrap_err();
        assert_eq!(error, "mission setting link: uplink_bps is 0, outside 100 to 10000000000");
    }

    #[test]
    fn faults_name_the_setting_and_the_limit() {
        let error = parse("orbit = 3").unwrap_err();
        assert!(error.contains("unknown field `orbit`"), "{error}");
        let error = parse("pace = nan").unwrap_err();
        assert_eq!(error, "mission setting pace is NaN, outside 0 to 1000000");
        let error = parse("[sim.imaging]\nsigma_max = -1").unwrap_err();
        assert_eq!(error, "mission setting imaging.sigma_max is -1, outside 0.000001 to 1");
        let error = parse("planner = \"heuristic:-5\"").unwrap_err();
        assert!(error.contains("-5"), "{error}");
        let error = parse("[requests.random]\ncount = [5, 2]").unwrap_err();
        assert_eq!(error, "mission setting scenario.count runs from 5 down to 2");
    }
}
