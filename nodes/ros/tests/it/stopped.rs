//! Nodes in processes of their own, which are stopped, or run out of memory.

use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command};
use std::time::Duration;

use swath_msgs::swath_msgs::{SpacecraftState, WheelTorque};
use swath_ros::{Shutdown, graph};

use crate::common::{PATIENCE, Trial, eventually};
use crate::stranger::Stranger;

/// A test that is the body of a process of its own.
struct Process(Child);

impl Process {
    fn start(test: &str, trial: &Trial) -> Self {
        Self::start_with(test, trial, &[])
    }

    fn start_with(test: &str, trial: &Trial, variables: &[(&str, &Path)]) -> Self {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args(["--exact", test, "--ignored", "--nocapture"]);
        command.env("TRIAL_DOMAIN", trial.domain.to_string()).env("TRIAL_NAMESPACE", &trial.namespace);
        command.envs(variables.iter().copied());
        Self(command.spawn().unwrap())
    }

    fn signal(&self, signal: &str) {
        assert!(Command::new("kill").args([signal, &self.0.id().to_string()]).status().unwrap().success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn trial_of_parent() -> Trial {
    let variable = |name: &str| std::env::var(name).unwrap();
    Trial { domain: variable("TRIAL_DOMAIN").parse().unwrap(), namespace: variable("TRIAL_NAMESPACE") }
}

#[test]
#[ignore = "the process of another test"]
fn guidance_that_answers() {
    let guidance = trial_of_parent().start(graph::GUIDANCE, "").unwrap();
    let states = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let torques = guidance.publisher(&graph::WHEEL_TORQUE).unwrap();
    loop {
        while let Some(state) = states.take().unwrap() {
            torques.publish(&WheelTorque { tick: state.tick, ..Default::default() }).unwrap();
        }
        guidance.wait(PATIENCE).unwrap();
    }
}

/// RustDDS ends its event loop when a system call of it is interrupted, as it is when a process is stopped (Ctrl-Z).
#[test]
fn a_node_that_was_stopped_goes_on() {
    let trial = Trial::new(21);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let torques = spacecraft.subscription(&graph::WHEEL_TORQUE).unwrap();
    let guidance = Process::start("stopped::guidance_that_answers", &trial);
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    let mut tick = 0;
    let mut answered = || {
        tick += 1;
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        let torque = torques.wait(spacecraft.signal(), Duration::from_millis(100)).unwrap();
        torque.filter(|torque| torque.tick == tick)
    };
    eventually(&mut answered);
    for _ in 0..3 {
        guidance.signal("-STOP");
        std::thread::sleep(Duration::from_millis(300));
        guidance.signal("-CONT");
    }
    eventually(&mut answered);
    eventually(&mut answered);
}

/// Until its host's clock has caught up, RustDDS would hear of no new participant: for an hour here.
#[test]
fn who_comes_after_the_hosts_clock_was_set_back_is_heard() {
    let trial = Trial::new(46);
    let folder = tempfile::tempdir().unwrap();
    let (library, offset) = (folder.path().join("clock.so"), folder.path().join("offset"));
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/c/clock.c");
    let compiled = Command::new("cc").args(["-shared", "-fPIC", "-O2", source, "-o"]).arg(&library).status().unwrap();
    assert!(compiled.success());
    std::fs::write(&offset, "0").unwrap();
    let watcher = trial.start(graph::PLANNER, "").unwrap();
    let variables: [(&str, &Path); 2] = [("LD_PRELOAD", &library), ("CLOCK_OFFSET", &offset)];
    let _guidance = Process::start_with("stopped::guidance_that_answers", &trial, &variables);
    eventually(|| watcher.nodes().contains(&trial.full("guidance")).then_some(()));
    std::fs::write(&offset, "-3600").unwrap();
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let torques = spacecraft.subscription(&graph::WHEEL_TORQUE).unwrap();
    for tick in 1..=3 {
        eventually(|| {
            states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
            let torque = torques.wait(spacecraft.signal(), Duration::from_millis(100)).unwrap();
            torque.filter(|torque| torque.tick == tick)
        });
    }
}

#[test]
#[ignore = "the process of another test"]
fn guidance_of_little_memory() {
    let guidance = trial_of_parent().start(graph::GUIDANCE, "-p memory_limit_mb:=200 -p packet_filter:=false").unwrap();
    loop {
        guidance.wait(PATIENCE).unwrap();
    }
}

/// Two datagrams for which RustDDS wants gigabytes: one process ends, the machine lives.
#[test]
fn a_process_that_wants_too_much_memory_ends() {
    const SIGABRT: i32 = 6;
    for (number, file) in [(22, "04_heartbeat_long_range_52B"), (23, "06_datafrag_4GiB_57B_any_prefix")] {
        let trial = Trial::new(number);
        let watcher = trial.start(graph::PLANNER, "").unwrap();
        let mut guidance = Process::start("stopped::guidance_of_little_memory", &trial);
        eventually(|| watcher.nodes().contains(&trial.full("guidance")).then_some(()));
        let stranger = Stranger::towards(Some(guidance.0.id()), trial.domain, 8, 100);
        stranger.send_file(file, false);
        let status = eventually(|| guidance.0.try_wait().unwrap());
        assert_eq!(status.signal(), Some(SIGABRT), "{file}: {status}");
    }
}

#[test]
#[ignore = "the process of another test"]
fn spacecraft_that_waits() {
    let spacecraft = trial_of_parent().start(graph::SPACECRAFT, "").unwrap();
    let shutdown = Shutdown::on_signals(spacecraft.signal()).unwrap();
    // Nobody comes: only a signal ends this before the parent's patience does.
    spacecraft.wait_for_peers(&[graph::GUIDANCE], 10 * PATIENCE).unwrap();
    assert!(shutdown.asked());
}

#[test]
fn signals_end_the_wait_for_peers() {
    for (number, signal) in [(41, "-INT"), (42, "-TERM")] {
        let trial = Trial::new(number);
        let watcher = trial.start(graph::PLANNER, "").unwrap();
        let mut spacecraft = Process::start("stopped::spacecraft_that_waits", &trial);
        eventually(|| watcher.nodes().contains(&trial.full("spacecraft")).then_some(()));
        std::thread::sleep(Duration::from_millis(500));
        assert!(spacecraft.0.try_wait().unwrap().is_none());
        spacecraft.signal(signal);
        // A second one that follows at once, as from a terminal and a launcher, is the same wish.
        let id = spacecraft.0.id().to_string();
        Command::new("kill").args([signal, &id]).output().unwrap();
        let status = eventually(|| spacecraft.0.try_wait().unwrap());
        assert!(status.success(), "{signal}: {status}");
    }
}
