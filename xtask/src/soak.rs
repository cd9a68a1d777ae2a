//! Long figures: every example whose name begins with `soak_`, run piece by piece, so that one that was stopped goes on.
//!
//! Such an example prints its plan for `--plan`, `{"seeds": 1000000, "chunk": 10000}`, and for `FIRST COUNT` what it
//! found at those seeds, as one JSON object; it exits with another status than 0 where that is a failure. Pieces that
//! are done stand in `target/soak/NAME.jsonl`. Over all pieces numbers are added, lists joined, and of keys that begin
//! with `max_` the greatest is taken.

use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value, json};

use crate::{examples, process};

type Object = Map<String, Value>;

/// Runs the named figure to its end and prints it, or lists what there is.
pub fn run(root: &Path, args: &[OsString]) -> Result<()> {
    let found = examples::with_prefix(root, "soak_")?;
    let names = || found.iter().map(|(_, example)| example.trim_start_matches("soak_")).collect::<Vec<_>>().join(", ");
    let (name, seeds) = match args {
        [] => bail!("soak takes one of: {}", names()),
        [name] => (name, None),
        [name, seeds] => (name, Some(number(seeds)?)),
        _ => bail!("soak takes a name and a number of seeds"),
    };
    let name = name.to_string_lossy();
    let wanted = format!("soak_{name}");
    let Some((package, example)) = found.iter().find(|(_, example)| *example == wanted) else {
        bail!("there is no soak {name}: there are {}", names());
    };
    process::run(process::cargo(root, "build").args(["--quiet", "--release", "--workspace", "--bins"]))?;
    let call = |words: &[String]| -> Result<Object> {
        let mut cargo = process::cargo(root, "run");
        cargo.args(["--quiet", "--release", "--package", package, "--example", example, "--"]).args(words);
        let said = examples::output(&mut cargo)?;
        serde_json::from_slice(&said).with_context(|| format!("{example} did not print one JSON object"))
    };
    let plan = call(&["--plan".to_owned()])?;
    let wanted =
        |key: &str| plan.get(key).and_then(Value::as_u64).filter(|it| *it > 0).context("a plan without numbers");
    let (seeds, chunk) = (seeds.map_or_else(|| wanted("seeds"), Ok)?, wanted("chunk")?);
    let done = root.join("target/soak").join(format!("{name}.jsonl"));
    pieces(&done, seeds, chunk, |first, count| {
        eprintln!("{name}: seeds {first} to {} of {seeds}", first + count - 1);
        call(&[first.to_string(), count.to_string()])
    })
}

/// Reads a number of seeds or of inputs, with `_` where it helps to read.
pub fn number(text: &OsString) -> Result<u64> {
    let number = text.to_str().and_then(|it| it.replace('_', "").parse().ok());
    number.filter(|it| *it > 0).with_context(|| format!("{} is no number above 0", text.display()))
}

/// Does the pieces that are not in the file yet, and prints the whole.
fn pieces(done: &Path, seeds: u64, chunk: u64, mut run: impl FnMut(u64, u64) -> Result<Object>) -> Result<()> {
    if let Some(folder) = done.parent() {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let before = read(done)?;
    let mut file = OpenOptions::new().create(true).append(true).open(done);
    let file = file.as_mut().map_err(|error| anyhow::anyhow!("cannot write {}: {error}", done.display()))?;
    let mut whole = Object::new();
    for first in (0..seeds).step_by(usize::try_from(chunk)?) {
        let count = chunk.min(seeds - first);
        let key = json!([first, count]);
        let found = match before.iter().find(|piece| piece["seeds"] == key) {
            Some(piece) => piece["found"].as_object().cloned().unwrap_or_default(),
            None => {
                let found = run(first, count)?;
                let line = json!({ "seeds": key, "found": found });
                writeln!(file, "{line}").with_context(|| format!("cannot write {}", done.display()))?;
                found
            }
        };
        add(&mut whole, found)?;
    }
    whole.insert("seeds".into(), seeds.into());
    let text = serde_json::to_string_pretty(&whole).context("cannot print the figures")?;
    writeln!(std::io::stdout(), "{text}").context("cannot print the figures")
}

/// Pieces that were finished; a torn last line is none.
fn read(done: &Path) -> Result<Vec<Value>> {
    match fs::read_to_string(done) {
        Ok(text) => Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", done.display())),
    }
}

fn add(whole: &mut Object, piece: Object) -> Result<()> {
    for (key, value) in piece {
        let Some(before) = whole.get_mut(&key) else {
            whole.insert(key, value);
            continue;
        };
        match (&mut *before, value) {
            (Value::Array(all), Value::Array(more)) => all.extend(more),
            (Value::Number(all), Value::Number(more)) => {
                let (all, more) = (Value::Number(all.clone()), Value::Number(more));
                *before = joined(&key, &all, &more).with_context(|| format!("{key} cannot be added"))?;
            }
            (before, value) if *before == value => {}
            _ => bail!("two pieces differ in {key}"),
        }
    }
    Ok(())
}

fn joined(key: &str, all: &Value, more: &Value) -> Option<Value> {
    let greatest = key.starts_with("max_");
    Some(match (all.as_u64(), more.as_u64()) {
        (Some(all), Some(more)) if greatest => all.max(more).into(),
        (Some(all), Some(more)) => all.checked_add(more)?.into(),
        _ if greatest => all.as_f64()?.max(more.as_f64()?).into(),
        _ => (all.as_f64()? + more.as_f64()?).into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_was_stopped_goes_on_and_the_pieces_are_added_up() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("soak/figure.jsonl");
        let mut asked = Vec::new();
        let mut found = |first: u64, count: u64| {
            asked.push((first, count));
            anyhow::ensure!(first < 20, "stopped");
            Ok(json!({ "flown": count, "max_late_s": first, "failed": [first] }).as_object().unwrap().clone())
        };
        assert!(pieces(&file, 25, 10, &mut found).is_err());
        let again = |first: u64, count: u64| {
            assert_eq!((first, count), (20, 5));
            Ok(Object::new())
        };
        pieces(&file, 25, 10, again).unwrap();
        assert_eq!(asked, [(0, 10), (10, 10), (20, 5)]);
        let mut whole = Object::new();
        for piece in read(&file).unwrap() {
            add(&mut whole, piece["found"].as_object().unwrap().clone()).unwrap();
        }
        assert_eq!(Value::Object(whole), json!({ "flown": 20, "max_late_s": 10, "failed": [0, 10] }));
    }
}
