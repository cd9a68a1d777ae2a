//! The console's page: its bundle is committed, so that nobody else needs npm.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::process;

/// Where the page's sources are.
const WEB: &str = "nodes/ground/console/web";

/// Fetches the tools that the lock file names, runs the page's tests, and builds its bundle.
pub fn build(root: &Path) -> Result<()> {
    let web = root.join(WEB);
    for args in [&["ci", "--no-audit", "--no-fund"][..], &["test"], &["run", "build"]] {
        process::run(Command::new("npm").args(args).current_dir(&web))?;
    }
    Ok(())
}
