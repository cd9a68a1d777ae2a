//! `swath export`: a recorded mission as tables, GeoJSON and CZML.

mod czml;
pub mod geo;
pub mod table;
mod tables;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use nalgebra::{UnitQuaternion, Vector3};
use swath_msgs::swath_msgs as msg;
use swath_node::messages::state_sample;

use super::places::{Place, attitude_E, position_E, sub_satellite};
use super::recorded::{Recorded, RecordedArgs};

/// Arguments of `export`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath export bags/samples/mission -o out/export --format csv geojson

Writes tasks, states and decisions as .csv and .parquet, strips.geojson and ground_track.geojson, and
mission.czml with orbit and attitude for Cesium.")]
pub struct ExportArgs {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// Folder for the files; it is made if it is not there
    #[arg(short, long)]
    output: PathBuf,
    /// What to write; everything without this
    #[arg(long, value_enum, num_args = 1..)]
    format: Vec<Format>,
    /// Time between points of ground track, orbit and attitude [s]
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = step)]
    step: f64,
}

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Tables as text.
    Csv,
    /// Tables for data frames.
    Parquet,
    /// Strips and ground track.
    Geojson,
    /// Orbit and attitude for Cesium.
    Czml,
}

/// The satellite's way over the ground.
pub struct Track {
    /// Points in order of time.
    pub points: Vec<TrackPoint>,
}

/// A point of the satellite's way.
pub struct TrackPoint {
    /// Time since the mission's epoch [s].
    pub time_s: f64,
    /// The point below the satellite.
    pub place: Place,
    /// The satellite in the planet-fixed frame [m].
    pub r_E: Vector3<f64>,
    /// The rotation that takes body components to planet-fixed ones; neighbours have like signs.
    pub attitude_E: UnitQuaternion<f64>,
}

impl ExportArgs {
    /// Writes the files.
    ///
    /// # Errors
    /// When the bag holds no mission or a file cannot be written.
    pub fn run(self) -> Result<ExitCode> {
        let recorded = self.recorded.open()?;
        let folder = &self.output;
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let wanted = |format| self.format.is_empty() || self.format.contains(&format);
        let tables = (wanted(Format::Csv), wanted(Format::Parquet));
        if tables.0 || tables.1 {
            tables::write_tasks(&recorded, folder, tables)?;
            tables::write_states(&recorded, folder, tables)?;
            tables::write_decisions(&recorded, folder, tables)?;
        }
        if wanted(Format::Geojson) || wanted(Format::Czml) {
            let track = Track::read(&recorded, self.step)?;
            if wanted(Format::Geojson) {
                geo::write_strips(&recorded, folder)?;
                geo::write_ground_track(&track, &recorded.mission.name, folder)?;
            }
            if wanted(Format::Czml) {
                czml::write_czml(&recorded, &track, folder)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl Track {
    /// A point every `step_s` of simulated time, and the last one.
    ///
    /// # Errors
    /// When the bag has no states or they cannot be read.
    pub fn read(recorded: &Recorded, step_s: f64) -> Result<Self> {
        let period = recorded.model.period;
        let every = u64::from(period.ticks_ceil(step_s).max(1));
        let mut earth = recorded.model.earth.clone();
        let mut points: Vec<TrackPoint> = Vec::new();
        let mut last = None;
        let mut add = |state: &msg::SpacecraftState| -> Result<()> {
            let sample = state_sample(state)?;
            let mut attitude = attitude_E(&mut earth, &sample);
            // A quaternion and its negative are one attitude; interpolation wants the nearer one.
            if points.last().is_some_and(|before| before.attitude_E.dot(&attitude) < 0.0) {
                attitude = UnitQuaternion::new_unchecked(-attitude.into_inner());
            }
            points.push(TrackPoint {
                time_s: period.time_s(sample.tick),
                place: sub_satellite(&mut earth, &sample),
                r_E: position_E(&mut earth, &sample),
                attitude_E: attitude,
            });
            Ok(())
        };
        recorded.for_each_state(|state| {
            if state.tick.is_multiple_of(every) {
                add(&state)?;
            }
            last = Some(state);
            Ok(())
        })?;
        if let Some(last) = last.filter(|last: &msg::SpacecraftState| !last.tick.is_multiple_of(every)) {
            add(&last)?;
        }
        Ok(Self { points })
    }
}

fn step(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    match (0.01..=3600.0).contains(&seconds) {
        true => Ok(seconds),
        false => Err(format!("{seconds} is outside 0.01 to 3600")),
    }
}
