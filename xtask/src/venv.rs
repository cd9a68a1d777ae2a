//! The Python environment of the tests: `.venv` with every `tests/requirements.txt` of the workspace.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::process;

/// The interpreter that tests find in `SWATH_PYTHON`.
pub fn python(root: &Path) -> PathBuf {
    root.join(".venv/bin/python")
}

/// Makes the environment, or brings it up to date when a requirements file has changed.
pub fn ensure(root: &Path) -> Result<()> {
    let files = requirement_files(root)?;
    let wanted = contents(&files)?;
    let stamp = root.join(".venv/swath-requirements.txt");
    if python(root).exists() && fs::read_to_string(&stamp).is_ok_and(|done| done == wanted) {
        return Ok(());
    }
    eprintln!("making the Python environment of the tests in .venv");
    process::run(Command::new("python3").args(["-m", "venv"]).arg(root.join(".venv")))?;
    if !files.is_empty() {
        let mut pip = Command::new(python(root));
        pip.args(["-m", "pip", "install", "--quiet"]);
        pip.arg("--disable-pip-version-check");
        for file in &files {
            pip.arg("--requirement").arg(file);
        }
        process::run(&mut pip)?;
    }
    fs::write(&stamp, wanted).with_context(|| format!("cannot write {}", stamp.display()))
}

/// `tests/requirements.txt` in folders up to three deep, in the order of their paths.
fn requirement_files(root: &Path) -> Result<Vec<PathBuf>> {
    let (mut folders, mut deepest) = (Vec::new(), vec![root.to_owned()]);
    for _ in 0..3 {
        let inside = deepest.iter().map(|folder| subfolders(folder)).collect::<Result<Vec<_>>>()?;
        deepest = inside.into_iter().flatten().collect();
        folders.extend(deepest.clone());
    }
    let mut files: Vec<PathBuf> =
        folders.iter().map(|folder| folder.join("tests/requirements.txt")).filter(|file| file.is_file()).collect();
    files.sort();
    Ok(files)
}

fn subfolders(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    for entry in entries {
        let entry = entry.with_context(|| format!("cannot read {}", folder.display()))?;
        let name = entry.file_name();
        let skipped = ["target", "libtorch", "libtorch.partial", "out"].iter().any(|skip| name == *skip);
        let hidden = name.to_string_lossy().starts_with('.');
        if !skipped && !hidden && entry.path().is_dir() {
            found.push(entry.path());
        }
    }
    Ok(found)
}

fn contents(files: &[PathBuf]) -> Result<String> {
    let mut text = String::new();
    for file in files {
        text += &fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
        text.push('\n');
    }
    Ok(text)
}
