//! Checkpoints: a run's whole state in one file, from which it goes on exactly.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tch::Device;

use crate::config::RunConfig;
use crate::environment::Action;
use crate::error::{Result, TrainingError};
use crate::parameters::Layout;
use crate::rollout::SlotState;
use crate::store::{self, Content};
use crate::trainer::{LessonsState, Trainer, TrainerState};
use crate::weights::{Header, REVISION, VERSION, VERSION_LESSONS, check_same_run, flat_weights, header};

/// Bytes of a stored generator: seed, stream, position.
const RNG_BYTES: usize = 32 + 8 + 16;
/// What a file of weights alone calls itself.
const POLICY: &str = "policy";
/// Names of the tensors that hold the environments, and those that a teacher leads.
const ENVIRONMENTS: &str = "environments";
const LESSONS: &str = "lessons";

/// Writes everything that is needed to go on with the run.
///
/// # Errors
/// A file that cannot be written.
pub fn save(trainer: &Trainer, path: &Path) -> Result<()> {
    let state = trainer.present()?;
    let mut content = weights(trainer, &state, "checkpoint")?;
    content.insert("adam.first", &[state.first.len()], &state.first);
    content.insert("adam.second", &[state.second.len()], &state.second);
    content.insert("learner.rng", &[RNG_BYTES], &rng_bytes(&state.rng));
    insert_slots(&mut content, ENVIRONMENTS, &state.slots);
    if let Some(lessons) = &state.lessons {
        insert_slots(&mut content, LESSONS, &lessons.slots);
    }
    store::write_atomically(path, &content.to_bytes()?)
}

/// Writes the weights alone: a policy to fly.
///
/// # Errors
/// A file that cannot be written.
pub fn save_policy(trainer: &Trainer, path: &Path) -> Result<()> {
    let content = weights(trainer, trainer.present()?.as_ref(), POLICY)?;
    store::write_atomically(path, &content.to_bytes()?)
}

/// A run as a checkpoint has it.
///
/// # Errors
/// As [`load`] and [`Trainer::restore`].
pub fn resume(run: RunConfig, path: &Path, device: Device) -> Result<Trainer> {
    let state = load(path, &run, &Trainer::layout_of(&run)?)?;
    Trainer::restore(run, device, state)
}

/// Reads a checkpoint of `run`.
///
/// # Errors
/// A file that is damaged, is no checkpoint, or belongs to a run with other settings.
pub fn load(path: &Path, run: &RunConfig, layout: &Layout) -> Result<TrainerState> {
    let content = Content::read(path)?;
    let header = header(&content, path)?;
    if header.content != "checkpoint" {
        return Err(TrainingError::unsuitable(path, format!("it is a {}, not a checkpoint", header.content)));
    }
    check_same_run(&header.run, run, path)?;
    let lessons = |shown| slots(&content, LESSONS, path).map(|slots| LessonsState { shown, slots });
    let state = TrainerState {
        weights: flat_weights(&content, layout, path)?,
        first: content.numbers("adam.first", path)?,
        second: content.numbers("adam.second", path)?,
        adam_steps: header.adam_steps,
        kl_coefficient: f64::from_bits(header.kl_coefficient_bits),
        steps: header.steps,
        rng: rng_from(&content.numbers("learner.rng", path)?, path)?,
        slots: slots(&content, ENVIRONMENTS, path)?,
        lessons: header.lessons_shown.map(lessons).transpose()?,
    };
    let environments = run.rollout.environments;
    let mut sizes = vec![
        ("adam.first", state.first.len(), layout.count()),
        ("adam.second", state.second.len(), layout.count()),
        ("environments.rng", state.slots.len(), environments),
    ];
    // Before the first lesson there are no environments for it.
    let taught = state.lessons.as_ref().map(|it| it.slots.len()).filter(|&count| count > 0);
    sizes.extend(taught.map(|count| ("lessons.rng", count, environments)));
    for (name, found, wanted) in sizes {
        if found != wanted {
            let reason = format!("{name} has {found} entries instead of {wanted}");
            return Err(TrainingError::unsuitable(path, reason));
        }
    }
    Ok(state)
}

/// The newest checkpoint of a folder.
///
/// # Errors
/// When there is none.
pub fn newest(folder: &Path) -> Result<PathBuf> {
    let none = || TrainingError::NoCheckpoint { path: folder.to_path_buf() };
    list(folder)?.pop().ok_or_else(none)
}

/// The checkpoints of a folder, oldest first; none when the folder is not there.
///
/// # Errors
/// A folder that cannot be read.
pub fn list(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(found),
        entries => entries.map_err(TrainingError::file("read", folder))?,
    };
    for entry in entries {
        let path = entry.map_err(TrainingError::file("read", folder))?.path();
        let name = path.file_name().and_then(|name| name.to_str());
        let ours = |name: &str| name.starts_with("step-") || name.starts_with("lesson-");
        if name.is_some_and(|name| ours(name) && name.ends_with(".safetensors")) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The name of a trainer's checkpoint. Names sort by progress: those within a warm start come before the others.
#[must_use]
pub fn file_name(trainer: &Trainer) -> String {
    match trainer.lessons_shown() {
        Some(shown) => format!("lesson-{shown:012}.safetensors"),
        None => format!("step-{:012}.safetensors", trainer.steps()),
    }
}

fn weights(trainer: &Trainer, state: &TrainerState, content: &str) -> Result<Content> {
    let lessons_shown = state.lessons.as_ref().filter(|_| content != POLICY).map(|it| it.shown);
    let header = Header {
        content: content.into(),
        version: if lessons_shown.is_some() { VERSION_LESSONS } else { VERSION },
        run: trainer.run().clone(),
        steps: state.steps,
        revision: REVISION.into(),
        adam_steps: state.adam_steps,
        kl_coefficient_bits: state.kl_coefficient.to_bits(),
        lessons_shown,
    };
    let mut content = Content { header: store::json(&header)?, tensors: BTreeMap::new() };
    let mut offset = 0;
    for (name, shape) in trainer.layout().entries() {
        let shape: Vec<usize> = shape.iter().map(|&size| size as usize).collect();
        let length: usize = shape.iter().product();
        content.insert(name, &shape, &state.weights[offset..offset + length]);
        offset += length;
    }
    Ok(content)
}

fn insert_slots(content: &mut Content, group: &str, slots: &[SlotState]) {
    let name = |part: &str| format!("{group}.{part}");
    let rngs: Vec<u8> = slots.iter().flat_map(|slot| rng_bytes(&slot.rng)).collect();
    let seeds: Vec<u64> = slots.iter().map(|slot| slot.seed).collect();
    let lengths: Vec<u64> = slots.iter().map(|slot| slot.actions.len() as u64).collect();
    let actions = || slots.iter().flat_map(|slot| &slot.actions);
    // No episode is cut off after 0 decisions: 0 stands for none.
    let limits: Vec<u64> = slots.iter().map(|slot| slot.limit.unwrap_or(0)).collect();
    let tokens: Vec<u64> = actions().map(|action| action.token as u64).collect();
    let parameters: Vec<f64> = actions().map(|action| action.parameter).collect();
    content.insert(&name("rng"), &[slots.len(), RNG_BYTES], &rngs);
    content.insert(&name("seed"), &[slots.len()], &seeds);
    content.insert(&name("length"), &[slots.len()], &lengths);
    content.insert(&name("limit"), &[slots.len()], &limits);
    content.insert(&name("token"), &[tokens.len()], &tokens);
    content.insert(&name("parameter"), &[parameters.len()], &parameters);
}

fn slots(content: &Content, group: &str, path: &Path) -> Result<Vec<SlotState>> {
    let name = |part: &str| format!("{group}.{part}");
    let rngs: Vec<u8> = content.numbers(&name("rng"), path)?;
    let seeds: Vec<u64> = content.numbers(&name("seed"), path)?;
    let lengths: Vec<u64> = content.numbers(&name("length"), path)?;
    let limits: Vec<u64> = content.numbers(&name("limit"), path)?;
    let tokens: Vec<u64> = content.numbers(&name("token"), path)?;
    let parameters: Vec<f64> = content.numbers(&name("parameter"), path)?;
    let consistent = rngs.len() == seeds.len() * RNG_BYTES
        && lengths.len() == seeds.len()
        && limits.len() == seeds.len()
        && lengths.iter().sum::<u64>() == tokens.len() as u64
        && tokens.len() == parameters.len();
    if !consistent {
        return Err(TrainingError::unsuitable(path, format!("its tensors {group} do not fit each other")));
    }
    let mut actions =
        tokens.iter().zip(&parameters).map(|(&token, &parameter)| Action { token: token as usize, parameter });
    let mut slots = Vec::with_capacity(seeds.len());
    let rows = rngs.chunks(RNG_BYTES).zip(seeds).zip(lengths).zip(limits);
    for (((rng, seed), length), limit) in rows {
        slots.push(SlotState {
            rng: rng_from(rng, path)?,
            seed,
            actions: actions.by_ref().take(length as usize).collect(),
            limit: (limit > 0).then_some(limit),
        });
    }
    Ok(slots)
}

fn rng_bytes(rng: &ChaCha8Rng) -> Vec<u8> {
    let mut bytes = rng.get_seed().to_vec();
    bytes.extend(rng.get_stream().to_le_bytes());
    bytes.extend(rng.get_word_pos().to_le_bytes());
    bytes
}

fn rng_from(bytes: &[u8], path: &Path) -> Result<ChaCha8Rng> {
    let part = |from: usize, to: usize| bytes.get(from..to);
    let seed = part(0, 32).and_then(|it| <[u8; 32]>::try_from(it).ok());
    let stream = part(32, 40).and_then(|it| <[u8; 8]>::try_from(it).ok());
    let position = part(40, RNG_BYTES).and_then(|it| <[u8; 16]>::try_from(it).ok());
    let (Some(seed), Some(stream), Some(position)) = (seed, stream, position) else {
        return Err(TrainingError::unsuitable(path, "a generator's state is cut short"));
    };
    let mut rng = ChaCha8Rng::from_seed(seed);
    rng.set_stream(u64::from_le_bytes(stream));
    rng.set_word_pos(u128::from_le_bytes(position));
    Ok(rng)
}
