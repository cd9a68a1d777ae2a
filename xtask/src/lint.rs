//! What CI asks of the code besides its tests: format, lints, dependencies.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::process;

/// Tools that are not part of a Rust toolchain, with the versions that are asked for.
const TOOLS: &[(&str, &str)] = &[("cargo-deny", "0.20.2"), ("cargo-machete", "0.9.2")];

/// Checks format, clippy, licences and sources of dependencies, and dependencies that nothing uses.
pub fn run(root: &Path) -> Result<()> {
    process::run(process::cargo(root, "fmt").args(["--all", "--check"]))?;
    let [deny, machete] = [tool(root, 0)?, tool(root, 1)?];
    process::run(Command::new(machete).arg(root))?;
    let manifest = root.join("Cargo.toml");
    process::run(
        Command::new(deny).arg("--manifest-path").arg(manifest).args(["check", "licenses", "bans", "sources"]),
    )?;
    process::run(process::cargo(root, "clippy").args(["--workspace", "--all-targets", "--", "-D", "warnings"]))
}

/// The path of a tool, which is built into `target/tools` if it is not there.
fn tool(root: &Path, which: usize) -> Result<PathBuf> {
    let (name, version) = TOOLS[which];
    let folder = root.join("target/tools").join(format!("{name}-{version}"));
    let path = folder.join("bin").join(name);
    if !path.is_file() {
        eprintln!("building {name} {version} in {}", folder.display());
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut install = Command::new(cargo);
        install.args(["install", "--quiet", "--locked", name, "--version", version, "--root"]).arg(&folder);
        process::run(&mut install)?;
    }
    Ok(path)
}
