//! A witness from the outside: whether a node of a mission does its work, seen by its messages, answers and files.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Client, Environment, Node, RosArgs, Subscription, graph};

/// A node and its program.
pub type Name = (&'static str, &'static str);

/// The nodes of a mission.
pub const NODES: [Name; 5] = [
    ("spacecraft", "swath-spacecraft"),
    ("guidance", "swath-guidance"),
    ("planner", "swath-planner"),
    ("request_manager", "swath-requests"),
    ("recorder", "swath-bag"),
];

/// How long a node may be away.
const LIMIT: Duration = Duration::from_secs(60);

/// The witness.
pub struct Witness {
    clock: Subscription<Clock>,
    torques: Subscription<msg::WheelTorque>,
    status: Subscription<msg::PlannerStatus>,
    limits: Client<msg::GetLimits>,
    bag: PathBuf,
    _node: Node,
}

impl Witness {
    /// Comes up in a domain.
    pub fn start(domain: u16, out: &Path) -> Result<Self> {
        let environment = Environment { domain, localhost_only: true, ..Environment::read()? };
        let node = Node::start_in(environment, "witness", &RosArgs::default())?;
        Ok(Self {
            clock: node.subscription(&graph::CLOCK)?,
            torques: node.subscription(&graph::WHEEL_TORQUE)?,
            status: node.subscription(&graph::PLANNER_STATUS)?,
            limits: node.client(&graph::GET_LIMITS)?,
            bag: out.join("bag"),
            _node: node,
        })
    }

    /// Forgets what a node has done up to now; of the recorder, how many files there are.
    pub fn work(&self, node: Name) -> Result<usize> {
        // What is on its way comes first.
        std::thread::sleep(Duration::from_millis(20));
        self.has_worked(node)?;
        Ok(self.files())
    }

    fn files(&self) -> usize {
        let grown = |entry: std::io::Result<std::fs::DirEntry>| {
            let entry = entry.ok()?;
            let mcap = entry.path().extension().is_some_and(|it| it == "mcap");
            // A file that has more than its beginning.
            (mcap && entry.metadata().ok()?.len() > 200).then_some(())
        };
        std::fs::read_dir(&self.bag).into_iter().flatten().filter_map(grown).count()
    }

    /// Whether a node has said something of its own since the last call.
    fn has_worked(&self, node: Name) -> Result<bool> {
        let mut worked = false;
        match node.0 {
            "spacecraft" => {
                while self.clock.take()?.is_some() {
                    worked = true;
                }
            }
            "guidance" => {
                while self.torques.take()?.is_some() {
                    worked = true;
                }
            }
            "planner" => {
                while self.status.take()?.is_some() {
                    worked = true;
                }
            }
            "request_manager" => {
                worked = self.limits.call(msg::GetLimitsRequest::default(), Duration::from_millis(100)).is_ok();
            }
            _ => {}
        }
        Ok(worked)
    }

    /// Waits until a node that was killed does its work again; `before` are the files of the bag then.
    pub fn wait_for_more(&self, node: Name, before: usize) -> Result<()> {
        let began = Instant::now();
        // What it has sent before it died is not its work.
        std::thread::sleep(Duration::from_millis(50));
        self.has_worked(node)?;
        while began.elapsed() < LIMIT {
            if self.has_worked(node)? || (node.0 == "recorder" && self.files() > before) {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        bail!("{} does nothing for {} s", node.0, LIMIT.as_secs())
    }
}

/// The process of a program that works for the mission in a folder.
pub fn process(program: &str, out: &Path) -> Option<u32> {
    let out = out.display().to_string();
    let of = |entry: std::io::Result<std::fs::DirEntry>| {
        let pid: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let words = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let words: Vec<String> = words.split(|&byte| byte == 0).map(|it| String::from_utf8_lossy(it).into()).collect();
        (words.first()?.ends_with(program) && words.iter().any(|word| word.contains(&out))).then_some(pid)
    };
    std::fs::read_dir("/proc").ok()?.filter_map(of).last()
}
