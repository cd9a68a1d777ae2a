//! `swath-bag` as a process on a domain, and a node of the test's own beside it.
#![allow(dead_code, reason = "each test binary uses some of these")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on should panic")]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use swath_msgs::RosService;
use swath_ros::{Client, Environment, Mapping, Node, RosArgs, graph};

/// How long anything may take before a test gives up.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A node of the test on a domain.
pub fn node(domain: u16) -> Node {
    let environment = Environment { domain, localhost_only: false, mapping: Mapping::Cyclone };
    let words = ["--ros-args", "-r", "__node:=tester", "--disable-rosout-logs"].map(str::to_owned);
    let (_, args) = RosArgs::split(words).unwrap();
    Node::start_in(environment, graph::OPERATOR, &args).unwrap()
}

/// A client of a service that is there.
pub fn client<S: RosService>(node: &Node, name: &'static str) -> Client<S> {
    let client = node.client::<S>(&graph::Service::new(name, &[], &[])).unwrap();
    node.wait_for_service(&client, PATIENCE).unwrap();
    client
}

/// Calls a service whose request says nothing.
pub fn call<S: RosService>(client: &Client<S>) -> S::Response {
    client.call(S::Request::default(), PATIENCE).unwrap()
}

/// Waits until something holds.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "waited too long until {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
    // The other side of a match may not be there yet.
    std::thread::sleep(Duration::from_millis(400));
}

/// A running `swath-bag record` or `swath-bag play`.
pub struct Program {
    child: Child,
    lines: std::io::Lines<BufReader<ChildStdout>>,
}

impl Program {
    /// Starts it and waits until it is ready.
    pub fn start(domain: u16, dir: &Path, words: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_swath-bag"));
        command.args(words).stdin(Stdio::null());
        Self::spawn(command, domain, dir)
    }

    /// Starts a command and waits until it is ready.
    pub fn spawn(mut command: Command, domain: u16, dir: &Path) -> Self {
        command.current_dir(dir).env("ROS_DOMAIN_ID", domain.to_string()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut program = Self { child, lines };
        let ready: Value = serde_json::from_str(&program.lines.next().unwrap().unwrap()).unwrap();
        assert_eq!(ready["event"], "ready");
        program
    }

    /// Waits for the end; returns the line about it, if there is one.
    pub fn end(mut self) -> (ExitStatus, Option<Value>) {
        let last = self.lines.next().map(|line| serde_json::from_str(&line.unwrap()).unwrap());
        (self.child.wait().unwrap(), last)
    }

    /// Ends it as SIGKILL does.
    pub fn kill(mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Interrupts it as Ctrl-C does, and waits for the end.
    pub fn interrupt(self) -> (ExitStatus, Value) {
        let (status, last) = self.signalled(&["-INT"]);
        (status, last.unwrap())
    }

    /// Sends it signals, one right behind the other, and waits for the end.
    pub fn signalled(self, signals: &[&str]) -> (ExitStatus, Option<Value>) {
        let pid = self.child.id().to_string();
        for signal in signals {
            assert!(Command::new("kill").args([signal, &pid.as_str()]).status().unwrap().success());
        }
        self.end()
    }
}
