//! Measurements: every example whose name begins with `bench_`, merged into one JSON object on stdout.
//!
//! Such an example prints one JSON object of numbers and nothing else on stdout.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

use crate::{examples, process};

/// Builds all binaries, runs each crate's measurements in turn and prints the union.
pub fn run(root: &Path) -> Result<()> {
    process::run(process::cargo(root, "build").args(["--quiet", "--release", "--workspace", "--bins"]))?;
    let mut all = Map::new();
    for (package, example) in examples::with_prefix(root, "bench_")? {
        eprintln!("measuring {package}");
        let mut cargo = process::cargo(root, "run");
        cargo.args(["--quiet", "--release", "--package", &package, "--example", &example]);
        let measured = examples::output(&mut cargo)?;
        let object = serde_json::from_slice(&measured)
            .with_context(|| format!("{example} of {package} did not print one JSON object"))?;
        merge(&mut all, object)?;
    }
    let text = serde_json::to_string_pretty(&all).context("cannot print the measurements")?;
    writeln!(std::io::stdout(), "{text}").context("cannot print the measurements")
}

fn merge(all: &mut Map<String, Value>, object: Map<String, Value>) -> Result<()> {
    for (key, value) in object {
        if all.contains_key(&key) {
            bail!("two crates measure {key}");
        }
        all.insert(key, value);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn one_key_measured_twice_is_an_error() {
        let mut all = Map::new();
        let object = |key: &str| Map::from_iter([(key.to_owned(), json!(1.0))]);
        merge(&mut all, object("a")).unwrap();
        merge(&mut all, object("b")).unwrap();
        assert_eq!(all.len(), 2);
        assert!(merge(&mut all, object("a")).is_err());
    }
}
