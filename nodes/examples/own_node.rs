//! A node of one's own: it hears each task that the planner gives, and prints it.
//! `cargo run --release -p swath-nodes --example own_node -- --ros-args -r __ns:=/swath`, while a mission flies.
#![allow(clippy::print_stdout, reason = "an example")]

use std::time::Duration;

use swath_msgs::swath_msgs::ImagingTask;
use swath_ros::{Node, RosArgs, RosError, Shutdown, graph};

fn main() -> Result<(), RosError> {
    let (_words, args) = RosArgs::split(std::env::args())?;
    let node = Node::start("listener", &args)?;
    let shutdown = Shutdown::on_signals(node.signal())?;
    let tasks = node.subscription(&graph::PLANNER_TASK)?;
    node.parameters().check_given()?;
    while !shutdown.asked() {
        while let Some(ImagingTask { task, kind, strip, t_pre_ticks, wait_ticks, .. }) = tasks.take()? {
            match kind {
                ImagingTask::KIND_IMAGE => println!("task {task}: strip {} after {t_pre_ticks} ticks", strip.id),
                _ => println!("task {task}: wait {wait_ticks} ticks"),
            }
        }
        node.wait(Duration::from_millis(500))?;
    }
    Ok(())
}
