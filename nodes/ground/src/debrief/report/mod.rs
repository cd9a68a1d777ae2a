//! `swath report`: a recorded mission as one page that needs no network.

mod alarms;
mod figures;
mod markup;
mod page;
mod radio;
mod story;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;

use super::recorded::RecordedArgs;

/// Arguments of `report`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath report bags/samples/mission -o out/report.html

The page holds the ground track and the strips on a map, the share imaged of orders, the tasks over time, attitude error, wheel speeds and
torques, reward, request states, and each decision with its candidates.")]
pub struct ReportArgs {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// The page
    #[arg(short, long, default_value = "report.html")]
    output: PathBuf,
}

impl ReportArgs {
    /// Writes the page.
    ///
    /// # Errors
    /// When the bag holds no mission or the page cannot be written.
    pub fn run(self) -> Result<ExitCode> {
        let recorded = self.recorded.open()?;
        let page = page::page(&recorded, &story::Story::of(&recorded)?)?;
        fs::write(&self.output, page).with_context(|| format!("cannot write {}", self.output.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}
