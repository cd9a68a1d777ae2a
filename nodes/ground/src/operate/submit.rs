//! Commands that change requests.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;
use swath_sim::config::SimConfig;

use super::client::{Operator, check};
use super::show::print_result;
use super::{Actor, read_files};
use swath_mission::orders::geojson::Lengths;
use swath_node::orders::request_message;

/// Requests in one call.
const BATCH: usize = 500;

/// `swath strips submit`.
#[derive(Debug, Args)]
pub struct SubmitArgs {
    /// GeoJSON files: LineString or MultiLineString features.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Who submits.
    #[arg(long, default_value = "operator")]
    submitter: String,
    /// Lines longer than this become several strips [km].
    #[arg(long, default_value_t = SimConfig::default().requests.length_max_km)]
    max_length_km: f64,
    /// Let all of them wait for approval.
    #[arg(long)]
    hold: bool,
    /// Only read and cut.
    #[arg(long)]
    dry_run: bool,
    /// Print the answers as JSON lines, the report last.
    #[arg(long)]
    json: bool,
}

/// `swath strips cancel`, `hold`, `release` and `reject`.
#[derive(Debug, Args)]
pub struct DecideArgs {
    /// Numbers of the strips.
    #[arg(required = true)]
    ids: Vec<u64>,
    #[command(flatten)]
    actor: Actor,
    /// Print the answers as JSON lines.
    #[arg(long)]
    json: bool,
}

/// `swath strips replace`.
#[derive(Debug, Args)]
pub struct ReplaceArgs {
    /// Number of the strip.
    id: u64,
    /// GeoJSON file with the strip that is wanted instead.
    file: PathBuf,
    /// Who submits.
    #[arg(long, default_value = "operator")]
    submitter: String,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

fn lengths(longest_km: f64) -> Result<Lengths> {
    if !(1.0..=5000.0).contains(&longest_km) {
        bail!("--max-length-km is {longest_km}, outside 1 to 5000");
    }
    Ok(Lengths { longest_km, ..Lengths::of(&SimConfig::default()) })
}

/// Submits the strips of files, and reports what became of every line.
///
/// # Errors
/// When a file cannot be used, nobody answers, or something is refused.
#[expect(clippy::print_stdout, reason = "the report is this command's result")]
pub fn submit(args: &SubmitArgs) -> Result<()> {
    let mut import = read_files(&args.files, lengths(args.max_length_km)?)?;
    for named in &mut import.requests {
        named.submitter.clone_from(&args.submitter);
        named.hold_for_approval |= args.hold;
    }
    let (lines, strips) = (import.lines, import.requests.len());
    let pieces: usize = import.cut.iter().map(|(_, count)| count).sum();
    let (mut accepted, mut refused) = (0, 0);
    if !args.dry_run && strips > 0 {
        let operator = Operator::start()?;
        let desk = operator.desk(&graph::SUBMIT_STRIPS)?;
        for batch in import.requests.chunks(BATCH) {
            let requests = batch.iter().map(request_message).collect::<Vec<_>>();
            let answer = desk.call(msg::SubmitStripsRequest { requests })?;
            check(answer.reason_code, &answer.reason)?;
            for (named, result) in batch.iter().zip(&answer.results) {
                *if result.accepted { &mut accepted } else { &mut refused } += 1;
                print_result(&named.name, "accepted", result, args.json)?;
            }
        }
    }
    if args.json {
        let cut: Vec<_> =
            import.cut.iter().map(|(name, count)| serde_json::json!({ "line": name, "strips": count })).collect();
        let report = serde_json::json!({
            "lines": lines, "cut": cut, "strips": strips, "accepted": accepted, "refused": refused,
            "features_refused": import.refused.len(),
        });
        println!("{report}");
    } else {
        for (name, count) in &import.cut {
            println!("cut       {name} into {count} strips of equal length");
        }
        println!(
            "{lines} lines: {} as they are, {} cut into {pieces}; {strips} strips: {accepted} accepted, {refused} refused",
            lines - import.cut.len(),
            import.cut.len(),
        );
    }
    match refused + import.refused.len() {
        0 => Ok(()),
        _ => bail!("{refused} of {strips} strips and {} features were refused", import.refused.len()),
    }
}

/// Takes strips back.
///
/// # Errors
/// When nobody answers or something is refused.
pub fn cancel(args: &DecideArgs) -> Result<()> {
    let operator = Operator::start()?;
    let Actor { actor, reason } = &args.actor;
    let call = msg::CancelStripsRequest { ids: args.ids.clone(), actor: actor.clone(), reason: reason.clone() };
    let answer = operator.desk(&graph::CANCEL_STRIPS)?.call_once(Default::default(), call)?;
    check(answer.reason_code, &answer.reason)?;
    tell(args, "cancelled", &answer.results)
}

/// Holds, releases or rejects strips.
///
/// # Errors
/// When nobody answers or something is refused.
pub fn review(args: &DecideArgs, action: u8) -> Result<()> {
    let operator = Operator::start()?;
    let Actor { actor, reason } = &args.actor;
    let call = msg::ReviewStripsRequest { ids: args.ids.clone(), action, actor: actor.clone(), reason: reason.clone() };
    let answer = operator.desk(&graph::REVIEW_STRIPS)?.call_once(Default::default(), call)?;
    check(answer.reason_code, &answer.reason)?;
    let done = match action {
        msg::ReviewStripsRequest::ACTION_HOLD => "held",
        msg::ReviewStripsRequest::ACTION_RELEASE => "released",
        _ => "rejected",
    };
    tell(args, done, &answer.results)
}

fn tell(args: &DecideArgs, done: &str, results: &[msg::SubmitResult]) -> Result<()> {
    for (id, result) in args.ids.iter().zip(results) {
        print_result(&format!("strip {id}"), done, result, args.json)?;
    }
    match results.iter().filter(|result| !result.accepted).count() {
        0 => Ok(()),
        refused => bail!("{refused} of {} were refused", results.len()),
    }
}

/// Replaces a strip.
///
/// # Errors
/// When the file does not hold one strip, nobody answers, or the new strip is refused.
pub fn replace(args: &ReplaceArgs) -> Result<()> {
    let import = read_files(std::slice::from_ref(&args.file), lengths(SimConfig::default().requests.length_max_km)?)?;
    let [named] = &import.requests[..] else {
        bail!("{} holds {} strips: one is needed to replace one", args.file.display(), import.requests.len());
    };
    let request = msg::StripRequest { submitter: args.submitter.clone(), ..request_message(named) };
    let operator = Operator::start()?;
    let call = msg::ReplaceStripRequest { id: args.id, request };
    let result = operator.desk(&graph::REPLACE_STRIP)?.call(call)?.result;
    print_result(&named.name, "accepted", &result, args.json)?;
    if !result.accepted {
        bail!("strip {} was not replaced", args.id);
    }
    Ok(())
}
