//! What `swath-bag` says: results on standard output, all else on standard error. That nobody reads it ends nothing.

use std::io::{self, ErrorKind, Write};
use std::path::Path;

use crate::error::{BagError, Result};

/// Prints a text to stdout; that nobody reads it, as behind `head`, is no reason to stop.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(BagError::io("write to", Path::new("standard output"))),
    }
}

/// Says a line on standard error.
pub fn say(line: &str) {
    // Where it cannot be said, there is no place to say so.
    _ = writeln!(io::stderr(), "{line}");
}
