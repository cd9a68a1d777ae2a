//! Writes the 416 files of MCAP's public conformance suite: `conformance_files DIRECTORY`.
#![allow(clippy::unwrap_used, reason = "an example that cannot go on should panic")]

#[path = "../tests/it/common/conformance.rs"]
mod conformance;

use std::{env, fs, path::PathBuf};

fn main() {
    let to: PathBuf = env::args_os().nth(1).unwrap().into();
    fs::create_dir_all(&to).unwrap();
    for file in conformance::files() {
        fs::write(to.join(file.name), file.bytes).unwrap();
    }
}
