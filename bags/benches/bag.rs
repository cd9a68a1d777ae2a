//! Speed of writing and reading bags.
#![allow(clippy::unwrap_used, missing_docs, reason = "a bench that cannot go on should panic")]

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use swath_bags::qos::QosProfile;
use swath_bags::{Bag, BagOptions, BagWriter, Compression, Filter, Topic};

const MESSAGES: u64 = 200_000;
const MESSAGE_BYTES: usize = 300;

/// Payloads as missions have them: numbers that change slowly, about three to one for zstd.
fn payloads() -> Vec<Vec<u8>> {
    let payload = |n: usize| {
        let numbers = (0..MESSAGE_BYTES / 8 - 1).map(|i| ((n * 37 + i * 1001) as f64 / 97.0).sin());
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(numbers.flat_map(|x| ((x * 4096.0).round() / 4096.0).to_le_bytes()));
        bytes.resize(MESSAGE_BYTES, 0);
        bytes
    };
    (0..1024).map(payload).collect()
}

fn write(dir: &Path, compression: Compression, payloads: &[Vec<u8>]) {
    let bag = BagWriter::create(dir, BagOptions { compression, ..BagOptions::default() }).unwrap();
    let topic = Topic::new("/x", "a/msg/B", "uint8[292] x\n", "", vec![QosProfile::reliable(1)]);
    let topic = bag.add_topic(&topic.unwrap()).unwrap();
    for n in 0..MESSAGES {
        bag.write(topic, n, n, &payloads[n as usize % payloads.len()]).unwrap();
    }
    bag.close().unwrap();
}

fn benches(criterion: &mut Criterion) {
    let payloads = payloads();
    let temp = tempfile::tempdir().unwrap();
    let kinds = [("none", Compression::None), ("lz4", Compression::Lz4), ("zstd", Compression::Zstd)];
    let mut group = criterion.benchmark_group("bag");
    group.sample_size(10);
    for (name, compression) in kinds {
        group.throughput(Throughput::Bytes(MESSAGES * MESSAGE_BYTES as u64));
        group.bench_function(format!("write {name}"), |bencher| {
            bencher.iter_batched(
                || tempfile::tempdir_in(temp.path()).unwrap(),
                |dir| write(&dir.path().join("bag"), compression, &payloads),
                criterion::BatchSize::PerIteration,
            );
        });
        let dir = temp.path().join(name);
        write(&dir, compression, &payloads);
        group.throughput(Throughput::Elements(MESSAGES));
        group.bench_function(format!("read {name}"), |bencher| {
            bencher.iter(|| {
                let bag = Bag::open(&dir).unwrap();
                let mut messages = bag.messages(&Filter::default()).unwrap();
                while let Some(message) = messages.next().unwrap() {
                    black_box(message.data);
                }
            });
        });
    }
    group.finish();
}

criterion_group!(bag, benches);
criterion_main!(bag);
