//! The folder that a mission leaves behind.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, bail};
use serde::Serialize;
use swath_node::patient::{Appended, keep};

use swath_mission::alarms::Entry;
use swath_mission::file::{Mission, MissionRequests};
use swath_mission::link::ground::WayLine;
use swath_mission::orders::import;
use swath_mission::orders::order::Order;
use swath_mission::outcome::{Summary, TaskLine};

/// The request manager's store in the folder.
pub const STORE: &str = "requests.sqlite";

/// A mission that was flown, to its end or until something went wrong.
pub struct Flown {
    /// What came of it.
    pub summary: Summary,
    /// What went wrong.
    pub failure: Option<Error>,
    /// Why the mission came into safe mode.
    pub safe_mode: Option<String>,
}

/// Where bag, tasks and summary go.
pub struct OutputFolder {
    path: PathBuf,
    /// Whether it was not there before.
    made: bool,
    tasks: Appended,
}

impl OutputFolder {
    /// Makes the folder; without a path, a new one under `out/`.
    pub fn create(path: Option<&Path>, mission: &Mission) -> Result<Self> {
        let path = match path {
            Some(path) => path.to_owned(),
            None => unused_name(mission),
        };
        let made = !path.exists();
        fs::create_dir_all(&path).with_context(|| format!("cannot make output folder {}", path.display()))?;
        let mut entries = fs::read_dir(&path).with_context(|| format!("cannot read {}", path.display()))?;
        if entries.next().is_some() {
            bail!("output folder {} is not empty: choose another with --out", path.display());
        }
        let tasks = path.join("tasks.jsonl");
        let tasks = File::create(&tasks).with_context(|| format!("cannot write {}", tasks.display()))?;
        Ok(Self { path, made, tasks: Appended::new(tasks) })
    }

    /// The folder of a mission that was begun, and the tasks that are written there. A line that is not whole is dropped.
    pub fn reopen(path: &Path) -> Result<(Self, Vec<TaskLine>)> {
        let tasks = path.join("tasks.jsonl");
        let failed = || format!("no mission can be taken over here: {}", tasks.display());
        let text = fs::read_to_string(&tasks).with_context(failed)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let lines = text[..whole].lines().map(serde_json::from_str);
        let lines = lines.collect::<Result<Vec<TaskLine>, _>>().with_context(failed)?;
        let file = fs::OpenOptions::new().append(true).open(&tasks).with_context(failed)?;
        file.set_len(whole as u64).with_context(failed)?;
        Ok((Self { path: path.to_owned(), made: false, tasks: Appended::new(file) }, lines))
    }

    /// Removes all that is in the folder, so that it can be asked for again, unless something was flown.
    pub fn discard(self) -> Result<()> {
        if fs::metadata(self.path.join("tasks.jsonl")).is_ok_and(|tasks| tasks.len() > 0) {
            return Ok(());
        }
        let failed = || format!("cannot clear output folder {}", self.path.display());
        for entry in fs::read_dir(&self.path).with_context(failed)? {
            let entry = entry.with_context(failed)?;
            let is_folder = entry.file_type().with_context(failed)?.is_dir();
            let path = entry.path();
            if is_folder { fs::remove_dir_all(path) } else { fs::remove_file(path) }.with_context(failed)?;
        }
        match self.made {
            true => fs::remove_dir(&self.path).with_context(failed),
            false => Ok(()),
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the mission as it is flown: `mission.toml`, and all its requests in `requests.geojson` beside it.
    pub fn write_mission(&self, mission: &Mission, requests: &[Order]) -> Result<PathBuf> {
        import::write(&self.path.join("requests.geojson"), requests)?;
        let files = vec![PathBuf::from("requests.geojson")];
        let mission = Mission {
            requests: MissionRequests { files, random: None, ..mission.requests.clone() },
            ..mission.clone()
        };
        let path = self.path.join("mission.toml");
        fs::write(&path, toml::to_string(&mission)?).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    /// Makes the folder in which nodes keep what they need to go on when they are started again.
    pub fn make_state_folder(&self) -> Result<PathBuf> {
        let path = self.path.join("state");
        fs::create_dir_all(&path).with_context(|| format!("cannot make {}", path.display()))?;
        Ok(path)
    }

    /// Appends a line to `tasks.jsonl`; where there is no room it waits for some.
    pub fn write_task(&mut self, line: &TaskLine) -> Result<()> {
        let mut line = serde_json::to_vec(line)?;
        line.push(b'\n');
        self.tasks.add(&line)?;
        Ok(())
    }

    /// Writes what happened to alarms as `alarms.jsonl`, if anything did; tells whether there was room for it.
    pub fn write_alarms(&self, journal: &[Entry]) -> Result<bool> {
        self.write_lines("alarms.jsonl", journal)
    }

    /// Writes what waits for room, and what happened to alarms: the mission is over.
    pub fn finish(&mut self, journal: &[Entry]) -> Result<()> {
        if !self.tasks.add(&[])? || !self.write_alarms(journal)? {
            bail!("there is no room for tasks and alarms in {}", self.path.display());
        }
        Ok(())
    }

    /// Writes the ways of requests over the radio as `strips.jsonl`, if there is a radio.
    pub fn write_ways(&self, ways: &[WayLine]) -> Result<()> {
        if !self.write_lines("strips.jsonl", ways)? {
            bail!("there is no room for the ways of requests in {}", self.path.display());
        }
        Ok(())
    }

    fn write_lines(&self, name: &str, lines: &[impl Serialize]) -> Result<bool> {
        if lines.is_empty() {
            return Ok(true);
        }
        let mut text = String::new();
        for line in lines {
            text += &serde_json::to_string(line)?;
            text.push('\n');
        }
        keep(&self.path.join(name), &text)
    }

    /// Writes `summary.json`.
    pub fn write_summary(&self, summary: &Summary) -> Result<()> {
        let path = self.path.join("summary.json");
        let mut text = serde_json::to_string_pretty(summary)?;
        text.push('\n');
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}

fn unused_name(mission: &Mission) -> PathBuf {
    let name: String =
        mission.name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    let name = if name.is_empty() { "mission".to_owned() } else { name };
    let mut paths = (1..).map(|number| PathBuf::from(format!("out/{name}-{}-{number}", mission.seed)));
    paths.find(|path| !path.exists()).unwrap_or_default()
}
