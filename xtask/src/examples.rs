//! Examples of the workspace's crates that measure something and print it as JSON.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::process;

/// Every example whose name begins so, as package and example, in the order of their names.
pub fn with_prefix(root: &Path, prefix: &str) -> Result<Vec<(String, String)>> {
    let mut cargo = process::cargo(root, "metadata");
    cargo.args(["--no-deps", "--format-version", "1"]);
    let metadata: Value = serde_json::from_slice(&output(&mut cargo)?).context("cargo metadata did not print JSON")?;
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let mut found = Vec::new();
    for package in packages {
        let targets = package["targets"].as_array().into_iter().flatten();
        for target in targets.filter(|target| is_example(target, prefix)) {
            if let (Some(package), Some(example)) = (package["name"].as_str(), target["name"].as_str()) {
                found.push((package.to_owned(), example.to_owned()));
            }
        }
    }
    found.sort();
    Ok(found)
}

fn is_example(target: &Value, prefix: &str) -> bool {
    let is_example = target["kind"].as_array().is_some_and(|kinds| kinds.contains(&"example".into()));
    is_example && target["name"].as_str().is_some_and(|name| name.starts_with(prefix))
}

/// What a command prints on stdout; its stderr is shown.
pub fn output(command: &mut Command) -> Result<Vec<u8>> {
    let output = command
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("cannot start {:?}", command.get_program()))?;
    if !output.status.success() {
        bail!("{command:?} failed: {}", output.status);
    }
    Ok(output.stdout)
}
