//! Writes the seeds of the fuzz target: `fuzz_seeds fuzz/seeds/read_bag`.
//!
//! Their checksums are zero, which means unchecked, so that changed bytes reach the parsers.
#![allow(clippy::unwrap_used, reason = "an example that cannot go on should panic")]

#[path = "../tests/it/common/conformance.rs"]
mod conformance;
#[path = "../tests/it/common/mutate.rs"]
mod mutate;

use std::path::Path;
use std::{env, fs};

use swath_bags::qos::QosProfile;
use swath_bags::{BagOptions, BagWriter, Compression, Topic};
use swath_msgs::Interface;

fn main() {
    let to = env::args().nth(1).unwrap();
    let temp = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let name = format!("{compression:?}").to_lowercase();
        let dir = temp.path().join(&name);
        write(&dir, compression);
        let mut bytes = fs::read(dir.join(format!("{name}_0.mcap"))).unwrap();
        mutate::clear_checksums(&mut bytes);
        fs::write(Path::new(&to).join(format!("{name}.mcap")), bytes).unwrap();
    }
}

fn write(dir: &Path, compression: Compression) {
    let options = BagOptions { compression, chunk_bytes: 100, ..BagOptions::default() };
    let bag = BagWriter::create(dir, options).unwrap();
    for (n, type_name) in ["rosgraph_msgs/msg/Clock", "std_msgs/msg/Header"].into_iter().enumerate() {
        let known = Interface::find(type_name).unwrap();
        let qos = vec![QosProfile::latched(1)];
        let name = format!("/{n}");
        let topic = Topic::new(&name, type_name, known.schema, known.type_hash, qos).unwrap();
        let topic = bag.add_topic(&topic).unwrap();
        for time in 0..5 {
            let payload = [0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'a', b'b', 0];
            bag.write(topic, time, time, &payload[..if n == 0 { 12 } else { 19 }]).unwrap();
        }
    }
    bag.add_metadata("facts", [("a".to_owned(), "b".to_owned())].into());
    bag.close().unwrap();
}
