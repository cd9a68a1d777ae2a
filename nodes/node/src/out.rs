//! What programs say: results on standard output, all else on standard error. That nobody reads it ends nothing.

use std::fmt::Display;
use std::io::{ErrorKind, Write as _};

use anyhow::{Context, Result};

/// Prints a text; tells whether anybody may read what comes next: `head` has read enough.
///
/// # Errors
/// What cannot be written although somebody would read it, on a full disk.
pub fn print(text: &str) -> Result<bool> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        written => written.map(|()| true).context("cannot write to standard output"),
    }
}

/// Prints a line; tells whether anybody may read the next.
///
/// # Errors
/// As [`print`].
pub fn print_line(line: impl Display) -> Result<bool> {
    print(&format!("{line}\n"))
}

/// Says a line on standard error.
pub fn say(line: impl Display) {
    // Where it cannot be said, there is no place to say so.
    _ = writeln!(std::io::stderr(), "{line}");
}

/// An error with its causes; one that repeats what was said is left out.
#[must_use]
pub fn chain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        match text.is_empty() {
            true => text = cause,
            false if text.ends_with(&cause) => {}
            false => text = text + ": " + &cause,
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_are_told_once() {
        let error = anyhow::anyhow!("no such file").context("no such file").context("store a.sqlite: no such file");
        assert_eq!(chain(&error), "store a.sqlite: no such file");
        assert_eq!(chain(&error.context("cannot start")), "cannot start: store a.sqlite: no such file");
    }
}
