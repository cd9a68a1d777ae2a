//! `swath export`: a recorded mission as tables, GeoJSON, CZML, and as the messages of CCSDS.

mod ccsds;
mod czml;
pub mod geo;
pub mod table;
mod tables;
pub mod track;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use super::recorded::RecordedArgs;
use track::Track;

/// Arguments of `export`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath export bags/samples/mission -o out/export --format csv geojson

Writes tasks, states and decisions as .csv and .parquet, strips.geojson and ground_track.geojson,
mission.czml with orbit and attitude for Cesium, and both as CCSDS messages, orbit.oem and attitude.aem.")]
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
    /// The orbit as CCSDS Orbit Ephemeris Message.
    Oem,
    /// The attitude as CCSDS Attitude Ephemeris Message.
    Aem,
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
        if [Format::Geojson, Format::Czml, Format::Oem, Format::Aem].into_iter().any(wanted) {
            let track = Track::read(&recorded, self.step)?;
            if wanted(Format::Geojson) {
                geo::write_strips(&recorded, folder)?;
                geo::write_ground_track(&track, &recorded.mission.name, folder)?;
            }
            if wanted(Format::Czml) {
                czml::write_czml(&recorded, &track, folder)?;
            }
            if wanted(Format::Oem) {
                ccsds::write_oem(&recorded, &track, folder)?;
            }
            if wanted(Format::Aem) {
                ccsds::write_aem(&recorded, &track, folder)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn step(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    match (0.01..=3600.0).contains(&seconds) {
        true => Ok(seconds),
        false => Err(format!("{seconds} is outside 0.01 to 3600")),
    }
}
