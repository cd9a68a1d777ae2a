//! What long figures have in common: `--plan` tells how many seeds there are, `FIRST COUNT` measures some.

use std::ops::Range;

use anyhow::{Result, bail};
use serde_json::{Value, json};

/// Does what the command line asks for, one seed at a time, and prints one JSON object.
pub fn run(seeds: u64, measure: impl FnOnce(Range<u64>) -> Result<Value>) -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let result = match args[..] {
        ["--plan"] => json!({ "seeds": seeds, "chunk": 1 }),
        [first, count] => {
            let first: u64 = first.parse()?;
            measure(first..first + count.parse::<u64>()?)?
        }
        _ => bail!("expected --plan, or FIRST and COUNT"),
    };
    println!("{result}");
    Ok(())
}
