//! Bags that are damaged or hold no mission, and wrong options of `swath-bag`.

use std::fs;

use super::{Case, refuse};
use crate::common::{self, Running};
use crate::pins::golden;
use crate::pins::place::Place;

const BAGS: &[Case] = &[
    (&[], "swath-bag info nowhere"),
    (&[], "swath-bag info empty"),
    (&[("text.mcap", "This is no bag.")], "swath-bag info text.mcap"),
    (&[], "swath-bag validate text.mcap"),
    (&[], "swath-bag info cut.mcap"),
    (&[], "swath-bag refly cut.mcap"),
    (&[], "swath-bag validate flipped.mcap"),
    (&[], "swath-bag refly flipped.mcap"),
    (&[("yaml/metadata.yaml", "rosbag2_bagfile_information: [")], "swath-bag info yaml"),
    (&[], "swath-bag validate renamed"),
    (&[("nothing/metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n")], "swath-bag info nothing"),
    (&[], "swath-bag recover text.mcap -o saved"),
    (&[], "swath-bag filter <repository>/bags/samples/mission -o empty"),
    (&[], "swath-bag merge cut.mcap <repository>/bags/samples/mission -o merged"),
    (&[], "swath-bag report <repository>/bags/samples/mission --namespace /other"),
    (&[], "swath-bag report <repository>/bags/samples/mission -o nowhere/report.html"),
    (&[], "swath-bag refly clock"),
    (&[], "swath-bag refly idle"),
];

const OPTIONS: &[Case] = &[
    (&[], "swath-bag rewind"),
    (&[], "swath-bag refly <repository>/bags/samples/mission --planner clever"),
    (&[], "swath-bag refly <repository>/bags/samples/mission --planner hop-ppo:nowhere.safetensors"),
    (&[], "swath-bag cat <repository>/bags/samples/mission --regex ("),
    (&[], "swath-bag cat <repository>/bags/samples/mission --to late"),
    (&[], "swath-bag export <repository>/bags/samples/mission -o export --step 0"),
    (&[], "swath-bag export <repository>/bags/samples/mission -o export --format pdf"),
    (&[], "swath-bag filter <repository>/bags/samples/mission -o new --compression gzip"),
    (&[], "swath-bag play nowhere"),
    (&[], "swath-bag play <repository>/bags/samples/mission --remap a"),
    (
        &[("qos.yaml", "/clock: {depth: none}")],
        "swath-bag play <repository>/bags/samples/mission --qos-profile-overrides-path qos.yaml",
    ),
    (&[], "swath-bag record -o empty /clock"),
    (&[("m.toml", "planner")], "swath-bag record -o new --manifest m.toml"),
    (&[], "swath-bag record -o new --ros-args -p a"),
];

/// Bags with a fault each, made of the sample.
fn place() -> Place {
    let place = Place::with_domain();
    let sample = golden::repository().join("bags/samples/mission");
    let bytes = fs::read(sample.join("bag_0.mcap")).unwrap();
    place.write("cut.mcap", &bytes[..bytes.len() / 2]);
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 3] ^= 0x10;
    place.write("flipped.mcap", flipped);
    fs::create_dir(place.path("empty")).unwrap();
    place.copy(&sample, "renamed");
    fs::rename(place.path("renamed/bag_0.mcap"), place.path("renamed/other.mcap")).unwrap();
    place.succeed("swath-bag filter <repository>/bags/samples/mission -o clock --topic /clock");
    record_nothing(&place);
    place
}

/// Leaves a bag without a fault that holds no mission.
fn record_nothing(place: &Place) {
    let said = fs::File::create(place.path("said")).unwrap();
    let mut recorder = Running::start(place.command("swath-bag record -o idle /nobody/says/this").stdout(said));
    common::until("the recorder", || place.read("said").contains("\"ready\"").then_some(()));
    recorder.stop();
}

#[test]
fn bags() {
    let place = place();
    refuse("bags", &place, BAGS);
    refuse("bag_options", &place, OPTIONS);
}
