//! The drill of `docs/drill.md`: every command there is run here over DDS.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::common;

struct Drill {
    domain: String,
}

impl Drill {
    fn command(&self, words: &[String]) -> Command {
        let mut command = common::command("swath", &self.domain);
        command.args(words).current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
        command
    }

    fn run(&self, words: &str) -> Output {
        common::run(&mut self.command(&shell_words(words)))
    }

    fn swath(&self, words: &str) -> String {
        common::succeed(&mut self.command(&shell_words(words)))
    }

    /// What is told of an alarm that is not normal.
    fn alarm(&self, name: &str) -> Option<Value> {
        common::json_lines(&self.swath("alarms --json")).into_iter().find(|it| it["name"] == name)
    }
}

/// Words as a shell takes them, with quotes around those that hold spaces.
fn shell_words(text: &str) -> Vec<String> {
    let outside = |(number, part): (usize, &str)| match number % 2 {
        0 => part.split_whitespace().map(str::to_owned).collect(),
        _ => vec![part.to_owned()],
    };
    text.split('"').enumerate().flat_map(outside).collect()
}

/// The commands that the document shows, in order, without their leading `swath`.
fn documented() -> Vec<String> {
    let document = include_str!("../../../docs/drill.md");
    let commands = document.lines().filter_map(|line| line.strip_prefix("$ swath "));
    commands.map(|words| words.trim_end_matches(" &").to_owned()).collect()
}

#[test]
fn a_drill() {
    let folder = tempfile::tempdir().unwrap();
    let (drill, out) = (Drill { domain: common::domain() }, folder.path().join("drill"));
    let documented = documented();
    let [launch, watch, list, ack, shelve, tracker, kill, wrong, submit, ack_all, list_again, report] = &documented[..]
    else {
        panic!("docs/drill.md shows {documented:?}")
    };
    let mut flight = common::Running::start(drill.command(&shell_words(launch)).arg("--out").arg(&out));
    common::until("the launcher", || drill.run("alarms").status.success().then_some(()));
    let watched = drill.swath(watch);
    assert!(watched.contains("wheel y") && watched.contains("gyro biased"), "{watched}");
    let listed = drill.swath(list);
    assert!(listed.contains("2 alarms") && listed.contains("it gives 40 % of its torque limit"), "{listed}");

    drill.swath(ack);
    assert_eq!(drill.alarm("wheel y").unwrap()["state"], "acknowledged");
    let again = drill.run(ack);
    assert!(!again.status.success());
    drill.swath(shelve);
    assert_eq!(drill.alarm("gyro biased").unwrap()["state"], "shelved");

    assert!(drill.swath(tracker).starts_with("startracker:out@"));
    assert_eq!(drill.swath(kill).lines().count(), 2);
    let refused = drill.run(wrong);
    let said = String::from_utf8_lossy(&refused.stdout);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said.contains("the share lost is `120%`") && said.contains("there is no part `thruster`"), "{said}");
    common::until("a submission", || drill.run(submit).status.success().then_some(()));
    common::until("the end of the trouble", || {
        let back = |name: &str| drill.alarm(name).is_some_and(|it| it["state"] == "returned unacknowledged");
        let names = ["star tracker out", "guidance lost", "request_manager lost"];
        names.into_iter().all(back).then_some(())
    });
    drill.swath(ack_all);
    let listed = drill.swath(list_again);
    assert!(listed.contains("gyro biased") && !listed.contains("returned unacknowledged"), "{listed}");
    flight.stop();

    assert!(report.starts_with("report out/drill-7-1/bag -o "), "{report}");
    let page = folder.path().join("drill.html");
    drill.swath(&format!("report {} -o {}", out.join("bag").display(), page.display()));
    let page = std::fs::read_to_string(page).unwrap();
    let table = |id: &str| {
        let (_, table) = page.split_once(&format!("<table id=\"{id}\">")).unwrap();
        table[..table.find("</table>").unwrap()].to_owned()
    };
    let (faults, alarms) = (table("faults"), table("alarms"));
    assert_eq!(faults.matches("<td>the mission</td>").count(), 2, "{faults}");
    assert_eq!(faults.matches("<td>instructor</td>").count(), 3, "{faults}");
    for told in ["wheel y", "gyro biased", "star tracker out", "guidance lost", "request_manager lost"] {
        assert!(alarms.contains(&format!("<td>{told}</td>")), "{told}: {alarms}");
    }
    assert!(alarms.contains("<td>acknowledged</td><td>ana</td><td>planned around</td>"), "{alarms}");
}
