//! Nodes that cannot come up.

use super::{Case, refuse};
use crate::pins::place::Place;

const WORDS: &[Case] = &[
    (&[], "swath-spacecraft --fast"),
    (&[], "swath-guidance --ros-args -p mission=m.toml"),
    (&[], "swath-planner --ros-args -r a:="),
    (&[], "swath-planner --ros-args --log-level loud"),
    (&[], "swath-requests --ros-args -r __ns:=swath"),
    (&[("p.yaml", "swath: 3")], "swath-spacecraft --ros-args --params-file p.yaml"),
];

const MISSIONS: &[Case] = &[
    (&[], "swath-spacecraft"),
    (&[], "swath-guidance --ros-args -p mission:=nowhere.toml"),
    (&[("m.toml", "orbits = -1.0")], "swath-planner --ros-args -p mission:=m.toml"),
    (&[("m.toml", "orbits = 1.0")], "swath-requests --ros-args -p mission:=m.toml -p store:=nowhere/requests.sqlite"),
    (
        &[(
            "text.sqlite",
            "This is a text, and as long as a header of SQLite must be: one hundred bytes. It goes on until then.",
        )],
        "swath-requests --ros-args -p mission:=m.toml -p store:=text.sqlite",
    ),
    (&[], "swath-requests --ros-args -p mission:=m.toml -p shop:=requests.sqlite"),
    (&[], "swath-guidance --ros-args -p mission:=m.toml -p pace:=fast"),
    (&[], "swath-planner --ros-args -p mission:=m.toml -p planner:=clever"),
    (&[], "swath-spacecraft --ros-args -p mission:=m.toml -p peer_timeout_s:=0.5"),
    (&[], "swath-catalogue --ros-args -p mission:=m.toml"),
    (&[], "swath-link --ros-args -p mission:=m.toml"),
];

#[test]
fn node_words() {
    refuse("node_words", &Place::new(), WORDS);
}

#[test]
fn node_missions() {
    refuse("node_missions", &Place::with_domain(), MISSIONS);
}
