//! MCAP's public conformance suite: how many of its 416 files a `swath-bag` reads right, and the `mcap` crate's reader.
//!
//! `conformance SWATH_BAG` prints one JSON object; `conformance --files DIRECTORY` writes the files.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example that cannot go on should panic")]

#[path = "../tests/it/common/conformance.rs"]
mod conformance;
#[path = "../tests/it/common/contents.rs"]
mod contents;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs, panic};

use contents::{Found, defined, found};
use serde_json::{Value, json};

/// What became of a file: `right`, `wrong` or `refused`.
type Counts = BTreeMap<&'static str, u64>;

fn main() {
    let args: Vec<_> = env::args_os().skip(1).collect();
    match &args[..] {
        [flag, directory] if flag == "--files" => write(Path::new(directory)),
        [program] => println!("{}", judge(Path::new(program))),
        _ => panic!("usage: conformance SWATH_BAG | --files DIRECTORY"),
    }
}

fn write(directory: &Path) {
    fs::create_dir_all(directory).unwrap();
    for file in conformance::files() {
        fs::write(directory.join(file.name), file.bytes).unwrap();
    }
}

fn judge(program: &Path) -> Value {
    let program = fs::canonicalize(program).unwrap();
    let temp = tempfile::tempdir().unwrap();
    let mut counts: BTreeMap<&str, Counts> = BTreeMap::new();
    panic::set_hook(Box::new(|_| ()));
    for file in conformance::files() {
        let defined = defined(&file.content);
        let path = temp.path().join(&file.name);
        fs::write(&path, &file.bytes).unwrap();
        let mut count = |what, outcome| *counts.entry(what).or_default().entry(outcome).or_default() += 1;
        let run = |words: &[&OsStr]| Command::new(&program).args(words).arg(&path).output().unwrap();
        count("info", outcome(&run(&["info".as_ref(), "--json".as_ref()]), |out| told_right(out, &defined)));
        count("cat", outcome(&run(&["cat".as_ref()]), |out| printed_right(out, &defined)));
        for command in ["filter", "recover"] {
            let new = path.with_extension(command);
            let words = ["-o".as_ref(), new.as_os_str(), "--compression".as_ref(), "none".as_ref()];
            let output = run(&[&[command.as_ref()], &words[..]].concat());
            count(command, outcome(&output, |_| fs::read(only_file(&new)).is_ok_and(|new| found(&new) == defined)));
        }
        let read = panic::catch_unwind(|| found(&file.bytes)).ok();
        count("mcap_crate", read.map_or("refused", |found| if found == defined { "right" } else { "wrong" }));
    }
    json!(counts)
}

/// Judges what a command printed, unless it refused the file.
fn outcome(output: &Output, right: impl Fn(&[u8]) -> bool) -> &'static str {
    match output.status.success() {
        true if right(&output.stdout) => "right",
        true => "wrong",
        false => "refused",
    }
}

fn told_right(out: &[u8], defined: &Found) -> bool {
    let Ok(told) = serde_json::from_slice::<Value>(out) else { return false };
    let times: Vec<u64> = defined.messages.iter().map(|message| message.1).collect();
    let topics: Vec<Value> = defined.channels.iter().map(|channel| json!([channel.0, times.len()])).collect();
    let found = told["topics"].as_array().unwrap().iter().map(|topic| json!([topic["name"], topic["messages"]]));
    let metadata: BTreeMap<_, _> = defined.metadata.iter().cloned().collect();
    found.collect::<Vec<_>>() == topics
        && told["messages"] == json!(times.len())
        && told["metadata"] == json!(metadata)
        && (times.is_empty() || told["start_ns"] == json!(times[0]) && told["end_ns"] == json!(times.last()))
}

fn printed_right(out: &[u8], defined: &Found) -> bool {
    let lines = out.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    let lines: Vec<Value> = lines.map(|line| serde_json::from_slice(line).unwrap_or_default()).collect();
    let printed = lines.iter().map(|line| json!([line["topic"], line["log_time_ns"], line["sequence"]]));
    let expected: Vec<Value> = defined.messages.iter().map(|it| json!([it.0, it.1, it.3])).collect();
    printed.collect::<Vec<_>>() == expected
}

/// The only file of a new bag.
fn only_file(dir: &Path) -> PathBuf {
    dir.join(format!("{}_0.mcap", dir.file_name().unwrap().to_str().unwrap()))
}
