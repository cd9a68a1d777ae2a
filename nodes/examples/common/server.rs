//! A console or a bridge for measurements.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};

use super::flight::swath;

/// Linux tells times of processes in hundredths of a second, whatever the kernel counts in (`man 5 proc`).
const USER_HZ: f64 = 100.0;

/// A console or a bridge in a process of its own; dropping it ends it.
pub struct Server {
    child: Child,
    /// Where it listens.
    pub address: String,
}

impl Server {
    /// Starts `swath console` or `swath bridge` with some words in a domain.
    pub fn start(kind: &str, domain: u16, words: &[&str]) -> Result<Self> {
        let mut command = Command::new(swath()?);
        command.args([kind, "--listen", "127.0.0.1:0"]).args(words);
        command.env("ROS_DOMAIN_ID", domain.to_string()).env("ROS_LOCALHOST_ONLY", "1");
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let mut line = String::new();
        BufReader::new(child.stdout.take().context("no output")?).read_line(&mut line)?;
        let address = line.trim().rsplit("//").next().unwrap_or_default().trim_end_matches('/').to_owned();
        ensure!(!address.is_empty(), "the {kind} does not say where it is");
        Ok(Self { child, address })
    }

    /// Its memory [B].
    pub fn memory(&self) -> Result<f64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id()))?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).context("no VmRSS")?;
        Ok(line.trim().trim_end_matches(" kB").parse::<f64>()? * 1024.0)
    }

    /// Processor time that it has used so far [s].
    pub fn processor_s(&self) -> Result<f64> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.child.id()))?;
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        let ticks = |at: usize| -> Result<f64> { Ok(fields.get(at).context("a short stat")?.parse()?) };
        Ok((ticks(11)? + ticks(12)?) / USER_HZ)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
