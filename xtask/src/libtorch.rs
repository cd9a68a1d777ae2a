//! The libtorch view: headers and CPU libraries of PyTorch 2.11, unpacked from the wheels that pip fetches.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process;

const VERSION: &str = "2.11.0";
const PLATFORMS: [&str; 3] = ["manylinux_2_28_x86_64", "manylinux_2_25_x86_64", "manylinux2014_x86_64"];

/// Makes `libtorch/` if it is not there; a LIBTORCH of the caller's own wins.
///
/// Steps that were done before an interruption are not done again, and the view appears under its
/// name only when it is complete.
pub fn ensure(root: &Path) -> Result<()> {
    let view = root.join("libtorch");
    if let Some(own) = std::env::var_os("LIBTORCH").filter(|own| Path::new(own) != view) {
        return check_version(Path::new(&own)).context("LIBTORCH is set by the caller");
    }
    if view.exists() {
        return check_version(&view).with_context(|| format!("remove {} to have it made again", view.display()));
    }
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        bail!("set LIBTORCH to a libtorch {VERSION}: it is fetched for x86-64 Linux only");
    }
    let partial = root.join("libtorch.partial");
    let (wheels, unpacked) = (partial.join("wheels"), partial.join("view"));
    fs::create_dir_all(&wheels).with_context(|| format!("cannot make {}", wheels.display()))?;
    eprintln!("fetching libtorch {VERSION} with pip (543 MB, once)");
    download(root, &wheels)?;
    eprintln!("unpacking libtorch");
    unpack(&wheels, &unpacked)?;
    fs::rename(&unpacked, &view).context("cannot move the libtorch view to its place")?;
    fs::remove_dir_all(&partial).context("cannot remove the fetched wheels")?;
    check_version(&view)
}

fn check_version(view: &Path) -> Result<()> {
    let path = view.join("build-version");
    let found =
        fs::read_to_string(&path).with_context(|| format!("{} is no libtorch: cannot read it", path.display()))?;
    // A build for the CPU alone calls itself 2.11.0+cpu.
    let version = found.trim().split('+').next().unwrap_or_default();
    if version != VERSION {
        bail!("{} holds libtorch {}, not {VERSION}", view.display(), found.trim());
    }
    Ok(())
}

fn download(root: &Path, wheels: &Path) -> Result<()> {
    let mut pip = Command::new("python3");
    pip.args(["-m", "pip", "download", "--no-deps", "--require-hashes"]);
    pip.args(["--only-binary=:all:", "--disable-pip-version-check"]);
    pip.args(["--implementation", "cp", "--python-version", "3.11"]);
    pip.args(["--abi", "cp311", "--abi", "none"]);
    for platform in PLATFORMS {
        pip.args(["--platform", platform]);
    }
    pip.arg("--dest").arg(wheels);
    pip.arg("--requirement").arg(root.join("xtask/libtorch.txt"));
    process::run(&mut pip).context("libtorch cannot be fetched")
}

fn unpack(wheels: &Path, view: &Path) -> Result<()> {
    let mut python = Command::new("python3");
    python.args(["-c", include_str!("unpack.py")]);
    python.arg(wheels).arg(view);
    let status = python.status().context("cannot start python3")?;
    if !status.success() {
        bail!("the wheels of libtorch cannot be unpacked: {status}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view_of(version: &str) -> Result<()> {
        let folder = std::env::temp_dir().join(format!("swath-xtask-{}", std::process::id()));
        let view = folder.join(version);
        fs::create_dir_all(&view)?;
        fs::write(view.join("build-version"), format!("{version}\n"))?;
        let checked = check_version(&view);
        fs::remove_dir_all(&view)?;
        checked
    }

    #[test]
    fn only_the_bound_version_is_taken() {
        assert!(view_of("2.11.0").is_ok());
        assert!(view_of("2.11.0+cpu").is_ok());
        let error = view_of("2.1.0").unwrap_err().to_string();
        assert!(error.contains("2.1.0") && error.contains("2.11.0"), "{error}");
    }
}
