//! Messages that are none, or that nobody of the mission sent: they are counted, and nothing ends.

use std::time::Duration;

use swath_msgs::rmw_dds_common::{Gid, NodeEntitiesInfo, ParticipantEntitiesInfo};
use swath_msgs::swath_msgs::{RequestSummary, SpacecraftState, SubmitStripsRequest, SubmitStripsResponse};
use swath_ros::{Cdr, Node, Subscription, Trouble, encode, graph};

use crate::common::{PATIENCE, Trial, eventually};
use crate::stranger::Stranger;

const STATE_TYPE: &str = "swath_msgs::msg::dds_::SpacecraftState_";

/// Takes, and counts the notices of a kind until there are as many as expected.
fn await_notices(node: &Node, states: &Subscription<SpacecraftState>, trouble: Trouble, count: u64) {
    let (topic, mut counted) = (states.topic(), 0);
    eventually(|| {
        assert_eq!(states.take().unwrap(), None);
        for notice in node.notices() {
            assert_eq!((notice.trouble, notice.topic.as_str()), (trouble, topic), "{notice}");
            counted += notice.count;
        }
        (counted == count).then_some(())
    });
}

#[test]
fn bytes_that_are_no_message_are_counted_and_passed_over() {
    let trial = Trial::new(15);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let entry = graph::SPACECRAFT_STATE.entry;
    let states = spacecraft.raw_publisher(entry.name, entry.type_name, &entry.profile.qos()).unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    eventually(|| (states.matched() == 1 && received.matched() == 1).then_some(()));
    std::thread::sleep(Duration::from_millis(300));
    for garbage in [&[0, 1, 0, 0][..], &[0, 1, 0, 0, 1, 2, 3, 4], &[0, 1, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255]]
    {
        states.publish(Cdr::from_bytes(garbage.to_vec())).unwrap();
    }
    states.publish(encode(&SpacecraftState { tick: 7, ..Default::default() }).unwrap()).unwrap();
    assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, 7);
    await_notices(&guidance, &received, Trouble::Unreadable, 3);
}

#[test]
fn encodings_that_nobody_knows_are_passed_over_on_topics_and_services() {
    let trial = Trial::new(16);
    let manager = trial.start(graph::REQUEST_MANAGER, "").unwrap();
    let server = manager.server(&graph::SUBMIT_STRIPS).unwrap();
    let requests = manager.subscription(&graph::STRIP_REQUEST).unwrap();
    let mut stranger = Stranger::new(trial.domain, 3);
    let service = trial.full("requests/submit");
    let topic = trial.full("requests/request");
    stranger.announce_writer(&format!("rq{service}Request"), "swath_msgs::srv::dds_::SubmitStrips_Request_");
    std::thread::sleep(Duration::from_millis(300));
    stranger.write(1, &[0xff, 0xff, 0, 0]);
    stranger.write(2, &[0, 1, 0, 0, 1, 2, 3]);
    eventually(|| {
        assert_eq!(server.answer_all(|_| SubmitStripsResponse::default()).unwrap(), 0);
        let counted = manager.notices().first().map(|notice| (notice.trouble, notice.topic.clone()));
        counted.map(|counted| assert_eq!(counted, (Trouble::Unreadable, service.clone())))
    });
    let mut other = Stranger::new(trial.domain, 4);
    other.announce_writer(&format!("rt{topic}"), "swath_msgs::msg::dds_::StripRequest_");
    std::thread::sleep(Duration::from_millis(300));
    other.write(1, &[0xff, 0xff, 0, 0]);
    eventually(|| {
        assert_eq!(requests.take().unwrap(), None);
        manager.notices().into_iter().find(|notice| notice.topic == topic)
    });
    // The server still serves.
    let operator = trial.start(graph::OPERATOR, "").unwrap();
    let client = operator.client(&graph::SUBMIT_STRIPS).unwrap();
    operator.wait_for_service(&client, PATIENCE).unwrap();
    let serving = std::thread::spawn(move || {
        while server.answer_all(|_| SubmitStripsResponse { reason_code: 9, ..Default::default() }).unwrap() == 0 {
            manager.wait(PATIENCE).unwrap();
        }
    });
    assert_eq!(client.call(SubmitStripsRequest::default(), PATIENCE).unwrap().reason_code, 9);
    serving.join().unwrap();
}

#[test]
fn messages_count_from_members_only() {
    let trial = Trial::new(17);
    let guidance = trial.start(graph::GUIDANCE, "-p fleet:=one").unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let mut nodes = Vec::new();
    let mut send = |name: &str, words: &str, tick| {
        let node = trial.start(name, words).unwrap();
        let topic = graph::Topic::new("spacecraft/state", graph::SPACECRAFT_STATE.entry.profile, &[], &[]);
        let states = node.publisher(&topic).unwrap();
        eventually(|| (states.matched() == 1).then_some(()));
        std::thread::sleep(Duration::from_millis(300));
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        assert!(states.flush(PATIENCE));
        nodes.push((states, node));
    };
    // Another node of the mission, one of another fleet, one without a name in the table, and the one that counts.
    send(graph::PLANNER, "-p fleet:=one", 1);
    send("somebody", "", 2);
    send(graph::SPACECRAFT, "-p fleet:=two -r __node:=elsewhere", 3);
    send(graph::SPACECRAFT, "-p fleet:=one", 4);
    assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, 4);
    await_notices(&guidance, &received, Trouble::Stranger, 3);
}

#[test]
fn nobody_needs_to_say_who_it_is_where_everybody_counts() {
    let trial = Trial::new(18);
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let recorder = trial.start(graph::RECORDER, "").unwrap();
    let recorded = recorder.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let mut stranger = Stranger::new(trial.domain, 5);
    stranger.announce_writer(&format!("rt{}", received.topic()), STATE_TYPE);
    eventually(|| (received.matched() == 1 && recorded.matched() == 1).then_some(()));
    let state = encode(&SpacecraftState { tick: 1 << 62, ..Default::default() }).unwrap();
    stranger.write(1, state.as_bytes());
    assert_eq!(recorded.wait(recorder.signal(), PATIENCE).unwrap().unwrap().tick, 1 << 62);
    eventually(|| {
        assert_eq!(received.take().unwrap(), None);
        guidance.notices().into_iter().find(|notice| notice.trouble == Trouble::Stranger)
    });
}

/// A flood of a stranger would push the messages of members out of the room that they share.
#[test]
fn a_stranger_that_goes_on_is_heard_no_longer() {
    let trial = Trial::new(43);
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let mut stranger = Stranger::new(trial.domain, 6);
    stranger.announce_writer(&format!("rt{}", received.topic()), STATE_TYPE);
    eventually(|| (received.matched() == 1).then_some(()));
    let state = encode(&SpacecraftState::default()).unwrap();
    let mut number = 0;
    eventually(|| {
        number += 1;
        stranger.write(number, state.as_bytes());
        assert_eq!(received.take().unwrap(), None);
        (received.matched() == 0).then_some(())
    });
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    for tick in 0..10 {
        (0..1000).for_each(|_| stranger.write(number + 1, state.as_bytes()));
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, tick);
    }
}

#[test]
fn a_program_of_others_may_take_a_node_s_place_if_that_is_declared() {
    let trial = Trial::new(19);
    let guidance = trial.start(graph::GUIDANCE, "-p external:=[spacecraft]").unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    // Of no fleet of this mission, so only its name in the ROS graph speaks for it.
    let other = trial.start(graph::SPACECRAFT, "-p fleet:=other").unwrap();
    let states = other.publisher(&graph::SPACECRAFT_STATE).unwrap();
    eventually(|| (states.matched() == 1).then_some(()));
    std::thread::sleep(Duration::from_millis(300));
    states.publish(&SpacecraftState { tick: 5, ..Default::default() }).unwrap();
    assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, 5);
}

/// Of two that come up together one goes, by the order of their identities; one that is there stays.
#[test]
fn a_node_that_takes_the_name_of_one_later_ends_nobody() {
    let trial = Trial::new(47);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    std::thread::sleep(Duration::from_secs(3));
    // Of CycloneDDS, and of RustDDS; both come before any other identity.
    for (number, vendor) in [(10, 0x10), (11, 0x12)] {
        let mut stranger = Stranger::new(trial.domain, number);
        stranger.announce_writer("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_");
        std::thread::sleep(Duration::from_millis(300));
        let node = NodeEntitiesInfo {
            node_namespace: trial.namespace.clone(),
            node_name: "spacecraft".to_owned(),
            ..Default::default()
        };
        let mut data = [0; 16];
        data[..2].copy_from_slice(&[1, vendor]);
        let info = ParticipantEntitiesInfo { gid: Gid { data }, node_entities_info_seq: vec![node] };
        stranger.write(1, encode(&info).unwrap().as_bytes());
        let notice = eventually(|| spacecraft.notices().into_iter().next());
        assert_eq!((notice.trouble, notice.topic), (Trouble::Namesake, trial.full("spacecraft")));
        spacecraft.wait(Duration::ZERO).unwrap();
    }
    assert!(trial.start(graph::SPACECRAFT, "").is_err(), "a node of ours does not come up beside it");
}

/// A panic in RustDDS ends its thread, not the process: without a sign of life it is started anew, and all goes on.
#[test]
fn a_node_whose_dds_has_died_starts_it_anew() {
    let trial = Trial::new(20);
    // Without the filter that keeps such a datagram from it.
    let unprotected = "-p packet_filter:=false";
    let spacecraft = trial.start(graph::SPACECRAFT, unprotected).unwrap();
    let guidance = trial.start(graph::GUIDANCE, unprotected).unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let summaries = spacecraft.publisher(&graph::REQUEST_SUMMARY).unwrap();
    summaries.publish(&RequestSummary { tick: 9, ..Default::default() }).unwrap();
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    let before = states.gid();
    let stranger = Stranger::new(trial.domain, 7);
    stranger.send_file("03_nackfrag_base0_56B", false);
    let mut renewed = 0;
    eventually(|| {
        spacecraft.check().unwrap();
        let notices = spacecraft.notices().into_iter().chain(guidance.notices());
        renewed += notices.filter(|notice| notice.trouble == Trouble::Renewed).count();
        (renewed == 2).then_some(())
    });
    assert_ne!(states.gid(), before);
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    for tick in 0..100 {
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, tick);
    }
    // What was latched is latched again.
    let operator = trial.start(graph::OPERATOR, "").unwrap();
    let latched = operator.subscription(&graph::REQUEST_SUMMARY).unwrap();
    assert_eq!(latched.wait(operator.signal(), PATIENCE).unwrap().unwrap().tick, 9);
}

/// The same and others, with the filter: nothing of it arrives, and it is told of.
#[test]
fn datagrams_that_would_end_a_node_are_dropped_and_told_of() {
    let trial = Trial::new(44);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let received = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    let stranger = Stranger::new(trial.domain, 9);
    let harmful = ["03_nackfrag_base0_56B", "04_heartbeat_long_range_52B", "06_datafrag_4GiB_57B_any_prefix"];
    for file in harmful {
        stranger.send_file(file, false);
        stranger.send_file(file, true);
    }
    // Two nodes with two ports each, in one process.
    let mut dropped = 0;
    eventually(|| {
        for notice in guidance.notices() {
            assert_eq!(notice.trouble, Trouble::Dropped, "{notice}");
            dropped += notice.count;
        }
        (dropped >= 12).then_some(())
    });
    for tick in 0..100 {
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        assert_eq!(received.wait(guidance.signal(), PATIENCE).unwrap().unwrap().tick, tick);
    }
}
