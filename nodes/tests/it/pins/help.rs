//! `--help` of every command, and the node graph.

use crate::pins::golden;
use crate::pins::place::Place;

/// Every program of the suite.
pub const PROGRAMS: [&str; 10] = [
    "swath",
    "swath-bag",
    "swath-train",
    "swath-spacecraft",
    "swath-guidance",
    "swath-planner",
    "swath-requests",
    "swath-requests-learned",
    "swath-catalogue",
    "swath-link",
];

/// Appends the help of a command and of the commands below it.
fn collect(place: &Place, command: &str, text: &mut String) {
    let help = place.succeed(&format!("{command} --help"));
    *text += &format!("$ {command} --help\n{}\n", lasting(&help));
    let Some(below) = help.split("\nCommands:\n").nth(1) else { return };
    // Descriptions of commands may go on in lines that are indented further.
    let names = below.lines().take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        collect(place, &format!("{command} {name}"), text);
    }
}

/// A help without the number of this machine's processors, the default of `--threads`.
fn lasting(help: &str) -> String {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut of_threads = false;
    let lines = help.lines().map(|line| {
        of_threads = line.contains("--threads") || of_threads && !line.trim().is_empty() && !line.contains(" --");
        if of_threads { line.replace(&format!("[default: {cores}]"), "[default: CORES]") } else { line.to_owned() }
    });
    lines.map(|line| line.trim_end().to_owned() + "\n").collect()
}

#[test]
fn help_of_every_command() {
    let place = Place::new();
    for program in PROGRAMS {
        let mut text = String::new();
        collect(&place, program, &mut text);
        golden::check(&format!("help/{program}.txt"), &text);
    }
}

#[test]
fn the_node_graph() {
    golden::check("graph.txt", &Place::new().succeed("swath graph"));
}
