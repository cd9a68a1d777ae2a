//! `convert` and `reindex`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::common::{ReadArgs, bags, done};
use crate::error::Result;
use crate::ops::convert::convert;
use crate::ops::reindex::reindex;
use crate::out::print;

/// Arguments of `convert`.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  swath-bag convert -i old_bag sqlite3 -o output.yaml

output.yaml, as ros2 bag convert takes it:
  output_bags:
  - uri: new_bag
    all_topics: true
    all_services: true
    storage_preset_profile: zstd_fast

MCAP and SQLite bags are read, MCAP bags are written. Exits with 3 when something could not be read.")]
pub struct ConvertArgs {
    /// A bag, and the kind of its files if you like; several are read as one
    #[arg(short, long, required = true, num_args = 1..=2, value_names = ["BAG", "KIND"])]
    input: Vec<String>,
    /// YAML file with the new bags, as rosbag2 has it
    #[arg(short, long, value_name = "FILE")]
    output_options: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
}

impl ConvertArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let bags = bags(self.input);
        let mut faults = Vec::new();
        for (path, copied) in convert(&bags, &self.output_options, self.read.options())? {
            let messages = copied.summary.messages;
            print(&format!("{}: {messages} messages\n", path.display()))?;
            faults = copied.faults;
        }
        Ok(done(&faults))
    }
}

/// Arguments of `reindex`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  swath-bag reindex out/bag\n\nA file that was not closed is left out: recover the bag first. Exits with 3 then."
)]
pub struct ReindexArgs {
    /// Bag directory
    bag: PathBuf,
    #[command(flatten)]
    read: ReadArgs,
}

impl ReindexArgs {
    pub(super) fn run(self) -> Result<ExitCode> {
        let (information, faults) = reindex(&self.bag, self.read.options())?;
        let (messages, files) = (information.message_count, information.files.len());
        print(&format!("{messages} messages in {files} files\n"))?;
        Ok(done(&faults))
    }
}
