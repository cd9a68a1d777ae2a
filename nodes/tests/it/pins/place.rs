//! A folder to run programs in, and what they say and write there, without what differs from one run to the next.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::sync::OnceLock;

use sha2::{Digest as _, Sha256};
use tempfile::TempDir;

use crate::common;
use crate::pins::golden;

/// Sums of networks depend on the order that a processor's widest instructions suggest: these settings of libtorch and
/// the libraries below it choose the instructions that every x86-64 machine has. Missions by policies come out equal
/// without them as well, as far as was tried, because times are rounded to ticks; weights that were trained do not.
const SAME_KERNELS: [(&str, &str); 3] =
    [("ATEN_CPU_CAPABILITY", "default"), ("MKL_CBWR", "COMPATIBLE"), ("ONEDNN_MAX_CPU_ISA", "SSE41")];

/// A folder of its own.
pub struct Place {
    folder: TempDir,
    domain: String,
}

/// How a program ended and what it said.
pub struct Said {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Place {
    /// For programs that meet nobody: they share a domain.
    pub fn new() -> Self {
        static SHARED: OnceLock<String> = OnceLock::new();
        Self { folder: tempfile::tempdir().unwrap(), domain: SHARED.get_or_init(common::domain).clone() }
    }

    /// For programs that meet over DDS: with a domain of its own.
    pub fn with_domain() -> Self {
        Self { domain: common::domain(), ..Self::new() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file, and the folders above it.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    /// Removes a folder, if it is there.
    pub fn remove(&self, name: &str) {
        if self.path(name).exists() {
            fs::remove_dir_all(self.path(name)).unwrap();
        }
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Copies a file or a folder of files.
    pub fn copy(&self, from: &Path, name: &str) {
        if from.is_dir() {
            for entry in fs::read_dir(from).unwrap() {
                let entry = entry.unwrap();
                self.copy(&entry.path(), &format!("{name}/{}", entry.file_name().to_str().unwrap()));
            }
        } else {
            self.write(name, fs::read(from).unwrap());
        }
    }

    /// A command line in this folder; `<repository>` and `<pins>` stand for those folders.
    pub fn command(&self, line: &str) -> std::process::Command {
        let mut words = line.split(' ').map(|word| {
            let word = word.replace("<repository>", golden::repository().to_str().unwrap());
            word.replace("<pins>", golden::folder().to_str().unwrap())
        });
        let mut command = common::command(&words.next().unwrap(), &self.domain);
        command.args(words).current_dir(self.folder.path()).stdin(Stdio::null());
        for variable in ["COLUMNS", "RUST_LOG", "RUST_BACKTRACE"] {
            command.env_remove(variable);
        }
        command.envs(SAME_KERNELS).env("NO_COLOR", "1");
        command
    }

    /// Runs a command line to its end.
    pub fn run(&self, line: &str) -> Said {
        let Output { status, stdout, stderr } = common::run(&mut self.command(line));
        let text = |bytes: Vec<u8>| self.lasting(&String::from_utf8(bytes).unwrap());
        Said { code: status.code(), stdout: text(stdout), stderr: text(stderr) }
    }

    /// Runs a command line that must succeed, and returns what it says on stdout.
    pub fn succeed(&self, line: &str) -> String {
        let said = self.run(line);
        assert_eq!(said.code, Some(0), "{line}\n{}{}", said.stdout, said.stderr);
        said.stdout
    }

    /// A text without the names of folders that differ from one machine to the next.
    fn lasting(&self, text: &str) -> String {
        let text = text.replace(self.folder.path().to_str().unwrap(), "<folder>");
        let text = text.replace(golden::folder().to_str().unwrap(), "<pins>");
        text.replace(golden::repository().to_str().unwrap(), "<repository>")
    }
}

/// SHA-256 in hexadecimal.
pub fn sha256(bytes: impl AsRef<[u8]>) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
