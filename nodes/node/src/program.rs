//! A node as a program: what it is, and its parameters, told by `--help`.

use clap::{CommandFactory as _, FromArgMatches as _, Parser};

/// A parameter that a node takes: its name and what it is.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its name in ROS.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
}

/// A node's program.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Name of the node in the graph.
    pub node: &'static str,
    /// Name of the program.
    pub name: &'static str,
    /// What it is for.
    pub about: &'static str,
    /// Its parameters, besides those that every node has.
    pub parameters: &'static [Parameter],
}

/// The mission.
pub const MISSION: Parameter = Parameter { name: "mission", about: "Path of the mission file (TOML)." };
/// How fast time passes.
pub const PACE: Parameter = Parameter {
    name: "pace",
    about: "0: lockstep; 1: real time; x: x times real time; as the mission says without it.",
};

/// Whether a node works at once.
pub const AUTOSTART: Parameter = Parameter {
    name: "autostart",
    about: "Whether the node is configured and activated by itself; if not, by its life cycle's services.",
};

/// Whether somebody writes down what a node says.
pub const RECORDED: Parameter = Parameter {
    name: "recorded",
    about: "Whether the mission is recorded: a node that is started again waits for the recorder.",
};

/// What every node of a mission takes; [`MISSION`] must be given.
const COMMON: &[Parameter] = &[
    MISSION,
    Parameter { name: "fleet", about: "Nodes of a mission say the same; messages of others do not count." },
    Parameter { name: "epoch", about: "Of two nodes with one name, the one of the greater epoch counts." },
    Parameter { name: "external", about: "Nodes whose place another program takes: a list of names." },
    Parameter { name: "keep", about: "Folder for what the node needs to go on when it is started again." },
    Parameter { name: "orphaned_s", about: "How long it goes on without its launcher [s]; 0: there is none." },
    Parameter { name: "signs", about: "Where a launcher listens that takes the node over; empty: nowhere." },
    Parameter { name: "struck", about: "Faults ordered for this node that have befallen it already." },
    Parameter { name: "memory_limit_mb", about: "Memory that the process may have [10^6 B]; 0 without bound." },
    AUTOSTART,
    RECORDED,
    Parameter {
        name: "packet_filter",
        about: "Whether the kernel drops datagrams that would end or fill the process.",
    },
    Parameter { name: "use_sim_time", about: "Always true: there is no time but the simulated." },
];

/// Own words of a node's command line; everything else is a ROS parameter.
#[derive(Debug, Parser)]
struct Words {}

impl Program {
    /// Takes the words that are not ROS's; `--help`, `--version` and wrong ones end the process.
    pub fn parse(&self, words: impl IntoIterator<Item = String>) {
        let command = Words::command().name(self.name).version(env!("CARGO_PKG_VERSION")).about(self.about);
        let matches = command.after_help(self.after_help()).get_matches_from(words);
        if let Err(error) = Words::from_arg_matches(&matches) {
            error.exit();
        }
    }

    fn after_help(&self) -> String {
        let all = || COMMON.iter().chain(self.parameters);
        let width = all().map(|parameter| parameter.name.len()).max().unwrap_or(0);
        let lines = all().map(|Parameter { name, about }| format!("  {name:width$}  {about}\n"));
        format!(
            "Parameters, given as --ros-args -p NAME:=VALUE:\n{}\nExample: {} --ros-args -p mission:=out/mission.toml",
            lines.collect::<String>(),
            self.name
        )
    }
}
