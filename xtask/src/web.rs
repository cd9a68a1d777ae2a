//! The console's page: its bundle is committed, so that nobody else needs npm.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::process;

/// Where the page's sources are.
const WEB: &str = "nodes/ground/console/web";

/// The README's picture.
const PICTURE: &str = "docs/console.png";
/// The test that takes it, and what it calls it.
const TEST: [&str; 2] = ["an_operators_day_in_the_console_alone", "console.png"];

/// Fetches the tools that the lock file names, runs the page's tests, and builds its bundle.
pub fn build(root: &Path) -> Result<()> {
    let web = root.join(WEB);
    for args in [&["ci", "--no-audit", "--no-fund"][..], &["test"], &["run", "build"]] {
        process::run(Command::new("npm").args(args).current_dir(&web))?;
    }
    Ok(())
}

/// Flies the test of an operator's day, and keeps the picture that it takes.
pub fn picture(root: &Path, python: &Path) -> Result<()> {
    let (folder, [test, name]) = (root.join("target/pictures"), TEST);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    process::run(process::cargo(root, "build").args(["--release", "--workspace", "--bins"]))?;
    let mut cargo = process::cargo(root, "test");
    cargo.args(["--release", "--workspace", "--test", "it", test]);
    process::run(cargo.env("SWATH_PYTHON", python).env("SWATH_PICTURES", &folder))?;
    let (taken, kept) = (folder.join(name), root.join(PICTURE));
    fs::copy(&taken, &kept).with_context(|| format!("cannot copy {} to {}", taken.display(), kept.display()))?;
    Ok(())
}
