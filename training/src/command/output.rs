//! What the commands print and write: tables to standard output, results as JSON, progress to standard error.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;
use swath_training::planners::PolicyOrigin;

/// Where JSON goes, if anywhere.
pub struct JsonTarget {
    path: Option<PathBuf>,
}

impl JsonTarget {
    /// A file that can be written, `-` for standard output, or nothing. What the file holds stays until
    /// [`JsonTarget::write`].
    ///
    /// # Errors
    /// A file that cannot be written: hours of flying later it would be too late.
    pub fn new(path: Option<&Path>) -> Result<Self> {
        let target = Self { path: path.map(Path::to_owned) };
        if let Some(path) = target.file() {
            writable(path).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(target)
    }

    /// Whether standard output is left to tables.
    pub fn leaves_stdout(&self) -> bool {
        self.path.as_deref() != Some(Path::new("-"))
    }

    /// Writes the results.
    pub fn write(&self, value: &Value) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        let text = serde_json::to_string_pretty(value).context("cannot write the results as JSON")? + "\n";
        match self.file() {
            Some(path) => fs::write(path, text).with_context(|| format!("cannot write {}", path.display())),
            None => print(&text).with_context(|| format!("cannot write {}", path.display())),
        }
    }

    fn file(&self) -> Option<&Path> {
        self.path.as_deref().filter(|_| self.leaves_stdout())
    }
}

fn writable(path: &Path) -> std::io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(_) => fs::remove_file(path),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            OpenOptions::new().append(true).open(path).map(|_| ())
        }
        Err(error) => Err(error),
    }
}

/// Prints a text to standard output; that nobody reads it, as behind `head`, is no reason to stop.
pub fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("cannot write to standard output"),
    }
}

/// Says something on standard error; that nobody listens is no reason to give up.
pub fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Tells that a policy was trained on another satellite, if it was.
pub fn tell_other_satellite(origin: &PolicyOrigin) {
    if let Some(warning) = origin.warning() {
        say(&format!("warning: {warning}"));
    }
}

/// A bar on standard error, which is drawn on terminals only.
pub fn bar(length: u64, template: &str) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template(template).context("the progress bar's template is not valid")?;
    Ok(ProgressBar::new(length).with_style(style))
}

/// A bar over missions.
pub fn missions_bar(count: u64) -> Result<ProgressBar> {
    bar(count, "{bar:30} {pos} of {len} missions flown, {elapsed} so far, {eta} left")
}
