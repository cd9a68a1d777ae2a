//! `swath fault`: something is to fail while a mission flies.

use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, graph};

use super::client::Operator;
use super::files::printable;
use crate::place::Place;
use crate::requests::json::{time, time_json};

/// `swath fault`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  swath fault \"wheel2:weak 50%+300s\"                        # from now on, for 300 s of simulated time
  swath fault guidance:kill@1200s \"gyro:bias 0.01deg/s@1300s+60s\"
  swath fault planner:hang+10s --actor ana --json

An order is PART:WHAT@TIME+HOW LONG; docs/faults.md says what each part can.")]
pub struct FaultArgs {
    /// What is to fail, such as "wheel2:weak 50%@600s+300s"; without a time it begins at once.
    #[arg(required = true)]
    orders: Vec<String>,
    #[command(flatten)]
    place: Place,
    /// Who orders it.
    #[arg(long, default_value = "operator")]
    actor: String,
    /// Print JSON, one value an order.
    #[arg(long)]
    json: bool,
}

/// Runs `swath fault`.
///
/// # Errors
/// When no mission is flying, or an order is refused.
pub fn run(args: &FaultArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(&args.place.args(ros))?;
    let desk = operator.desk(&graph::ORDER_FAULT)?;
    let mut refused = 0;
    for order in &args.orders {
        let call = msg::OrderFaultRequest { fault: order.clone(), actor: args.actor.clone() };
        let answer = desk.call_once(msg::OrderFaultRequest::default(), call)?;
        refused += usize::from(!answer.accepted);
        out::print_line(if args.json { json(order, &answer) } else { text(order, &answer) })?;
    }
    match (refused, args.orders.len()) {
        (0, _) => Ok(()),
        (refused, count) => bail!("{refused} of {count} were refused"),
    }
}

fn json(order: &str, answer: &msg::OrderFaultResponse) -> String {
    let mut value = json!({ "order": order, "accepted": answer.accepted });
    if answer.accepted {
        value["fault"] = answer.fault.as_str().into();
        value["tick"] = answer.tick.into();
        value["begins"] = time_json(&answer.begins);
    } else {
        value["reason"] = answer.reason.as_str().into();
    }
    value.to_string()
}

fn text(order: &str, answer: &msg::OrderFaultResponse) -> String {
    match answer.accepted {
        true => format!("{} from {} on", printable(&answer.fault), time(&answer.begins)),
        false => format!("{}: refused: {}", printable(order), printable(&answer.reason)),
    }
}
