//! Measurements: every example whose name begins with `bench_`, merged into one JSON object on stdout.
//!
//! Such an example prints one JSON object of numbers and nothing else on stdout.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

use crate::process;

/// Builds all binaries, runs each crate's measurements in turn and prints the union.
pub fn run(root: &Path) -> Result<()> {
    process::run(process::cargo(root, "build").args(["--quiet", "--release", "--workspace", "--bins"]))?;
    let mut all = Map::new();
    for (package, example) in benches(root)? {
        eprintln!("measuring {package}");
        let mut cargo = process::cargo(root, "run");
        cargo.args(["--quiet", "--release", "--package", &package, "--example", &example]);
        let measured = output(&mut cargo)?;
        let object = serde_json::from_slice(&measured)
            .with_context(|| format!("{example} of {package} did not print one JSON object"))?;
        merge(&mut all, object)?;
    }
    let text = serde_json::to_string_pretty(&all).context("cannot print the measurements")?;
    writeln!(std::io::stdout(), "{text}").context("cannot print the measurements")
}

/// Every example whose name begins with `bench_`, as package and example.
fn benches(root: &Path) -> Result<Vec<(String, String)>> {
    let mut cargo = process::cargo(root, "metadata");
    cargo.args(["--no-deps", "--format-version", "1"]);
    let metadata: Value = serde_json::from_slice(&output(&mut cargo)?).context("cargo metadata did not print JSON")?;
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let mut found = Vec::new();
    for package in packages {
        for target in package["targets"].as_array().into_iter().flatten().filter(|target| is_bench(target)) {
            if let (Some(package), Some(example)) = (package["name"].as_str(), target["name"].as_str()) {
                found.push((package.to_owned(), example.to_owned()));
            }
        }
    }
    found.sort();
    Ok(found)
}

fn is_bench(target: &Value) -> bool {
    let is_example = target["kind"].as_array().is_some_and(|kinds| kinds.contains(&"example".into()));
    is_example && target["name"].as_str().is_some_and(|name| name.starts_with("bench_"))
}

fn output(command: &mut Command) -> Result<Vec<u8>> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    if !output.status.success() {
        bail!("{command:?} failed: {}", output.status);
    }
    Ok(output.stdout)
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
