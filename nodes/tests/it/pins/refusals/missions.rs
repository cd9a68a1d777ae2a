//! Missions that cannot be flown.

use super::{Case, refuse};
use crate::pins::place::Place;

const LAUNCH: &str = "swath launch m.toml --in-process --out out";

const FILES: &[Case] = &[
    (&[], "swath launch nowhere.toml"),
    (&[("m.toml", "orbits = ")], LAUNCH),
    (&[("m.toml", "orbit = 1.0")], LAUNCH),
    (&[("m.toml", "orbits = 0.0")], LAUNCH),
    (&[("m.toml", "pace = nan")], LAUNCH),
    (&[("m.toml", "planner = \"clever\"")], LAUNCH),
    (&[("m.toml", "planner = \"heuristic:-5\"")], LAUNCH),
    (&[("m.toml", "planner = \"beam:0x2\"")], LAUNCH),
    (&[("m.toml", "[requests]\nmax_attempts = 0")], LAUNCH),
    (&[("m.toml", "[requests]\nfiles = [\"nowhere.geojson\"]")], LAUNCH),
    (&[("m.toml", "[requests.random]\ncount = [5, 2]")], LAUNCH),
    (&[("m.toml", "[requests.random]\npriority = [0.0, 1.5]")], LAUNCH),
    (&[("m.toml", "[approval]\nmode = \"ask\"")], LAUNCH),
    (&[("m.toml", "[sim.orbit]\naltitude = 520.0")], LAUNCH),
    (&[("m.toml", "[sim.orbit]\naltitude_km = 100.0")], LAUNCH),
    (&[("m.toml", "[sim.control]\nfrequency_hz = 0.3")], LAUNCH),
    (&[("m.toml", "[sim.imaging]\nsigma_max = 7.0")], LAUNCH),
    (&[("m.toml", "[sim.spacecraft]\nwheel_inertia_kg_m2 = 90.0")], LAUNCH),
    (&[("m.toml", "[sim.requests]\nlength_min_km = 600.0")], LAUNCH),
    (&[("m.toml", "[initial.orbit]\nraan_deg = 0.0")], LAUNCH),
    (&[("m.toml", "[link]")], LAUNCH),
    (&[("m.toml", "[link]\nstations = [\"atlantis\"]")], LAUNCH),
    (&[("m.toml", "[link]\nstations = [\"tokyo\"]\nmask_deg = 91.0")], LAUNCH),
    (&[("m.toml", "[link]\nstations = [\"tokyo\"]\nuplink_bps = 0")], LAUNCH),
    (&[("m.toml", "orbits = 1.0")], "swath passes m.toml"),
    (&[("m.toml", "[link]\nstations = [\"tokyo\"]")], "swath passes m.toml --hours nan"),
];

const OPTIONS: &[Case] = &[
    (&[], "swath"),
    (&[], "swath fly"),
    (&[("m.toml", "[requests.random]\ncount = [50, 50]")], "swath launch m.toml --orbits many"),
    (&[], "swath launch m.toml --orbits 20000"),
    (&[], "swath launch m.toml --planner clever"),
    (&[], "swath launch m.toml --pace -1"),
    (&[("full/file", "")], "swath launch m.toml --in-process --out full"),
    (&[("file", "")], "swath launch m.toml --in-process --out file"),
];

const REQUESTS: &[Case] = &[
    (
        &[
            ("m.toml", "[requests]\nfiles = [\"s.geojson\"]"),
            ("s.geojson", r#"{"type":"LineString","coordinates":[[1,2]"#),
        ],
        LAUNCH,
    ),
    (&[("s.geojson", r#"{"type":"Point","coordinates":[1,2]}"#)], LAUNCH),
    (
        &[(
            "s.geojson",
            r#"{"type":"Feature","properties":{"priority":"high"},"geometry":{"type":"LineString","coordinates":[[1,2],[3,4]]}}"#,
        )],
        LAUNCH,
    ),
    (
        &[(
            "s.geojson",
            r#"{"type":"Feature","properties":{"valid_from":"soon"},"geometry":{"type":"LineString","coordinates":[[1,2],[3,4]]}}"#,
        )],
        LAUNCH,
    ),
    (
        &[(
            "s.geojson",
            r#"{"type":"Feature","properties":{"max_attempts":-1},"geometry":{"type":"LineString","coordinates":[[1,2],[3,4]]}}"#,
        )],
        LAUNCH,
    ),
    (&[("s.geojson", r#"{"type":"Feature","properties":{},"geometry":null}"#)], LAUNCH),
];

#[test]
fn missions() {
    refuse("mission_files", &Place::new(), FILES);
    refuse("mission_options", &Place::new(), OPTIONS);
    refuse("mission_requests", &Place::new(), REQUESTS);
}
