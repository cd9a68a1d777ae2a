//! Starting other programs, with errors that name the command line.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Error, Result, bail};

/// A cargo command on this workspace, from wherever the caller stands.
pub fn cargo(root: &Path, subcommand: &str) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.arg(subcommand);
    command.arg("--manifest-path").arg(root.join("Cargo.toml"));
    command
}

/// Runs to the end; an exit status other than 0 is an error.
pub fn run(command: &mut Command) -> Result<()> {
    let line = line(command);
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` failed: {status}");
    }
    Ok(())
}

/// Replaces this process; returns only if that fails.
pub fn become_command(command: &mut Command) -> Error {
    let line = line(command);
    Error::new(command.exec()).context(format!("cannot start `{line}`"))
}

/// Waits until no other set-up works on this repository; the file is unlocked when dropped.
pub fn lock(root: &Path) -> Result<File> {
    let path = root.join("target").join("xtask.lock");
    std::fs::create_dir_all(root.join("target")).context("cannot make the target folder")?;
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    file.lock().with_context(|| format!("cannot lock {}", path.display()))?;
    Ok(file)
}

fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words: Vec<_> = words.map(|word| word.to_string_lossy()).collect();
    words.join(" ")
}
