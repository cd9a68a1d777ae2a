//! What a machine must have before anything is built, and the command that installs what is missing.

use std::ffi::OsString;
use std::process::{Command, Stdio};

use anyhow::{Result, bail};

struct Prerequisite {
    name: &'static str,
    program: OsString,
    args: &'static [&'static str],
    /// Packages for apt, dnf, pacman and zypper.
    packages: [&'static str; 4],
}

const MANAGERS: [(&str, &str); 4] = [
    ("apt-get", "sudo apt-get install -y"),
    ("dnf", "sudo dnf install -y"),
    ("pacman", "sudo pacman -S"),
    ("zypper", "sudo zypper install"),
];

/// Names every missing prerequisite at once.
pub fn check() -> Result<()> {
    let missing: Vec<String> = prerequisites()
        .iter()
        .filter(|needed| !works(needed))
        .map(|needed| format!("{} is missing: {}", needed.name, advice(needed)))
        .collect();
    if !missing.is_empty() {
        bail!("{}", missing.join("\n"));
    }
    Ok(())
}

fn prerequisites() -> [Prerequisite; 4] {
    let compiler = std::env::var_os("CXX").unwrap_or_else(|| "c++".into());
    [
        Prerequisite {
            name: "a C++ compiler",
            program: compiler,
            args: &["--version"],
            packages: ["g++", "gcc-c++", "gcc", "gcc-c++"],
        },
        Prerequisite {
            name: "python3 (3.9 or newer)",
            program: "python3".into(),
            args: &["-c", "import sys; sys.exit(sys.version_info < (3, 9))"],
            packages: ["python3", "python3", "python", "python3"],
        },
        Prerequisite {
            name: "pip for python3",
            program: "python3".into(),
            args: &["-m", "pip", "--version"],
            packages: ["python3-pip", "python3-pip", "python-pip", "python3-pip"],
        },
        Prerequisite {
            name: "venv for python3",
            program: "python3".into(),
            args: &["-c", "import venv, ensurepip"],
            packages: ["python3-venv", "python3", "python", "python3"],
        },
    ]
}

fn works(needed: &Prerequisite) -> bool {
    succeeds(Command::new(&needed.program).args(needed.args))
}

fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

fn advice(needed: &Prerequisite) -> String {
    let manager = MANAGERS.iter().position(|(program, _)| succeeds(Command::new(program).arg("--version")));
    match manager {
        Some(index) => format!("install it with `{} {}`", MANAGERS[index].1, needed.packages[index]),
        None => format!("install the package that your system calls something like {}", needed.packages[0]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_does_not_work_and_is_named_with_its_package() {
        let needed = Prerequisite {
            name: "a thing",
            program: "swath-no-such-program".into(),
            args: &["--version"],
            packages: ["thing", "thing", "thing", "thing"],
        };
        assert!(!works(&needed));
        assert!(advice(&needed).contains("thing"));
    }
}
