//! Writes the seeds of the fuzz target: `fuzz_seeds fuzz/seeds/read_bag`.
//!
//! Their checksums are zero, which means unchecked, so that changed bytes reach the parsers.
#![allow(clippy::unwrap_used, reason = "an example that cannot go on should panic")]

use std::{env, fs, path::Path};

use swath_bags::{BagOptions, BagWriter, Compression, Topic, qos::QosProfile};
use swath_msgs::Interface;

fn main() {
    let to = env::args().nth(1).unwrap();
    let temp = tempfile::tempdir().unwrap();
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let name = format!("{compression:?}").to_lowercase();
        let dir = temp.path().join(&name);
        write(&dir, compression);
        let mut bytes = fs::read(dir.join(format!("{name}_0.mcap"))).unwrap();
        clear_checksums(&mut bytes);
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

/// Sets the checksums of chunks (opcode 6), data section (15) and summary (2) to zero.
fn clear_checksums(bytes: &mut [u8]) {
    let mut at = 8;
    while at + 9 <= bytes.len() - 8 {
        let len = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let checksum = match bytes[at] {
            0x06 => Some(at + 9 + 24),
            0x0f => Some(at + 9),
            0x02 => Some(at + 9 + 16),
            _ => None,
        };
        if let Some(checksum) = checksum {
            bytes[checksum..checksum + 4].fill(0);
        }
        at += 9 + len;
    }
}
