//! The console's API is what it says it is: its description is sound, and schemathesis finds nothing that contradicts it.

use serde_json::{Value, json};

use crate::common;

/// Cases of each operation in each phase; `cargo xtask soak schemathesis` takes more.
const CASES: &str = "12";

#[test]
fn schemathesis_finds_nothing_that_contradicts_the_description() {
    let (folder, domain, address) = (tempfile::tempdir().unwrap(), common::domain(), common::address());
    let mission = common::write_mission(folder.path(), common::QUIET);
    let mut launch = common::swath(&domain, &["launch", "--no-bag", "--console", &address, "--out"]);
    let _flight = common::Running::start(launch.arg(folder.path().join("out")).arg(&mission));
    common::until("the console", || std::net::TcpStream::connect(&address).ok());

    let base = format!("http://{address}");
    let saw = common::succeed(common::python("described.py", &base).arg(folder.path()).args([CASES, "1"]));
    let saw: Value = serde_json::from_str(saw.trim()).unwrap();
    let nothing = json!([]);
    assert_eq!((&saw["unsound"], &saw["failures"], &saw["errors"]), (&json!(""), &nothing, &nothing), "{saw:#}");
    // Every operation that has a description was asked.
    assert_eq!(saw["tested"], saw["operations"], "{saw}");
    assert!(saw["operations"].as_u64().unwrap() > 30 && saw["cases"].as_u64().unwrap() > 500, "{saw}");
}
