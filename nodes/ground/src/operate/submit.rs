//! Commands that change requests.

use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use clap::Args;
use swath_msgs::swath_msgs as msg;
use swath_ros::{RosArgs, graph};

use super::client::{Operator, check};
use super::files::{CuttingArgs, Files, cut_json, cut_text, write_file};
use super::selection::{Actor, Common, Selection};
use super::show::print_result;
use crate::requests::json::state_name;
use swath_node::orders::request_message;
use swath_node::out;

/// Requests in one call.
const BATCH: usize = 500;

/// `swath strips submit`.
#[derive(Debug, Args)]
pub struct SubmitArgs {
    /// Files with lines and areas, `-` for standard input: GeoJSON, KML, GPX, WKT, CSV, Shapefile, FlatGeobuf or
    /// GeoPackage.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Who submits.
    #[arg(long, default_value = "operator")]
    submitter: String,
    #[command(flatten)]
    cutting: CuttingArgs,
    /// Let all of them wait for approval.
    #[arg(long)]
    hold: bool,
    /// Only read and cut.
    #[arg(long)]
    dry_run: bool,
    /// Write the strips to this file, as GeoJSON.
    #[arg(short, long)]
    out: Option<PathBuf>,
    /// Print the answers as JSON lines, the report last.
    #[arg(long)]
    json: bool,
}

/// `swath strips cancel`, `hold`, `release` and `reject`.
#[derive(Debug, Args)]
pub struct DecideArgs {
    #[command(flatten)]
    strips: Selection,
    #[command(flatten)]
    actor: Actor,
    /// Print the answers as JSON lines.
    #[arg(long)]
    json: bool,
}

/// `swath strips replace`.
#[derive(Debug, Args)]
pub struct ReplaceArgs {
    /// Number of the strip, or of an order with --whole-order; without it, --ref and so on say which. And the file with
    /// the line or area that is wanted instead.
    #[arg(required = true, num_args = 1..=2, value_names = ["ID", "FILE"])]
    words: Vec<String>,
    /// Replace all strips that are meant and not over, such as those of the order of that number.
    #[arg(long)]
    whole_order: bool,
    #[command(flatten)]
    meant: Common,
    #[command(flatten)]
    cutting: CuttingArgs,
    /// Print the answer as JSON.
    #[arg(long)]
    json: bool,
}

impl ReplaceArgs {
    /// What is meant by number, if anything is, and the file.
    fn number_and_file(&self) -> Result<(Option<u64>, PathBuf)> {
        let Some((file, number)) = self.words.split_last() else { bail!("a file is needed") };
        let number = number.first().map(|it| it.parse().with_context(|| format!("{it} is no number of a strip")));
        Ok((number.transpose()?, file.into()))
    }

    /// The strips that are replaced.
    fn old(&self, number: Option<u64>, operator: &Operator) -> Result<Vec<u64>> {
        let old = match number {
            Some(order) if self.whole_order => Selection::of_order(order).find(operator)?,
            Some(strip) => vec![strip],
            None => Selection::having(self.meant.clone()).find(operator)?,
        };
        if old.len() > 1 && !self.whole_order {
            bail!("{} strips are meant: --whole-order replaces all of them", old.len());
        }
        Ok(old)
    }
}

/// Submits the strips of files, and reports what became of every line.
///
/// # Errors
/// When a file cannot be used, nobody answers, or something is refused.
pub fn submit(args: &SubmitArgs, ros: &RosArgs) -> Result<()> {
    args.cutting.usual()?;
    let files = Files::read(&args.files)?;
    let operator = if args.dry_run || files.shapes() == 0 { None } else { Some(Operator::start(ros)?) };
    let cutting = match &operator {
        Some(operator) => match args.cutting.of_mission(operator) {
            Ok(cutting) => cutting,
            Err(error) => {
                // What is wrong with the files is told although nobody answers.
                _ = files.cut(&args.cutting.usual()?);
                return Err(error);
            }
        },
        None if files.shapes() == 0 => args.cutting.usual()?,
        None => args.cutting.of_any(ros)?,
    };
    let mut import = files.cut(&cutting);
    for order in &mut import.orders {
        order.submitter.clone_from(&args.submitter);
        order.hold_for_approval |= args.hold;
    }
    if let Some(path) = &args.out {
        write_file(path, &import)?;
    }
    let strips = import.orders.len();
    let (mut accepted, mut refused) = (0, 0);
    if let Some(operator) = operator.filter(|_| strips > 0) {
        let desk = operator.desk(&graph::SUBMIT_STRIPS)?;
        for batch in import.orders.chunks(BATCH) {
            let requests = batch.iter().map(request_message).collect::<Vec<_>>();
            let answer = desk.call(msg::SubmitStripsRequest { requests })?;
            check(answer.reason_code, &answer.reason)?;
            for (order, result) in batch.iter().zip(&answer.results) {
                *if result.accepted { &mut accepted } else { &mut refused } += 1;
                print_result(&order.name, &taken(result), result, args.json)?;
            }
        }
    }
    if args.json {
        let report = serde_json::json!({
            "shapes": import.shapes, "cut": cut_json(&import.cut), "strips": strips, "accepted": accepted,
            "refused": refused, "parts_refused": import.refused.len(),
        });
        out::print_line(report)?;
    } else {
        out::print_line(format_args!(
            "{}{} lines and areas: {strips} strips: {accepted} accepted, {refused} refused",
            cut_text(&import.cut),
            import.shapes,
        ))?;
    }
    match refused + import.refused.len() {
        0 => Ok(()),
        _ => bail!("{refused} of {strips} strips and {} parts of files were refused", import.refused.len()),
    }
}

/// What to call a request that was taken; one that was known before says so.
fn taken(result: &msg::SubmitResult) -> String {
    let state = state_name(result.state);
    if result.known { format!("known, {state}") } else { state.to_owned() }
}

/// Takes strips back.
///
/// # Errors
/// When nobody answers or something is refused.
pub fn cancel(args: &DecideArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(ros)?;
    let Actor { actor, reason } = &args.actor;
    let ids = args.strips.find(&operator)?;
    let call = msg::CancelStripsRequest { ids: ids.clone(), actor: actor.clone(), reason: reason.clone() };
    let answer = operator.desk(&graph::CANCEL_STRIPS)?.call_once(Default::default(), call)?;
    check(answer.reason_code, &answer.reason)?;
    tell(args, &ids, "cancelled", &answer.results)
}

/// Holds, releases or rejects strips.
///
/// # Errors
/// When nobody answers or something is refused.
pub fn review(args: &DecideArgs, ros: &RosArgs, action: u8) -> Result<()> {
    let operator = Operator::start(ros)?;
    let Actor { actor, reason } = &args.actor;
    let ids = args.strips.find(&operator)?;
    let call = msg::ReviewStripsRequest { ids: ids.clone(), action, actor: actor.clone(), reason: reason.clone() };
    let answer = operator.desk(&graph::REVIEW_STRIPS)?.call_once(Default::default(), call)?;
    check(answer.reason_code, &answer.reason)?;
    let done = match action {
        msg::ReviewStripsRequest::ACTION_HOLD => "held",
        msg::ReviewStripsRequest::ACTION_RELEASE => "released",
        _ => "rejected",
    };
    tell(args, &ids, done, &answer.results)
}

fn tell(args: &DecideArgs, ids: &[u64], done: &str, results: &[msg::SubmitResult]) -> Result<()> {
    for (id, result) in ids.iter().zip(results) {
        print_result(&format!("strip {id}"), done, result, args.json)?;
    }
    match results.iter().filter(|result| !result.accepted).count() {
        0 => Ok(()),
        refused => bail!("{refused} of {} were refused", results.len()),
    }
}

/// Replaces a strip, or an order with all of its strips.
///
/// # Errors
/// When the file does not hold one line or area, or several strips for one, when nobody answers, or something is refused.
pub fn replace(args: &ReplaceArgs, ros: &RosArgs) -> Result<()> {
    let (number, file) = args.number_and_file()?;
    let files = Files::read(std::slice::from_ref(&file))?;
    if files.shapes() != 1 {
        bail!("{} holds {} lines and areas: one is needed in the place of one", file.display(), files.shapes());
    }
    let operator = Operator::start(ros)?;
    let mut import = files.cut(&args.cutting.of_mission(&operator)?);
    let submitter = args.meant.submitter.clone().unwrap_or_else(|| "operator".to_owned());
    for order in &mut import.orders {
        order.submitter.clone_from(&submitter);
    }
    if !args.whole_order && import.orders.len() != 1 {
        bail!("{} becomes {} strips: one is needed to replace one", file.display(), import.orders.len());
    }
    let old = args.old(number, &operator)?;
    let desk = operator.desk(&graph::REPLACE_STRIP)?;
    let mut refused = import.refused.len();
    let mut tell = |name: &str, done: &str, result: &msg::SubmitResult| {
        refused += usize::from(!result.accepted);
        print_result(name, done, result, args.json)
    };
    // Strip by strip, so that none is lost on the way: what is new comes before what is left of the old one goes.
    for (id, order) in old.iter().zip(&import.orders) {
        let result = desk.call(msg::ReplaceStripRequest { id: *id, request: request_message(order) })?.result;
        tell(&order.name, &taken(&result), &result)?;
    }
    let (new, rest) = (import.orders.get(old.len()..), old.get(import.orders.len()..));
    if let Some(new @ [_, ..]) = new {
        let requests = new.iter().map(request_message).collect::<Vec<_>>();
        let answer = operator.desk(&graph::SUBMIT_STRIPS)?.call(msg::SubmitStripsRequest { requests })?;
        check(answer.reason_code, &answer.reason)?;
        for (order, result) in new.iter().zip(&answer.results) {
            tell(&order.name, &taken(result), result)?;
        }
    }
    if let Some(rest @ [_, ..]) = rest {
        let (actor, reason) = (submitter, "its order was replaced".to_owned());
        let call = msg::CancelStripsRequest { ids: rest.to_vec(), actor, reason };
        let answer = operator.desk(&graph::CANCEL_STRIPS)?.call_once(Default::default(), call)?;
        check(answer.reason_code, &answer.reason)?;
        for (id, result) in rest.iter().zip(&answer.results) {
            tell(&format!("strip {id}"), "cancelled", result)?;
        }
    }
    if refused > 0 {
        bail!("{refused} strips were refused");
    }
    Ok(())
}
