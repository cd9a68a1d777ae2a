//! An operator's day, as `docs/operators-day.md` tells it: every command there is run here over DDS.

use std::path::Path;

use serde_json::Value;

use crate::common;

struct Day {
    domain: String,
    out: std::path::PathBuf,
}

impl Day {
    fn swath(&self, words: &str) -> String {
        common::succeed(&mut self.command(words))
    }

    fn refused(&self, words: &str) -> String {
        common::fail(&mut self.command(words))
    }

    fn command(&self, words: &str) -> std::process::Command {
        let mut command = common::command("swath", &self.domain);
        command.args(words.split_whitespace()).current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
        command
    }

    fn json(&self, words: &str) -> Vec<Value> {
        common::json_lines(&self.swath(&format!("{words} --json")))
    }

    fn show(&self, id: u64) -> Value {
        serde_json::from_str(&self.swath(&format!("strips show {id} --json"))).unwrap()
    }

    fn id_of(&self, name: &str) -> u64 {
        let strips = self.json("strips list --limit 0");
        strips.iter().find(|strip| strip["name"] == name).unwrap()["id"].as_u64().unwrap()
    }
}

/// The commands that the document shows, in order, without their leading `swath`.
fn documented() -> Vec<String> {
    let document = include_str!("../../../docs/operators-day.md");
    document.lines().filter_map(|line| line.strip_prefix("$ swath ")).map(str::to_owned).collect()
}

/// The same wishes over three stations; faster than the document has it.
fn a_night_over_the_radio(day: &Day, out: &Path, done: &mut Vec<String>) {
    let mut note = |words: &str| done.push(words.to_owned());
    note("launch examples/missions/passes.toml --pace 60");
    let mut launch = day.command("launch examples/missions/passes.toml --pace 150");
    let mut flight = common::Running::start(launch.arg("--out").arg(out));
    note("link status");
    let status = || day.json("link status").remove(0);
    let waiting = common::until("the link's status", || status()["waiting"]["orders"].as_u64().filter(|it| *it > 1000));
    assert_eq!(status()["passes"][0]["station"], "punta-arenas");
    note("strips preview examples/requests/fires.geojson");
    // Some of the fires have no chance in this mission, so that both commands exit with 1.
    let lines = |words: &str| {
        let output = common::run(&mut day.command(&format!("{words} --json")));
        common::json_lines(&String::from_utf8(output.stdout).unwrap())
    };
    let chances = lines("strips preview examples/requests/fires.geojson");
    let first = chances.iter().map(|it| &it["over_the_radio"]).find(|it| it["known"].is_string()).unwrap();
    let time = |step: &str| first[step].as_str().unwrap().to_owned();
    assert!(time("uplink") < time("imaged") && time("imaged") < time("known"), "{first}");
    note("strips submit examples/requests/fires.geojson");
    let fires = lines("strips submit examples/requests/fires.geojson");
    let fires: Vec<u64> = fires.iter().filter_map(|it| it["id"].as_u64()).filter(|id| *id > 0).collect();
    assert!(status()["waiting"]["orders"].as_u64().unwrap() > waiting, "{fires:?}");
    note("strips list --limit 0");
    let way = |id: u64| {
        let strips = day.json("strips list --limit 0");
        strips.into_iter().find(|strip| strip["id"] == id).unwrap()["way"].clone()
    };
    assert!(way(fires[0])["queued"].is_object() && way(fires[0])["uplinked"].is_null());
    common::until("the first fire on board", || way(fires[0])["acknowledged"].is_object().then_some(()));
    note("strips watch --count 3");
    assert_eq!(day.json("strips watch --count 3").len(), 3);
    note("strips show 1501");
    let steps = day.show(fires[0])["way"].clone();
    let tick = |step: &str| steps[step]["tick"].as_u64().unwrap();
    assert!(tick("queued") < tick("uplinked") && tick("uplinked") < tick("on_board"), "{steps}");
    assert!(tick("on_board") < tick("acknowledged"), "{steps}");
    note("strips cancel 1502");
    // One that is not imaged before the cancel is on board.
    let accepted = day.json("strips list --state accepted --limit 0");
    let late = accepted.iter().max_by_key(|it| it["window_open"].as_str().unwrap_or_default()).unwrap();
    let last = late["id"].as_u64().unwrap();
    day.swath(&format!("strips cancel {last} --reason cloud"));
    common::until("the answer to it", || (day.show(last)["status"]["state"] == "cancelled by user").then_some(()));
    flight.stop();
    let ways = std::fs::read_to_string(out.join("strips.jsonl")).unwrap();
    assert!(ways.lines().count() > 1000);
}

#[test]
fn an_operators_day() {
    let folder = tempfile::tempdir().unwrap();
    let day = Day { domain: common::domain(), out: folder.path().join("day") };
    let documented = documented();
    let mut done = Vec::new();
    let mut note = |words: &str| done.push(words.to_owned());

    let launch = "launch examples/missions/operators_day.toml";
    note(launch);
    let mut flight = common::Running::start(day.command(launch).arg("--out").arg(&day.out));

    note("strips submit examples/requests/rivers.geojson --submitter floods");
    let rivers = common::until("the request manager", || {
        let output = common::run(&mut day.command("strips submit examples/requests/rivers.geojson --submitter floods"));
        output.status.success().then(|| String::from_utf8(output.stdout).unwrap())
    });
    assert!(rivers.contains("accepted") && rivers.contains(" 0 refused"), "{rivers}");

    let relief = "strips submit examples/requests/flood.geojson examples/requests/river.gpx --submitter relief";
    note(relief);
    // What this orbit does not see is refused, and told.
    let submitted = common::run(&mut day.command(relief));
    assert!(String::from_utf8(submitted.stdout).unwrap().contains("an area of 20518 km²"));
    note("strips orders --submitter relief");
    let orders = day.json("strips orders --submitter relief");
    assert!(orders.iter().all(|it| it["imaged"] == 0.0 && it["strips"].as_u64().unwrap() > 8), "{orders:?}");

    note("strips preview examples/requests/fires.geojson --hours 12");
    let preview = day.swath("strips preview examples/requests/fires.geojson --hours 12");
    assert!(preview.contains("window opens"), "{preview}");

    note("strips list --state accepted --area -60,75,-180,180");
    assert!(day.swath("strips list --state accepted --area -60,75,-180,180").contains("accepted"));

    note("strips watch --count 3");
    assert_eq!(day.swath("strips watch --count 3").lines().count(), 3);

    note("strips submit examples/requests/faults.geojson --submitter geology --hold");
    day.swath("strips submit examples/requests/faults.geojson --submitter geology --hold");
    let held: Vec<_> =
        day.json("strips list --state held").into_iter().filter(|strip| strip["linked_to"] == 0).collect();
    let [first, second, ..] = &held[..] else { panic!("nothing is held: {held:?}") };
    let (first, second) = (first["id"].as_u64().unwrap(), second["id"].as_u64().unwrap());
    note("strips release 1021 --reason \"crew is on site\"");
    day.swath(&format!("strips release {first}"));
    note("strips cancel 1022 --reason \"cloud\"");
    day.swath(&format!("strips cancel {second} --reason cloud"));
    assert!(day.refused(&format!("strips cancel {second}")).contains("1 of 1 were refused"));
    assert_eq!(day.show(second)["status"]["state"], "cancelled by user");

    note("strips replace 1021 examples/requests/replacement.geojson");
    day.swath(&format!("strips replace {first} examples/requests/replacement.geojson"));
    let new = day.id_of("San Andreas, closer look");
    note("strips show 1030");
    let report = day.show(new);
    assert_eq!(report["status"]["supersedes"], first, "{report}");
    let history: Vec<_> =
        report["history"].as_array().unwrap().iter().map(|it| it["state"].as_str().unwrap()).collect();
    assert_eq!(history[..2], ["held", "accepted"], "{report}");
    assert!(history.contains(&"superseded"), "{report}");

    // By what they have in common: several strips need a word more, and one does not.
    let several = day.refused("strips replace --submitter floods examples/requests/replacement.geojson");
    assert!(several.contains("strips are meant: --whole-order replaces all of them"), "{several}");
    let third = folder.path().join("third.geojson");
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/requests/replacement.geojson"));
    std::fs::write(&third, text.unwrap().replace("closer look", "third look")).unwrap();
    day.swath(&format!("strips replace --name closer.look {}", third.display()));
    assert_eq!(day.show(day.id_of("San Andreas, third look"))["status"]["supersedes"], new);

    note("planner mode hold");
    day.swath("planner mode hold");
    note("planner mode approve");
    day.swath("planner mode approve");
    note("planner status");
    let proposed = |day: &Day| {
        common::until("a proposal", || {
            day.json("planner status").into_iter().find(|status| status["proposal_state"] == "open")
        })
    };
    note("planner approve 3");
    // A proposal is withdrawn when its window closes before the operator has looked at it.
    let mut approved = std::collections::BTreeSet::new();
    common::until("an approved attempt", || {
        let proposal = proposed(&day);
        let number = &proposal["proposal"];
        if common::run(&mut day.command(&format!("planner approve {number}"))).status.success() {
            approved.insert(proposal["strip"].as_u64().unwrap());
        }
        let scheduled =
            |strip: u64| day.show(strip)["history"].as_array().unwrap().iter().any(|it| it["state"] == "scheduled");
        approved.iter().any(|&strip| scheduled(strip)).then_some(())
    });
    note("planner reject");
    proposed(&day);
    day.swath("planner reject");
    note("planner mode autonomous");
    day.swath("planner mode autonomous");

    // The planner of this mission allows too little time for its slews, so that some attempts fail.
    note("strips list --json --limit 0");
    let failed = common::until("a failure", || {
        let strips = day.json("strips list --limit 0");
        strips.into_iter().find(|strip| [201, 202].map(Value::from).contains(&strip["reason_code"]))
    });
    let report = day.show(failed["id"].as_u64().unwrap());
    assert!(report["attempts"].as_array().unwrap().iter().any(|it| it["state"] == "failed"), "{report}");

    note("strips export --trail --out trail.jsonl");
    let trail = folder.path().join("trail.jsonl");
    day.swath(&format!("strips export --trail --out {}", trail.display()));
    let trail = common::json_lines(&std::fs::read_to_string(trail).unwrap());
    assert!((1..).zip(&trail).all(|(sequence, line): (u64, _)| line["sequence"] == sequence));
    let states: std::collections::BTreeSet<_> = trail.iter().map(|line| line["state"].as_str().unwrap()).collect();
    for state in ["accepted", "held", "cancelled by user", "superseded", "scheduled", "executing"] {
        assert!(states.contains(state), "{state}: {states:?}");
    }
    flight.stop();
    note("strips export --store out/operators-day-7-1/requests.sqlite --out strips.geojson");
    let store = day.out.join("requests.sqlite");
    let geojson: Value =
        serde_json::from_str(&day.swath(&format!("strips export --store {}", store.display()))).unwrap();
    let features = geojson["features"].as_array().unwrap();
    assert!(features.iter().any(|it| it["properties"]["state"] == "cancelled by user"));
    assert!(features.iter().all(|it| !it["properties"]["history"].as_array().unwrap().is_empty()));
    note("launch examples/missions/disasters.toml");
    let disasters = folder.path().join("disasters");
    common::succeed(day.command("launch examples/missions/disasters.toml").arg("--out").arg(&disasters));
    note("strips orders --store out/disasters-109-1/requests.sqlite");
    let orders = day.json(&format!("strips orders --store {}", disasters.join("requests.sqlite").display()));
    let shares: Vec<_> =
        orders.iter().map(|it| (it["strips"].as_u64().unwrap(), it["imaged"].as_f64().unwrap())).collect();
    assert_eq!(shares.iter().map(|it| it.0).collect::<Vec<_>>(), [12, 9, 8], "flood, river, fire: {orders:?}");
    assert!(shares.iter().all(|(_, imaged)| *imaged > 0.999), "{orders:?}");

    let summary: Value =
        serde_json::from_str(&std::fs::read_to_string(disasters.join("summary.json")).unwrap()).unwrap();
    let told: Vec<_> = summary["orders"].as_array().unwrap().iter().map(|it| it["imaged"].as_f64().unwrap()).collect();
    assert_eq!(told, shares.iter().map(|it| it.1).collect::<Vec<_>>());
    note("report out/disasters-109-1/bag -o disasters.html");
    let page = folder.path().join("disasters.html");
    day.swath(&format!("report {} -o {}", disasters.join("bag").display(), page.display()));
    let page = std::fs::read_to_string(page).unwrap();
    let (_, table) = page.split_once("<table id=\"orders\">").unwrap();
    let table = &table[..table.find("</table>").unwrap()];
    assert_eq!(table.matches("<td>100.0 %</td>").count(), 3, "{table}");

    a_night_over_the_radio(&day, &folder.path().join("night"), &mut done);

    let words = |words: &str| words.split_whitespace().take(2).map(str::to_owned).collect::<Vec<_>>();
    let (shown, flown): (Vec<_>, Vec<_>) =
        (documented.iter().map(|it| words(it)).collect(), done.iter().map(|it| words(it)).collect());
    assert_eq!(shown, flown, "docs/operators-day.md and this test show the same commands in the same order");
}
