//! `swath strips`, `swath planner`, `swath alarms` and `swath fault`: an operator's command line to a flying mission.

mod alarms;
mod client;
mod cover;
mod export;
mod fault;
mod files;
mod link;
mod orders;
mod planner;
mod query;
mod selection;
mod show;
mod submit;
mod watch;

pub use alarms::{AlarmsArgs, run as run_alarms};
pub use fault::{FaultArgs, run as run_fault};
pub use link::{LinkArgs, run as run_link};
pub use planner::{PlannerArgs, run as run_planner};

use anyhow::Result;
use clap::{Args, Subcommand};
use swath_ros::RosArgs;

use crate::place::Place;

/// `swath strips`.
#[derive(Debug, Args)]
pub struct StripsArgs {
    #[command(subcommand)]
    command: StripsCommand,
    #[command(flatten)]
    place: Place,
}

#[derive(Debug, Subcommand)]
enum StripsCommand {
    /// Submit the lines and areas of files as strips; exits with 1 when one of them is refused.
    #[command(after_help = "Example: swath strips submit examples/requests/rivers.geojson --submitter ops")]
    Submit(submit::SubmitArgs),
    /// Make strips of the lines and areas of files, without a mission.
    #[command(after_help = "Examples:
  swath strips cover examples/requests/flood.geojson --out strips.geojson
  ogr2ogr -f GeoJSONSeq /vsistdout/ lakes.gpkg | swath strips cover - --rows 10")]
    Cover(cover::CoverArgs),
    /// Say when strips of a file, or a known one, could be imaged.
    #[command(after_help = "Example: swath strips preview examples/requests/fires.geojson --hours 6")]
    Preview(query::PreviewArgs),
    /// List strips by state, area and time.
    #[command(after_help = "Example: swath strips list --state accepted --area 35,70,-10,40")]
    List(query::ListArgs),
    /// List orders, each a line or an area with its strips, and how much of each is imaged.
    #[command(after_help = "Examples:\n  swath strips orders --submitter floods\n  \
        swath strips orders --store out/one/requests.sqlite")]
    Orders(orders::OrdersArgs),
    /// Show all that is known of a strip: chances, attempts, history.
    Show(query::ShowArgs),
    /// Take strips back; refused once imaging has begun.
    Cancel(submit::DecideArgs),
    /// Replace a strip, or a whole order, by the line or area of a file.
    #[command(after_help = "Examples:
  swath strips replace 1021 examples/requests/replacement.geojson
  swath strips replace --ref mekong --submitter relief --whole-order examples/requests/river.gpx")]
    Replace(submit::ReplaceArgs),
    /// Keep accepted strips from being imaged until they are released.
    Hold(submit::DecideArgs),
    /// Accept strips that are held.
    Release(submit::DecideArgs),
    /// Refuse strips that are held.
    Reject(submit::DecideArgs),
    /// Watch requests change, until Ctrl-C.
    Watch(watch::WatchArgs),
    /// Write every strip with its history as GeoJSON, or the audit trail as JSON lines.
    #[command(after_help = "Examples:\n  swath strips export --out strips.geojson\n  \
        swath strips export --trail --store out/one/requests.sqlite")]
    Export(export::ExportArgs),
}

/// Runs `swath strips`.
///
/// # Errors
/// When a file cannot be used, the request manager does not answer, or something is refused.
pub fn run_strips(args: &StripsArgs, ros: &RosArgs) -> Result<()> {
    let ros = &args.place.args(ros);
    use swath_msgs::swath_msgs::ReviewStripsRequest as Review;
    match &args.command {
        StripsCommand::Submit(args) => submit::submit(args, ros),
        StripsCommand::Cover(args) => cover::cover(args),
        StripsCommand::Preview(args) => query::preview(args, ros),
        StripsCommand::List(args) => query::list(args, ros),
        StripsCommand::Orders(args) => orders::orders(args, ros),
        StripsCommand::Show(args) => query::show(args, ros),
        StripsCommand::Cancel(args) => submit::cancel(args, ros),
        StripsCommand::Replace(args) => submit::replace(args, ros),
        StripsCommand::Hold(args) => submit::review(args, ros, Review::ACTION_HOLD),
        StripsCommand::Release(args) => submit::review(args, ros, Review::ACTION_RELEASE),
        StripsCommand::Reject(args) => submit::review(args, ros, Review::ACTION_REJECT),
        StripsCommand::Watch(args) => watch::watch(args, ros),
        StripsCommand::Export(args) => export::export(args, ros),
    }
}
