//! Orders as wholes: what each asks for, and how much of it is imaged.

use std::path::PathBuf;

use anyhow::{Result, bail};
use clap::Args;
use swath_node::out;
use swath_ros::RosArgs;

use super::client::Operator;
use super::files::printable;
use super::selection::{Common, pages};
use crate::requests::orders::{Orders, Whole, stored};
use crate::requests::store::Store;

/// `swath strips orders`.
#[derive(Debug, Args)]
pub struct OrdersArgs {
    #[command(flatten)]
    common: Common,
    /// The store of a mission that need not fly any more: `requests.sqlite` in its output folder.
    #[arg(long, conflicts_with_all = ["order", "state", "area"])]
    store: Option<PathBuf>,
    /// Print JSON lines.
    #[arg(long)]
    json: bool,
}

/// Lists orders, each with how much of it is imaged.
///
/// # Errors
/// When nobody answers, the store cannot be read, a filter is refused, or there is no such order.
pub fn orders(args: &OrdersArgs, ros: &RosArgs) -> Result<()> {
    let statuses: Vec<_> = match &args.store {
        Some(path) => {
            let statuses = stored(&Store::open_read_only(path)?)?.into_iter().map(|(_, status)| status);
            statuses.filter(|status| args.common.holds(status)).collect()
        }
        None => pages(&Operator::start(ros)?, &args.common)?,
    };
    let mut orders = Orders::default();
    for status in &statuses {
        orders.add(status);
    }
    if orders.is_empty() && args.common.is_one_order() {
        bail!("there is no such order");
    }
    if !args.json {
        let head = format!(
            "{:>7}  {:>6} {:>4} {:>9} {:>8}  {:<36}  submitter: name",
            "order", "strips", "prio", "imaged", "reward", "states"
        );
        if !out::print_line(head)? {
            return Ok(());
        }
    }
    for whole in orders.wholes() {
        let line = if args.json { whole.json().to_string() } else { line(whole) };
        if !out::print_line(line)? {
            break;
        }
    }
    Ok(())
}

/// A line of the list.
fn line(whole: &Whole) -> String {
    let states: Vec<_> = whole.states().into_iter().map(|(state, count)| format!("{count} {state}")).collect();
    let order = whole.outcome();
    format!(
        "{:>7}  {:>6} {:>4.2} {:>7.1} % {:>8.3}  {:<36}  {}: {}",
        order.order_id,
        order.strips,
        order.priority,
        100.0 * order.imaged,
        order.reward,
        states.join(", "),
        printable(&order.submitter),
        printable(&order.name),
    )
}
