//! What a launcher keeps, so that another one can take its mission over: who flies, and what it knows of the flight.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use swath_mission::alarms::conditions::Report;
use swath_mission::alarms::wishes::Wish;
use swath_mission::fallback::Deciders;
use swath_node::patient::keep;
use swath_sim::time::Tick;

use super::process::Name;

/// The processes.
const FLEET: &str = "fleet.json";
/// What is known of the flight.
const LAUNCHER: &str = "launcher.json";
/// Held by the launcher for as long as it lives.
const LOCK: &str = "launcher.lock";

/// A process of a mission, as it was started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptMember {
    /// Name of the node.
    pub name: String,
    /// The program, as it was asked for.
    pub program: String,
    /// Words of its command line, the last ones ROS's.
    pub args: Vec<String>,
    /// Words that were added for later starts.
    pub extra: Vec<String>,
    /// How often it was started again.
    pub epoch: u64,
    /// How often what was ordered has befallen it.
    pub struck: u64,
    /// Whether the mission goes on without it.
    pub beside: bool,
    /// Its process; nothing while it is lost.
    pub process: Option<Name>,
}

/// What a launcher knows of the flight that nobody else knows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptFlight {
    /// How many launchers there were before.
    pub epoch: u64,
    /// Where the mission flies.
    pub domain: u16,
    /// See `domain`.
    pub namespace: String,
    /// Whether a bag is recorded.
    pub record: bool,
    /// The last task that was decided on, and who decided on all.
    pub decided: Option<u64>,
    /// See `decided`.
    pub deciders: Deciders,
    /// What was reported of alarms, and what operators wished.
    pub reports: Vec<Report>,
    /// See `reports`.
    pub wishes: Vec<Wish>,
    /// Up to when all of this is.
    pub at: Tick,
    /// Why the mission is in safe mode.
    pub safe_mode: Option<String>,
    /// How long it has flown [s of wall time].
    pub flown_s: f64,
}

/// The folder in which all of it is kept.
#[derive(Clone, Debug)]
pub struct Keeping(PathBuf);

impl Keeping {
    /// In a folder that is there.
    pub fn new(folder: PathBuf) -> Self {
        Self(folder)
    }

    /// Where a node that has lost its launcher speaks to the next one.
    pub fn signs(&self, node: &str) -> PathBuf {
        self.0.join(format!("{node}.signs"))
    }

    /// Makes the place where a node speaks to the next launcher.
    pub fn make_signs(&self, node: &str) -> Result<PathBuf> {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        let path = self.signs(node);
        match mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0) {
            Ok(()) | Err(rustix::io::Errno::EXIST) => Ok(path),
            Err(error) => Err(error).with_context(|| format!("cannot make {}", path.display())),
        }
    }

    /// Takes the mission for this process.
    pub fn lock(&self) -> Result<File> {
        let path = self.0.join(LOCK);
        let failed = || format!("cannot lock {}", path.display());
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(&path).with_context(failed)?;
        match file.try_lock() {
            Ok(()) => Ok(file),
            Err(TryLockError::WouldBlock) => {
                bail!("the launcher of this mission is there: {} is locked", path.display())
            }
            Err(TryLockError::Error(error)) => Err(error).with_context(failed),
        }
    }

    /// Keeps who flies; tells whether there was room for it.
    pub fn keep_fleet(&self, members: &[KeptMember]) -> Result<bool> {
        self.write(FLEET, &members)
    }

    /// Who flew.
    pub fn fleet(&self) -> Result<Vec<KeptMember>> {
        self.read(FLEET)
    }

    /// Keeps what is known of the flight; tells whether there was room for it.
    pub fn keep_flight(&self, flight: &KeptFlight) -> Result<bool> {
        self.write(LAUNCHER, flight)
    }

    /// What was known of the flight.
    pub fn flight(&self) -> Result<KeptFlight> {
        self.read(LAUNCHER)
    }

    fn write(&self, name: &str, value: &impl Serialize) -> Result<bool> {
        keep(&self.0.join(name), &serde_json::to_string(value)?)
    }

    fn read<T: DeserializeOwned>(&self, name: &str) -> Result<T> {
        let path = self.0.join(name);
        let read = |path: &Path| Ok::<_, anyhow::Error>(serde_json::from_str(&std::fs::read_to_string(path)?)?);
        read(&path).with_context(|| format!("no flight over DDS can be taken over here: {}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use swath_mission::alarms::Key;
    use swath_mission::alarms::wishes::Act;

    #[test]
    fn what_is_kept_is_read_again_and_one_launcher_has_it() {
        let folder = tempfile::tempdir().unwrap();
        let keeping = Keeping::new(folder.path().to_owned());
        let error = format!("{:#}", keeping.flight().unwrap_err());
        assert!(error.contains("no flight over DDS can be taken over here") && error.contains(LAUNCHER), "{error}");
        let key = Key::new("guidance", "wheel y");
        let report = Report::new(Tick(7), "guidance", "wheel y", true, "weak".to_owned());
        let wish = Wish { tick: Tick(9), key, act: Act::Acknowledge, actor: "ana".to_owned(), comment: String::new() };
        let flight = KeptFlight { reports: vec![report], wishes: vec![wish], flown_s: 2.5, ..KeptFlight::default() };
        keeping.keep_flight(&flight).unwrap();
        assert_eq!(keeping.flight().unwrap(), flight);
        let member = KeptMember {
            name: "planner".to_owned(),
            program: "swath-planner".to_owned(),
            args: vec!["--ros-args".to_owned()],
            extra: Vec::new(),
            epoch: 3,
            struck: 0,
            beside: false,
            process: Some(Name { pid: 9, started: 77 }),
        };
        keeping.keep_fleet(std::slice::from_ref(&member)).unwrap();
        assert_eq!(keeping.fleet().unwrap(), [member]);
        let held = keeping.lock().unwrap();
        assert!(keeping.lock().unwrap_err().to_string().contains("the launcher of this mission is there"));
        drop(held);
        keeping.lock().unwrap();
        assert_eq!(keeping.make_signs("planner").unwrap(), keeping.make_signs("planner").unwrap());
    }
}
