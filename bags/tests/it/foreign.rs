//! Bags of others: what rosbag2 of every version, other writers of MCAP, and accidents leave.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use swath_bags::metadata::BagInformation;
use swath_bags::ops::cat::cat;
use swath_bags::ops::copy::{Copied, filter, merge};
use swath_bags::ops::info::{info, info_in_detail};
use swath_bags::ops::recover::recover;
use swath_bags::ops::validate::validate;
use swath_bags::qos::{Durability, QosProfile};
use swath_bags::{Bag, BagError, BagOptions, BagWriter, Compression, Filter, ReadOptions, Topic, TopicPattern};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::std_msgs::Header;

use crate::common::contents::found;
use crate::common::{cdr, run_python, topic};

/// The start of most of these bags [ns].
const START: u64 = 1_700_000_000_000_000_000;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn open(name: &str) -> Bag {
    Bag::open(&data(name)).unwrap()
}

fn plain() -> BagOptions {
    BagOptions { compression: Compression::None, ..BagOptions::default() }
}

/// The lines of `cat`, and what was passed over.
fn printed(bag: &Bag) -> (Vec<Value>, Vec<String>) {
    let (mut out, mut faults) = (Vec::new(), Vec::new());
    cat(bag, &Filter::default(), None, &mut out, &mut faults).unwrap();
    let lines = out.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    (lines.map(|line| serde_json::from_slice(line).unwrap()).collect(), faults)
}

/// The messages of a bag of texts; all can be read.
fn texts(bag: &Bag) -> Vec<String> {
    let (lines, faults) = printed(bag);
    assert_eq!(faults, [""; 0]);
    lines.iter().map(|line| line["message"]["data"].as_str().unwrap_or_else(|| panic!("{line}")).to_owned()).collect()
}

/// `m0` to `m4`, as several bags have them.
const FIVE: [&str; 5] = ["m0", "m1", "m2", "m3", "m4"];

/// All of a bag in a new one without compression; the new bag's only file.
fn filtered(bag: &Bag, temp: &Path) -> (Copied, PathBuf) {
    let to = temp.join("filtered");
    let copied = filter(bag, &Filter::default(), &to, plain()).unwrap();
    (copied, to.join("filtered_0.mcap"))
}

/// Copies a folder of bags to work on.
fn copy(name: &str, temp: &Path) -> PathBuf {
    let to = temp.join(name);
    fs::create_dir(&to).unwrap();
    for entry in fs::read_dir(data(name)).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
    to
}

fn swath_bag(args: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_swath-bag")).args(args).output().unwrap()
}

#[test]
fn chunks_without_messages_say_nothing_of_time() {
    let bag = open("cpp202_defs_only_chunk.mcap");
    assert_eq!(bag.time_range(), Some((START, START + 400_000_000)));
    assert_eq!(texts(&bag), FIVE);
    let output = swath_bag(&["cat", data("cpp202_defs_only_chunk.mcap").to_str().unwrap(), "--to", "+0.2"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 3, "+ is from the first message on");
}

#[test]
fn what_a_summary_lacks_is_found_in_the_data() {
    for (name, messages) in [("no_repeated_channels.mcap", 5), ("empty_counts.mcap", 3)] {
        let bag = open(name);
        let told = info(&bag);
        assert_eq!(
            (told.messages, told.topics[0].name.as_str(), told.topics[0].messages),
            (messages, "/chatter", messages)
        );
        assert_eq!(texts(&bag), FIVE[..messages as usize], "{name}");
    }
    let bag = open("metadata_no_index.mcap");
    assert_eq!(bag.metadata_named("swath_manifest").unwrap()["a"], "b");
    let bag = open("chunk_plus_loose.mcap");
    assert_eq!((bag.message_count(), bag.time_range()), (4, Some((START, START + 1_000_000_000))));
    assert_eq!(texts(&bag), ["m0", "m1", "m2", "loose"]);
}

#[test]
fn qos_in_numbers_is_read_and_written_in_words() {
    let temp = tempfile::tempdir().unwrap();
    let bag = open("humble_latched.mcap");
    let map = bag.topics().iter().find(|topic| topic.topic.name == "/map").unwrap();
    assert_eq!(map.topic.qos[0].durability, Durability::TransientLocal);
    let (_, file) = filtered(&bag, temp.path());
    let again = Bag::open(&temp.path().join("filtered")).unwrap();
    assert_eq!(again.topics()[1].topic.qos, map.topic.qos);
    assert!(fs::read(&file).unwrap().windows(27).any(|bytes| bytes == b"durability: transient_local"));
    let listed =
        BagInformation::read(again.path()).unwrap().unwrap().topics_with_message_count.remove(1).topic_metadata;
    assert_eq!(listed.offered_qos_profiles, map.topic.qos);
    let facts: Value = serde_json::from_str(&run_python("read_rosbags.py", &temp.path().join("filtered"))).unwrap();
    assert_eq!(
        (&facts["message_count"], &facts["topics"]["/map"]["durability"]),
        (&json!(101), &json!("TRANSIENT_LOCAL"))
    );
}

#[test]
fn test_bags_of_rosbag2_are_read_alike_by_others_after_filtering() {
    let temp = tempfile::tempdir().unwrap();
    for (n, name, messages) in
        [(0, "rosbag2_cdr_test", 7), (1, "rosbag2_cdr_test_db3", 7), (2, "rosbag2_topics_and_services.mcap", 13)]
    {
        let bag = open(name);
        assert_eq!((bag.message_count(), bag.faults()), (messages, &[][..]), "{name}");
        assert_eq!(validate(&data(name), None, ReadOptions::default()).unwrap().faults, [""; 0], "{name}");
        let to = temp.path().join(n.to_string());
        filter(&bag, &Filter::default(), &to, BagOptions::default()).unwrap();
        assert_eq!(printed(&Bag::open(&to).unwrap()), printed(&bag), "{name}");
        if n < 2 {
            let facts: Value = serde_json::from_str(&run_python("read_rosbags.py", &to)).unwrap();
            assert_eq!(facts["message_count"], messages, "{name}");
        }
        let facts: Value = serde_json::from_str(&run_python("count_mcap.py", &to)).unwrap();
        assert_eq!(facts["messages"], messages, "{name}");
    }
}

#[test]
fn information_of_other_versions_counts() {
    let temp = tempfile::tempdir().unwrap();
    let bag = open("metadata_v8_iron");
    let information = bag.information().unwrap();
    assert_eq!((information.version, information.ros_distro.as_str()), (8, "iron"));
    filtered(&bag, temp.path());
    let written = BagInformation::read(&temp.path().join("filtered")).unwrap().unwrap();
    assert_eq!((written.version, written.ros_distro.as_str()), (9, "iron"));
    assert_eq!(written.custom_data.unwrap()["vehicle"], "sat-7");
    assert_eq!(validate(&data("metadata_v8_iron"), None, ReadOptions::default()).unwrap().faults, [""; 0]);
}

#[test]
fn information_within_a_file_stands_for_that_beside_it() {
    assert_eq!(open("rosbag2_only_services.mcap").information().unwrap().ros_distro, "rolling");
}

#[test]
fn schemas_attachments_metadata_and_profile_are_kept_byte_for_byte() {
    for name in
        ["foreign.mcap", "two_binary_schemas.mcap", "schemaless_zero_len.mcap", "odd_names.mcap", "ros2idl.mcap"]
    {
        let temp = tempfile::tempdir().unwrap();
        let bag = open(name);
        let (copied, file) = filtered(&bag, temp.path());
        assert_eq!(copied.faults, [""; 0]);
        let kept = found(&fs::read(&file).unwrap());
        // The second opinion reads no compressed chunks: the copy of a copy has none.
        let again = temp.path().join("again");
        let saved = recover(&data(name), &again, plain(), ReadOptions::default()).unwrap();
        assert_eq!(saved.faults, [""; 0]);
        assert_eq!(found(&fs::read(again.join("again_0.mcap")).unwrap()), kept, "{name}");
        assert_eq!(kept.profile, bag.profile());
        for (topic, (kept_topic, encoding, metadata, schema)) in bag.topics().iter().zip(&kept.channels) {
            let topic = &topic.topic;
            assert_eq!((&topic.name, &topic.message_encoding), (kept_topic, encoding));
            if name != "ros2idl.mcap" {
                assert_eq!(topic.metadata, *metadata, "{name}");
            }
            let ours =
                topic.definition.as_ref().map(|d| (topic.type_name.clone(), d.encoding.clone(), d.data.to_vec()));
            assert_eq!(ours, *schema, "{name}");
        }
        assert_eq!(bag.message_count() as usize, kept.messages.len());
    }
    let kept = open("foreign.mcap");
    assert_eq!(
        (kept.attachments()[0].name.as_str(), kept.attachments()[0].bytes, kept.profile()),
        ("calib.yaml", 5, "x")
    );
    let binary: Vec<u8> = (0x80..=0xff).collect();
    assert!(kept.topics()[1].topic.schema().starts_with(&binary[..60]));
    assert_eq!(open("schemaless_zero_len.mcap").topics()[0].topic.definition, None);
    let two: Vec<_> =
        open("two_binary_schemas.mcap").topics().iter().map(|topic| topic.topic.schema().to_vec()).collect();
    assert_eq!(two, [b"\xff\xfe", b"\xfd\xfc"]);
}

#[test]
fn merging_keeps_what_filtering_keeps() {
    let temp = tempfile::tempdir().unwrap();
    let bags = ["foreign.mcap", "two_binary_schemas.mcap"].map(data);
    let to = temp.path().join("merged");
    let copied = merge(&bags, &to, plain(), ReadOptions::default()).unwrap();
    assert_eq!((copied.summary.messages, copied.faults), (4, vec![]));
    let kept = found(&fs::read(to.join("merged_0.mcap")).unwrap());
    let topics: Vec<_> = kept.channels.iter().map(|channel| channel.0.as_str()).collect();
    assert_eq!(topics, ["/a", "/b", "/json", "/proto"]);
    assert_eq!(kept.attachments.len(), 1);
    assert_eq!(kept.channels[3].2["callerid"], "me");
    let clash = [data("odd_names.mcap"), data("schemas2.mcap"), temp.path().join("clash")];
    let writer = BagWriter::create(&clash[2], plain()).unwrap();
    writer.add_topic(&Topic::new("/lead", "std_msgs/msg/UInt8", "uint8 data\n", "", vec![]).unwrap()).unwrap();
    writer.close().unwrap();
    let refused = merge(&clash, &temp.path().join("none"), plain(), ReadOptions::default());
    assert!(matches!(refused, Err(BagError::Topic { topic, .. }) if topic == "/lead"));
}

#[test]
fn the_list_of_files_counts() {
    let temp = tempfile::tempdir().unwrap();
    assert_eq!(texts(&open("stray")), FIVE, "a stray copy is none of the bag");
    let split = open("split");
    let numbers: Vec<String> = (0..120).map(|n| n.to_string()).collect();
    assert_eq!((texts(&split), split.faults()), (numbers.clone(), &[][..]));

    let lost = copy("split", temp.path());
    fs::remove_file(lost.join("split_5.mcap")).unwrap();
    let bag = Bag::open(&lost).unwrap();
    assert_eq!(bag.faults(), [format!("{} is missing, the bag's list has it", lost.join("split_5.mcap").display())]);
    assert_eq!(texts(&bag).len(), 110);
    for command in ["info", "cat"] {
        let output = swath_bag(&[command, lost.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(3), "{command}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("split_5.mcap is missing"));
    }

    // A file that was not closed in time is not in the list, and yet carries the bag's name.
    let unlisted = copy("stray", temp.path());
    fs::rename(unlisted.join("backup.mcap"), unlisted.join("stray_1.mcap")).unwrap();
    let bag = Bag::open(&unlisted).unwrap();
    assert_eq!((texts(&bag).len(), bag.faults().len()), (5, 1));
    assert!(bag.faults()[0].ends_with("stray_1.mcap is not in the bag's list"), "{:?}", bag.faults());
    let saved = recover(&unlisted, &temp.path().join("saved"), plain(), ReadOptions::default()).unwrap();
    assert_eq!(saved.summary.messages, 10, "recovery takes it along");
}

#[test]
fn a_bag_whose_files_were_renamed_is_read_and_told() {
    let temp = tempfile::tempdir().unwrap();
    let dir = copy("metadata_v8_iron", temp.path());
    fs::rename(dir.join("v8_0.mcap"), dir.join("other.mcap")).unwrap();
    let bag = Bag::open(&dir).unwrap();
    assert_eq!((texts(&bag).len(), bag.faults().len()), (5, 2));
    fs::remove_file(dir.join("other.mcap")).unwrap();
    let error = Bag::open(&dir).unwrap_err().to_string();
    assert!(error.ends_with("v8_0.mcap is missing, the bag's list has it"), "{error}");
}

#[test]
fn lists_of_the_oldest_bags_begin_with_the_directory() {
    let temp = tempfile::tempdir().unwrap();
    let old = copy("metadata_v8_iron", temp.path());
    let yaml = fs::read_to_string(old.join("metadata.yaml")).unwrap();
    let yaml = yaml.replace("version: 8", "version: 2").replace("    - v8_0.mcap", "    - metadata_v8_iron/v8_0.mcap");
    fs::write(old.join("metadata.yaml"), yaml).unwrap();
    assert_eq!(texts(&Bag::open(&old).unwrap()), FIVE);
}

#[test]
fn one_damaged_file_does_not_keep_the_others_from_being_read() {
    let temp = tempfile::tempdir().unwrap();
    let dir = copy("split", temp.path());
    let path = dir.join("split_3.mcap");
    let bytes = fs::read(&path).unwrap();
    fs::write(&path, &bytes[..300]).unwrap();
    let bag = Bag::open(&dir).unwrap();
    assert_eq!((texts(&bag).len(), bag.faults().len()), (110, 1));
    assert!(bag.faults()[0].contains("split_3.mcap: offset 300: the file's end is missing"), "{:?}", bag.faults());
    let output = swath_bag(&["filter", dir.to_str().unwrap(), "-o", temp.path().join("f").to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("split_3.mcap"));
    fs::write(dir.join("metadata.yaml"), "nonsense").unwrap();
    let bag = Bag::open(&dir).unwrap();
    assert_eq!((bag.message_count(), bag.faults().len()), (110, 2), "{:?}", bag.faults());
}

#[test]
fn compression_by_file_and_by_message_is_read() {
    for name in ["filemode", "filemode/filemode_0.mcap.zstd", "msgmode", "msgmode/msgmode_0.mcap"] {
        let temp = tempfile::tempdir().unwrap();
        assert_eq!(texts(&open(name)), FIVE, "{name}");
        filtered(&open(name), temp.path());
        recover(&data(name), &temp.path().join("saved"), plain(), ReadOptions::default()).unwrap();
        for new in ["filtered", "saved"] {
            let new = temp.path().join(new);
            assert_eq!(texts(&Bag::open(&new).unwrap()), FIVE, "{name}");
            assert_eq!(BagInformation::read(&new).unwrap().unwrap().compression_mode, "", "{name}");
        }
    }
}

#[test]
fn compression_that_is_not_known_is_named() {
    let temp = tempfile::tempdir().unwrap();
    let dir = copy("msgmode", temp.path());
    let yaml = fs::read_to_string(dir.join("metadata.yaml")).unwrap();
    fs::write(dir.join("metadata.yaml"), yaml.replace("\"zstd\"", "\"snappy\"")).unwrap();
    let error = Bag::open(&dir).unwrap_err().to_string();
    assert!(error.ends_with("it is compressed with \"snappy\" in mode \"MESSAGE\", only zstd is known"), "{error}");
    let cut = temp.path().join("cut.mcap.zstd");
    fs::write(&cut, &fs::read(data("filemode/filemode_0.mcap.zstd")).unwrap()[..200]).unwrap();
    let error = Bag::open(&cut).unwrap_err().to_string();
    assert!(error.contains("cut.mcap.zstd: offset 0: after 0 unpacked bytes: "), "{error}");
}

#[test]
fn service_events_and_idl_are_decoded() {
    let event = json!({
        "info": {
            "event_type": 1,
            "stamp": {"sec": 1_697_521_953, "nanosec": 726_063_806},
            "client_gid": [1, 15, 235, 125, 108, 42, 169, 210, 0, 0, 0, 0, 0, 0, 19, 4],
            "sequence_number": 1,
        },
        "request": [{"a": 1, "b": 3}],
        "response": [],
    });
    let (lines, _) = printed(&open("rosbag2_only_services.mcap"));
    assert_eq!((lines.len(), &lines[0]["message"]), (12, &event));
    let (lines, _) = printed(&open("schemas2.mcap"));
    assert_eq!(lines[0]["message"], event, "a header SRV: at the start");
    assert_eq!(lines[1]["message"], json!({"data": "hi"}), "a header MSG: at the start");
    assert_eq!(lines[2]["message"], json!({"i": {"x": 7}}), "a message with a member in IDL");
    assert_eq!(lines[3]["message"], event, "the event's own text");
    let (lines, _) = printed(&open("ros2idl.mcap"));
    assert_eq!(lines[0]["message"], json!({"x": 1.0, "y": 2.0, "z": [1, 2]}));
    let told = info_in_detail(&open("rosbag2_topics_and_services.mcap")).unwrap();
    let service = &told.services[0];
    assert_eq!(
        (service.name.as_str(), service.type_name.as_str()),
        ("/add_two_ints", "example_interfaces/srv/AddTwoInts")
    );
    let counts = service.details.unwrap();
    assert_eq!((counts.requests, counts.responses, service.events), (3, 3, 6));
    assert!(
        told.to_string().contains("Service: /add_two_ints | Type: example_interfaces/srv/AddTwoInts | Event Count: 6")
    );
}

#[test]
fn every_plain_encapsulation_is_decoded_and_others_are_named() {
    let (lines, _) = printed(&open("encapsulations.mcap"));
    let told: Vec<&str> =
        lines.iter().map(|l| l["message"]["data"].as_str().or(l["error"].as_str()).unwrap()).collect();
    let refused = |kind: &str| format!("CDR of std_msgs/msg/String, byte 0: encapsulation {kind} is not plain CDR");
    assert_eq!(told, ["be", "le", &refused("0x00 0x03"), "xcdr2_le", "xcdr2_be", &refused("0x00 0x09"), "pad"]);
}

#[test]
fn types_without_their_middle_part_are_decoded() {
    assert_eq!(texts(&open("odd_names.mcap")), ["a", "b"]);
}

#[test]
fn a_limit_that_can_be_raised_and_a_code_that_says_loss() {
    let temp = tempfile::tempdir().unwrap();
    let path = data("one_270MB_message.mcap");
    let run = |command: &str, more: &[&str]| {
        let to = temp.path().join(format!("{command}{}", more.len()));
        let args = [&[command, path.to_str().unwrap(), "-o", to.to_str().unwrap()][..], more].concat();
        let output = swath_bag(&args);
        (output.status.code(), Bag::open(&to).unwrap().message_count())
    };
    for command in ["recover", "filter"] {
        assert_eq!(run(command, &[]), (Some(3), 0), "{command}");
        assert_eq!(run(command, &["--max-record-size", "300000000"]), (Some(0), 1), "{command}");
    }
    let output = swath_bag(&["cat", path.to_str().unwrap()]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr.contains("offset 159: chunk of 283115559 bytes, the limit is 268435456: raise it with"), "{stderr}");
}

#[test]
fn sqlite_bags_are_read_as_mcap_bags_are() {
    assert_eq!(printed(&open("rosbag2_cdr_test_db3")).0, printed(&open("rosbag2_cdr_test")).0);
    assert_eq!(info(&open("rosbag2_cdr_test_db3")).storage, "sqlite3");
    let lone = open("rosbag2_cdr_test_db3/cdr_test_0.db3");
    assert_eq!(lone.topics()[1].topic.qos[0].depth, 3, "QoS in numbers is in the file, too");
    let old = open("rosbag2_seek_db3");
    assert_eq!((old.message_count(), old.topics()[0].topic.type_name.as_str()), (5, "test_msgs/BasicTypes"));
    assert_eq!(printed(&old).0[0]["error"], "no schema known for test_msgs/BasicTypes");
    // A chunk of rows ends between messages of one time as well.
    let temp = tempfile::tempdir().unwrap();
    let saved =
        recover(&data("rosbag2_cdr_test_db3"), &temp.path().join("saved"), plain(), ReadOptions::default()).unwrap();
    assert_eq!((saved.summary.messages, saved.faults), (7, vec![]));
    let cut = temp.path().join("cut.db3");
    let bytes = fs::read(data("rosbag2_cdr_test_db3/cdr_test_0.db3")).unwrap();
    fs::write(&cut, &bytes[..5000]).unwrap();
    let error = Bag::open(&cut).unwrap_err();
    assert!(matches!(&error, BagError::Sqlite { path, .. } if *path == cut), "{error:?}");
}

/// A bag of two topics whose chunks hold one topic each; the offset of each chunk's record.
fn two_topics(dir: &Path) -> Vec<usize> {
    let bag = BagWriter::create(dir, BagOptions { chunk_bytes: 100, ..plain() }).unwrap();
    let clock = bag.add_topic(&topic::<Clock>("/clock", QosProfile::reliable(1))).unwrap();
    let header = bag.add_topic(&topic::<Header>("/header", QosProfile::reliable(1))).unwrap();
    for (topic, message) in [(clock, cdr(&Clock::default())), (header, cdr(&Header::default()))] {
        for time in 0..20 {
            bag.write(topic, time, time, &message).unwrap();
        }
        // Chunks end at their size: the last of a topic is filled up with the topic's own.
        while !bag.counter().messages().is_multiple_of(4) {
            bag.write(topic, 20, 20, &message).unwrap();
        }
    }
    bag.close().unwrap();
    let bytes = fs::read(dir.join("bag_0.mcap")).unwrap();
    let mut at = 8;
    let mut chunks = Vec::new();
    while at + 9 < bytes.len() - 8 {
        if bytes[at] == mcap::records::op::CHUNK {
            chunks.push(at);
        }
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    chunks
}

#[test]
fn only_the_chunks_that_hold_a_topic_are_read() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("bag");
    let chunks = two_topics(&dir);
    let path = dir.join("bag_0.mcap");
    let mut bytes = fs::read(&path).unwrap();
    // The first chunk, of /clock, is damaged: whoever unpacks it gets an error.
    bytes[chunks[0] + 60] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let bag = Bag::open(&dir).unwrap();
    let read = |topic: &str| {
        let topics = TopicPattern::new(&[topic.to_owned()], None, None).unwrap();
        let (mut out, mut faults) = (Vec::new(), Vec::new());
        cat(&bag, &Filter { topics, ..Filter::default() }, None, &mut out, &mut faults).unwrap();
        (out.iter().filter(|byte| **byte == b'\n').count(), faults.len())
    };
    assert_eq!(read("/header").1, 0);
    let (clocks, faults) = read("/clock");
    assert!(faults == 1 && clocks > 10, "{clocks} messages, {faults} faults");
}

#[test]
fn recovery_goes_on_behind_a_record_that_cannot_be_found() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("bag");
    let chunks = two_topics(&dir);
    let path = dir.join("bag_0.mcap");
    let whole = recover(&path, &temp.path().join("whole"), plain(), ReadOptions::default()).unwrap().summary.messages;
    let mut bytes = fs::read(&path).unwrap();
    // The length of the second chunk is damaged: what follows is no record any more.
    bytes[chunks[1] + 1] ^= 0x55;
    fs::write(&path, &bytes).unwrap();
    let recovery = recover(&path, &temp.path().join("saved"), plain(), ReadOptions::default()).unwrap();
    assert!(!recovery.faults.is_empty());
    assert!(recovery.summary.messages + 8 >= whole, "{} of {whole}", recovery.summary.messages);
}

#[test]
fn sixty_thousand_topics() {
    let temp = tempfile::tempdir().unwrap();
    let (dir, part) = (temp.path().join("bag"), temp.path().join("part"));
    let bag = BagWriter::create(&dir, BagOptions::default()).unwrap();
    for n in 0..60_000u64 {
        let topic =
            Topic::new(&format!("/t{n}"), "std_msgs/msg/UInt64", "uint64 data\n", "", vec![QosProfile::reliable(1)]);
        let topic = bag.add_topic(&topic.unwrap()).unwrap();
        bag.write(topic, n, n, &[&[0, 1, 0, 0][..], &n.to_le_bytes()].concat()).unwrap();
    }
    bag.close().unwrap();
    let bag = Bag::open(&dir).unwrap();
    assert_eq!((bag.topics().len(), bag.message_count()), (60_000, 60_000));
    let topics = TopicPattern::new(&["/t59999".to_owned()], None, None).unwrap();
    let copied = filter(&bag, &Filter { topics, ..Filter::default() }, &part, BagOptions::default()).unwrap();
    assert_eq!(copied.summary.messages, 1);
    assert_eq!(validate(&dir, None, ReadOptions::default()).unwrap().faults, [""; 0]);
}

#[test]
fn a_damaged_attachment_is_told_and_not_recovered() {
    let temp = tempfile::tempdir().unwrap();
    let path = temp.path().join("damaged.mcap");
    let mut bytes = fs::read(data("foreign.mcap")).unwrap();
    let at = bytes.windows(4).position(|window| window == b"a: 1").unwrap();
    bytes[at] = b'b';
    fs::write(&path, &bytes).unwrap();
    let faults = validate(&path, None, ReadOptions::default()).unwrap().faults;
    assert!(faults.iter().any(|fault| fault.contains("attachment checksum is")), "{faults:?}");
    let to = temp.path().join("saved");
    let recovery = recover(&path, &to, plain(), ReadOptions::default()).unwrap();
    assert_eq!((recovery.faults.len(), recovery.summary.messages), (1, 2), "{:?}", recovery.faults);
    assert_eq!(Bag::open(&to).unwrap().attachments().len(), 0);
}

#[test]
fn an_empty_type_hash_is_no_fault() {
    let temp = tempfile::tempdir().unwrap();
    let dir = temp.path().join("bag");
    let bag = BagWriter::create(&dir, BagOptions::default()).unwrap();
    let known = swath_msgs::Interface::find("rosgraph_msgs/msg/Clock").unwrap();
    let topic = Topic::new("/clock", known.type_name, known.schema, "", vec![QosProfile::reliable(1)]).unwrap();
    let topic = bag.add_topic(&topic).unwrap();
    bag.write(topic, 0, 0, &cdr(&Clock::default())).unwrap();
    bag.close().unwrap();
    let report = validate(&dir, None, ReadOptions::default()).unwrap();
    assert_eq!((report.faults, report.warnings), (vec![], vec![]));
}
