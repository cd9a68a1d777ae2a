//! `swath strips`: an operator's requests to a flying mission.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use swath_msgs::swath_msgs as msg;
use swath_ros::{Node, RosArgs, graph};

use crate::{requests_file, to_msg};

/// `swath strips`.
#[derive(Debug, Args)]
pub struct StripsArgs {
    #[command(subcommand)]
    command: StripsCommand,
}

#[derive(Debug, Subcommand)]
enum StripsCommand {
    /// Submit the strips of GeoJSON files; exits with 1 when one of them is refused.
    #[command(after_help = "Example: swath strips submit examples/requests/rivers.geojson --submitter ops")]
    Submit {
        /// GeoJSON files: LineString or MultiLineString features.
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Who submits.
        #[arg(long, default_value = "operator")]
        submitter: String,
        /// Print the answers as JSON lines.
        #[arg(long)]
        json: bool,
    },
}

/// How long to wait for the request manager to be there, and for each answer.
const TIMEOUT: Duration = Duration::from_secs(10);
/// Requests in one call.
const BATCH: usize = 500;

/// Runs `swath strips`.
///
/// # Errors
/// When a file cannot be used, the request manager does not answer, or a strip is refused.
pub fn run(args: &StripsArgs) -> Result<()> {
    let StripsCommand::Submit { files, submitter, json } = &args.command;
    let mut requests = Vec::new();
    for file in files {
        requests.extend(requests_file::read(file)?);
    }
    let node = Node::start(&format!("operator_{}", std::process::id()), &RosArgs::default())?;
    let client = node.client(&graph::SUBMIT_STRIPS)?;
    node.wait_for_service(&client, TIMEOUT).context("no request manager is flying in this domain")?;
    let mut refused = 0;
    for batch in requests.chunks(BATCH) {
        let call = msg::SubmitStripsRequest {
            requests: batch.iter().map(|named| to_msg::strip_request(named, submitter)).collect::<Vec<_>>(),
        };
        let answer = client.call(call, TIMEOUT)?;
        for (named, result) in batch.iter().zip(&answer.results) {
            refused += usize::from(!result.accepted);
            print_result(&named.name, result, *json)?;
        }
    }
    if refused > 0 {
        bail!("{refused} of {} strips were refused", requests.len());
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "the answers are this command's result")]
fn print_result(name: &str, result: &msg::SubmitResult, json: bool) -> Result<()> {
    if json {
        let line = serde_json::json!({
            "name": name, "accepted": result.accepted, "id": result.id,
            "reason_code": result.reason_code, "reason": result.reason,
        });
        println!("{}", serde_json::to_string(&line)?);
    } else if result.accepted {
        println!("accepted  {:>7}  {name}", result.id);
    } else {
        println!("refused   {:>7}  {name}: {} (reason {})", "-", result.reason, result.reason_code);
    }
    Ok(())
}
