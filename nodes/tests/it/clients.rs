//! Clients of the request manager over DDS: calls that are too small or too large, and two that race for the same strips.

use std::sync::Barrier;
use std::time::Duration;

use swath_msgs::swath_msgs as msg;
use swath_ros::{Environment, Node, RosArgs, graph};

use crate::common;

const TIMEOUT: Duration = Duration::from_secs(60);
/// Strips that both clients want.
const WANTED: usize = 50;

fn node(domain: &str, name: &str) -> Node {
    let environment =
        Environment { domain: domain.parse().unwrap(), localhost_only: true, ..Environment::read().unwrap() };
    Node::start_in(environment, name, &RosArgs::default()).unwrap()
}

fn request(submitter: &str, number: usize) -> msg::StripRequest {
    let longitude = number as f64 * 3.0 - 170.0;
    msg::StripRequest {
        client_ref: format!("{submitter} {number}"),
        submitter: submitter.to_owned(),
        start_latitude_deg: 10.0,
        start_longitude_deg: longitude,
        end_latitude_deg: 11.0,
        end_longitude_deg: longitude + 1.5,
        priority: 0.5,
        acquisition_speed: 3000.0,
        ..msg::StripRequest::default()
    }
}

/// What one of two clients was told: for each strip its number and the reason, of submitting and then of cancelling one
/// half of what both have.
fn race(domain: &str, name: &str, barrier: &Barrier) -> (Vec<(u64, u16)>, Vec<u16>) {
    let node = node(domain, name);
    let submit = node.client(&graph::SUBMIT_STRIPS).unwrap();
    let cancel = node.client(&graph::CANCEL_STRIPS).unwrap();
    node.wait_for_service(&submit, TIMEOUT).unwrap();
    node.wait_for_service(&cancel, TIMEOUT).unwrap();
    barrier.wait();
    let mut told = Vec::new();
    for number in 0..WANTED {
        let call = msg::SubmitStripsRequest { requests: vec![request(name, number)] };
        let answer = submit.call(call, TIMEOUT).unwrap();
        told.extend(answer.results.iter().map(|result| (result.id, result.reason_code)));
    }
    barrier.wait();
    let mut cancelled = Vec::new();
    for id in 1..=WANTED as u64 {
        let call = msg::CancelStripsRequest { ids: vec![id], actor: name.to_owned(), reason: String::new() };
        let answer = cancel.call(call, TIMEOUT).unwrap();
        cancelled.extend(answer.results.iter().map(|result| result.reason_code));
    }
    (told, cancelled)
}

#[test]
fn two_clients_may_want_the_same_strips_and_faulty_calls_are_refused_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let mission = common::write_mission(folder.path(), "orbits = 15.0\n");
    let domain = common::domain();
    let mut manager = common::command("swath-requests", &domain);
    let store = folder.path().join("requests.sqlite");
    manager.args(["--ros-args", "-p", &format!("mission:={}", mission.display())]);
    manager.args(["-p", &format!("store:={}", store.display())]);
    let _manager = common::Running::start(&mut manager);

    let barrier = Barrier::new(2);
    let (floods, fires) = std::thread::scope(|scope| {
        let floods = scope.spawn(|| race(&domain, "floods", &barrier));
        let fires = scope.spawn(|| race(&domain, "fires", &barrier));
        (floods.join().unwrap(), fires.join().unwrap())
    });
    for number in 0..WANTED {
        assert_eq!([floods.0[number].1, fires.0[number].1], [0, 0], "strip {number}: both are taken in");
        let mut codes = [floods.1[number], fires.1[number]];
        codes.sort_unstable();
        assert_eq!(codes, [0, 121], "strip {number}: one cancels it, for the other it is cancelled already");
    }
    let mut ids: Vec<u64> = floods.0.iter().chain(&fires.0).map(|it| it.0).collect();
    ids.sort_unstable();
    assert_eq!(ids, (1..=2 * WANTED as u64).collect::<Vec<_>>());

    let node = node(&domain, "careless");
    let list = node.client(&graph::LIST_STRIPS).unwrap();
    node.wait_for_service(&list, TIMEOUT).unwrap();
    let accepted = vec![msg::StripStatus::STATE_ACCEPTED];
    let left = list.call(msg::ListStripsRequest { states: accepted, ..Default::default() }, TIMEOUT).unwrap();
    assert_eq!(left.strips.len(), WANTED, "the cancel of one does not cost the other");
    let strips: Vec<_> = left.strips.iter().map(|it| (it.strip.start_longitude_deg, it.served_by)).collect();
    for (longitude, served_by) in &strips {
        let others = strips.iter().filter(|(other, _)| other == longitude).count();
        assert!(*served_by == 0 || others == 2, "{strips:?}");
    }
    assert!(strips.iter().filter(|(_, served_by)| *served_by != 0).count() <= WANTED / 2, "{strips:?}");
    let submit = node.client(&graph::SUBMIT_STRIPS).unwrap();
    node.wait_for_service(&submit, TIMEOUT).unwrap();
    let answer = submit.call(msg::SubmitStripsRequest::default(), TIMEOUT).unwrap();
    assert_eq!((answer.results.len(), answer.reason_code), (0, 112), "{}", answer.reason);
    let cancel = node.client(&graph::CANCEL_STRIPS).unwrap();
    node.wait_for_service(&cancel, TIMEOUT).unwrap();
    let call = |ids| msg::CancelStripsRequest { ids, actor: "careless".to_owned(), reason: String::new() };
    let answer = cancel.call(call((0..100_001).collect()), TIMEOUT).unwrap();
    assert_eq!((answer.results.len(), answer.reason_code), (0, 109), "{}", answer.reason);
    let answer = cancel.call(call(vec![10_000]), TIMEOUT).unwrap();
    assert_eq!(answer.results[0].reason_code, 120, "{}", answer.results[0].reason);
}
