//! Reading a bag: how many messages each topic has, and the first of each as JSON.
//! `cargo run --release -p swath-bags --example read_bag -- bags/samples/mission`
#![allow(clippy::print_stdout, reason = "an example")]

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use swath_bags::schema::to_json;
use swath_bags::{Bag, Filter};

fn main() -> Result<()> {
    let path = std::env::args_os().nth(1).context("which bag?")?;
    let bag = Bag::open(Path::new(&path))?;
    let mut counts = BTreeMap::new();
    let mut messages = bag.messages(&Filter::default())?;
    while let Some(message) = messages.next()? {
        let count = counts.entry(message.topic).or_insert(0);
        if *count == 0 {
            let topic = &bag.topics()[message.topic];
            let mut json = Vec::new();
            to_json(&topic.parse_schema()?, message.data, &mut json)?;
            println!("{:12} ns {}: {}", message.log_time, topic.topic.name, String::from_utf8_lossy(&json));
        }
        *count += 1;
    }
    for (topic, count) in counts {
        println!("{count:8} {}", bag.topics()[topic].topic.name);
    }
    Ok(())
}
