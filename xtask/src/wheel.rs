//! The Python package: built into one wheel, installed and tested in the environment of the tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::{process, venv};

/// Builds the wheel and says where it is.
pub fn build(root: &Path) -> Result<PathBuf> {
    let folder = root.join("target/wheels");
    if folder.exists() {
        // Else the wheel of another version would be found beside the one that is built.
        fs::remove_dir_all(&folder).with_context(|| format!("cannot empty {}", folder.display()))?;
    }
    let python = venv::python(root);
    let mut maturin = Command::new(&python);
    maturin.args(["-m", "maturin", "build", "--quiet", "--release", "--locked"]);
    maturin.arg("--manifest-path").arg(root.join("python/Cargo.toml"));
    maturin.arg("--interpreter").arg(&python).arg("--out").arg(&folder);
    process::run(&mut maturin).context("the wheel cannot be built")?;
    let entries = fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut wheels = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let wheel = wheels.find(|path| path.extension().is_some_and(|extension| extension == "whl"));
    wheel.with_context(|| format!("no wheel was built in {}", folder.display()))
}

/// Installs the wheel into the environment of the tests, over one that is there.
pub fn install(root: &Path, wheel: &Path) -> Result<()> {
    let mut pip = Command::new(venv::python(root));
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--force-reinstall", "--no-deps"]);
    process::run(pip.arg(wheel)).context("the wheel cannot be installed")
}

/// Runs the package's tests on the wheel that is installed.
pub fn test(root: &Path, wheel: &Path) -> Result<()> {
    let mut pytest = Command::new(venv::python(root));
    // Beside the sources of the package Python would find them instead of what is installed.
    pytest.args(["-m", "pytest", "--quiet"]).current_dir(root.join("python/tests"));
    process::run(pytest.env("SWATH_WHEEL", wheel))
}

/// Builds the wheel, installs it into an environment of its own with what the long examples need, and runs them.
pub fn soak(root: &Path) -> Result<()> {
    let wheel = build(root)?;
    let environment = root.join("target/soak-python");
    process::run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
    let python = environment.join("bin/python");
    let examples = root.join("python/examples/soak");
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    process::run(pip.arg("--requirement").arg(examples.join("requirements.txt")).arg(&wheel))?;
    let entries = fs::read_dir(&examples).with_context(|| format!("cannot read {}", examples.display()))?;
    let mut programs: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "py"))
        .collect();
    programs.sort();
    if programs.is_empty() {
        bail!("{} holds no program", examples.display());
    }
    for program in programs {
        eprintln!("running {}", program.display());
        process::run(Command::new(&python).arg(&program))?;
    }
    Ok(())
}
