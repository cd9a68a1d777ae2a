//! Files of weights: what each says about itself, and its weights in the layout's order.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::config::RunConfig;
use crate::error::{Result, TrainingError};
use crate::parameters::Layout;
use crate::store::Content;

/// The program's revision in version control.
pub const REVISION: &str = env!("SWATH_REVISION");

/// What a file of weights says about itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// `checkpoint` or `policy`.
    pub content: String,
    /// Version of the file's structure.
    pub version: u32,
    /// The run that made it.
    pub run: RunConfig,
    /// Environment steps taken.
    pub steps: u64,
    /// Revision of the program that wrote it.
    pub revision: String,
    /// Adam's steps.
    pub adam_steps: u64,
    /// Bits of the KL penalty's weight.
    pub kl_coefficient_bits: u64,
    /// Decisions that a warm start has shown, while it is not over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lessons_shown: Option<u64>,
}

/// Version of files as they are written.
pub(crate) const VERSION: u32 = 1;
/// Version of checkpoints within a warm start, which programs that know version 1 alone would take for its end.
pub(crate) const VERSION_LESSONS: u32 = 2;
/// The weights of a policy or checkpoint whose network and observation are those of `run`.
///
/// # Errors
/// A file that is damaged, or whose network or environment has other settings.
pub fn load_weights(path: &Path, run: &RunConfig, layout: &Layout) -> Result<Vec<f32>> {
    let content = Content::read(path)?;
    let found = header(&content, path)?.run;
    let same_problem = RunConfig { network: found.network, environment: found.environment, ..run.clone() };
    check_same_run(&same_problem, run, path)?;
    flat_weights(&content, layout, path)
}

/// The header of a checkpoint or policy.
///
/// # Errors
/// A file of another version.
pub fn header(content: &Content, path: &Path) -> Result<Header> {
    // The digest was right, so whatever is wrong was written so: it is another version's, not damaged.
    let header: Header = serde_json::from_str(&content.header).map_err(|error| {
        TrainingError::unsuitable(path, format!("another version of swath-train wrote it: {error}"))
    })?;
    if ![VERSION, VERSION_LESSONS].contains(&header.version) {
        let reason = format!("its version is {}, this program reads {VERSION} and {VERSION_LESSONS}", header.version);
        return Err(TrainingError::unsuitable(path, reason));
    }
    Ok(header)
}

/// The weights of a file as one vector in the layout's order.
///
/// # Errors
/// A tensor that is missing or has another size.
pub fn flat_weights(content: &Content, layout: &Layout, path: &Path) -> Result<Vec<f32>> {
    let mut flat = Vec::with_capacity(layout.count());
    for (name, shape) in layout.entries() {
        let numbers: Vec<f32> = content.numbers(name, path)?;
        let wanted = shape.iter().product::<i64>() as usize;
        if numbers.len() != wanted {
            let reason = format!("{name} has {} numbers instead of {wanted}", numbers.len());
            return Err(TrainingError::unsuitable(path, reason));
        }
        flat.extend(numbers);
    }
    Ok(flat)
}

/// Settings that may differ between a checkpoint and the run that goes on from it.
const MAY_DIFFER: [&str; 3] = ["name", "steps", "checkpoint_every"];

pub(crate) fn check_same_run(found: &RunConfig, wanted: &RunConfig, path: &Path) -> Result<()> {
    let (found, wanted) = (settings(found)?, settings(wanted)?);
    let keys = found.keys().chain(wanted.keys()).filter(|key| !MAY_DIFFER.contains(&key.as_str()));
    let Some(key) = keys.filter(|key| found.get(*key) != wanted.get(*key)).min() else {
        return Ok(());
    };
    let shown = |entries: &BTreeMap<String, Value>| entries.get(key).map_or_else(|| "absent".into(), Value::to_string);
    Err(TrainingError::Mismatch {
        path: path.to_path_buf(),
        key: key.clone(),
        found: shown(&found),
        wanted: shown(&wanted),
    })
}

/// Dotted keys and values of a configuration; what is absent in it is absent here.
///
/// # Errors
/// A configuration that JSON cannot hold.
pub(crate) fn settings(configuration: &impl Serialize) -> Result<BTreeMap<String, Value>> {
    let value = serde_json::to_value(configuration).map_err(TrainingError::environment)?;
    let mut entries = BTreeMap::new();
    flatten("", value, &mut entries);
    Ok(entries)
}

fn flatten(prefix: &str, value: Value, entries: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                let dot = if prefix.is_empty() { "" } else { "." };
                flatten(&format!("{prefix}{dot}{key}"), value, entries);
            }
        }
        Value::Null => {}
        value => {
            entries.insert(prefix.to_owned(), value);
        }
    }
}
