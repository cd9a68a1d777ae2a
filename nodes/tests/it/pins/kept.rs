//! A bag and a store that version 0.1.0 left: they are read, told, flown again and gone on with.

use std::fmt::Write as _;
use std::process::Stdio;

use crate::common::{self, Running, json_lines};
use crate::pins::bags::{export, refly, report};
use crate::pins::golden;
use crate::pins::place::Place;

/// Copies the kept files to a place: nobody writes to the originals.
fn copied_to(place: Place) -> Place {
    place.copy(&golden::folder().join("kept"), "kept");
    place
}

/// Runs command lines, and collects what they say.
fn say(place: &Place, lines: &[&str]) -> String {
    let mut text = String::new();
    for line in lines {
        let said = place.run(line);
        let code = said.code.unwrap_or_else(|| panic!("{line} was ended by a signal: {}", said.stderr));
        _ = writeln!(text, "$ {line}\n{}{}exit code {code}\n", said.stdout, said.stderr);
    }
    text
}

#[test]
fn the_kept_store_is_exported() {
    let lines = [
        "swath strips export --store kept/requests.sqlite",
        "swath strips export --trail --store kept/requests.sqlite",
    ];
    golden::check("kept/store.txt", &say(&copied_to(Place::new()), &lines));
}

#[test]
fn the_kept_bag_is_read() {
    let place = copied_to(Place::new());
    let mut text = say(&place, &["swath-bag info kept/bag", "swath-bag validate kept/bag"]);
    text += &refly(&place, "kept/bag", "");
    assert_eq!(place.read("tasks.jsonl"), place.read("kept/tasks.jsonl"));
    text += &refly(&place, "kept/bag", "--planner lookahead ");
    text += &report(&place, "kept/bag");
    text += &export(&place, "kept/bag", "");
    golden::check("kept/bag.txt", &text);
}

/// What operators say to the request manager that took the store up.
const GONE_ON: &[&str] = &[
    "swath strips list --limit 0",
    "swath strips list --state held --state superseded --json",
    "swath strips list --area 0,60,-180,0 --limit 5",
    "swath strips show 19",
    "swath strips show 47 --json",
    "swath strips show --submitter geology --ref closer",
    "swath strips show 57",
    "swath strips preview --id 30",
    "swath strips release 54 --actor chief --reason late",
    "swath strips reject 55 --actor chief",
    "swath strips cancel 51 31 32 --reason over",
    "swath strips hold 33 40",
    "swath strips replace 34 new.geojson --submitter floods",
    "swath strips submit new.geojson --submitter fires --json",
    "swath strips show 57 --json",
    "swath strips export",
    "swath strips export --trail",
];

/// The request manager takes the store up where it was left, and operators go on.
#[test]
fn the_kept_store_is_taken_up() {
    let place = copied_to(Place::with_domain());
    let new = r#"{"type":"Feature","properties":{"name":"new","client_ref":"new","bidirectional":true},
        "geometry":{"type":"LineString","coordinates":[[20.0,30.0],[22.0,31.5]]}}"#;
    place.write("new.geojson", new);
    let line = "swath-requests --ros-args -p mission:=kept/mission.toml -p store:=kept/requests.sqlite";
    let mut manager = Running::start(place.command(line).stderr(Stdio::null()));
    common::until("the request manager", || place.run("swath strips list").code.filter(|code| *code == 0));
    let text = say(&place, GONE_ON);
    manager.stop();
    golden::check("kept/gone_on.txt", &text);
    // The store holds what the request manager said.
    let in_store = place.succeed("swath strips export --trail --store kept/requests.sqlite");
    let said = text.rsplit("--trail\n").next().unwrap().split("exit code").next().unwrap();
    assert!(json_lines(&in_store) == json_lines(said), "the store tells another trail:\n{in_store}");
}
