//! Nodes that meet over DDS: topics, late readers, services, parameters, names and what is missing.

use std::time::{Duration, Instant};

use swath_msgs::rcl_interfaces::{
    GetParameters, GetParametersRequest, ListParameters, ListParametersRequest, Parameter, ParameterType,
    ParameterValue, SetParameters, SetParametersRequest,
};
use swath_msgs::swath_msgs::{
    RequestSummary, SpacecraftState, StripRequest, SubmitResult, SubmitStripsRequest, SubmitStripsResponse, WheelTorque,
};
use swath_ros::{Mapping, RosError, Spec, Value, decode, encode, graph};

use crate::common::{PATIENCE, Trial, eventually};
use crate::stranger::Stranger;

#[test]
fn states_and_torques_go_both_ways_and_none_is_lost() {
    const TICKS: u64 = 2000;
    let trial = Trial::new(0);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let torques = spacecraft.subscription(&graph::WHEEL_TORQUE).unwrap();
    let echo = std::thread::spawn(move || {
        let states = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
        let torques = guidance.publisher(&graph::WHEEL_TORQUE).unwrap();
        guidance.wait_for_peers(&[graph::SPACECRAFT], PATIENCE).unwrap();
        let mut expected = 0;
        while expected < TICKS {
            let state = states.wait(guidance.signal(), PATIENCE).unwrap().unwrap();
            assert_eq!(state.tick, expected);
            torques.publish(&WheelTorque { tick: state.tick, ..Default::default() }).unwrap();
            expected += 1;
        }
        assert!(torques.flush(PATIENCE));
        states.lost()
    });
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    assert_eq!(states.matched(), 1);
    for tick in 0..TICKS {
        states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
        let torque = torques.wait(spacecraft.signal(), PATIENCE).unwrap().unwrap();
        assert_eq!(torque.tick, tick);
    }
    assert_eq!(torques.lost(), 0);
    assert_eq!(echo.join().unwrap(), 0);
}

#[test]
fn a_late_reader_gets_what_is_latched() {
    let trial = Trial::new(1);
    let manager = trial.start(graph::REQUEST_MANAGER, "").unwrap();
    let summaries = manager.publisher(&graph::REQUEST_SUMMARY).unwrap();
    for tick in 1..=3 {
        summaries.publish(&RequestSummary { tick, ..Default::default() }).unwrap();
    }
    let late = trial.start(graph::OPERATOR, "").unwrap();
    let received = late.subscription(&graph::REQUEST_SUMMARY).unwrap();
    let summary = eventually(|| received.take().unwrap().filter(|summary| summary.tick == 3));
    assert_eq!(summary, RequestSummary { tick: 3, ..Default::default() });
}

#[test]
fn who_asks_how_things_stand_is_told_the_newest() {
    let trial = Trial::new(26);
    let manager = trial.start(graph::REQUEST_MANAGER, "").unwrap();
    let summaries = manager.publisher(&graph::REQUEST_SUMMARY).unwrap();
    for tick in 1..=500 {
        summaries.publish(&RequestSummary { tick, ..Default::default() }).unwrap();
    }
    let late = trial.start(graph::OPERATOR, "").unwrap();
    let received = late.subscription(&graph::REQUEST_SUMMARY).unwrap();
    assert_eq!(received.newest(late.signal(), PATIENCE).unwrap().unwrap().tick, 500);
    let nothing = late.subscription(&graph::PLANNER_STATUS).unwrap();
    assert_eq!(nothing.newest(late.signal(), Duration::from_millis(50)).unwrap(), None);
}

/// A reader that is in no hurry still gets what a node said before it ended.
#[test]
fn the_last_words_of_a_node_are_heard() {
    let trial = Trial::new(25);
    let operator = trial.start(graph::OPERATOR, "").unwrap();
    let received = operator.subscription(&graph::SPACECRAFT_STATE).unwrap();
    for tick in 0..5 {
        let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
        let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
        eventually(|| (states.matched() == 1 && received.matched() > 0).then_some(()));
        std::thread::sleep(Duration::from_millis(300));
        let reading = std::thread::scope(|scope| {
            let reading = scope.spawn(|| {
                let deadline = Instant::now() + PATIENCE;
                while Instant::now() < deadline {
                    if let Some(state) = received.take().unwrap() {
                        return Some(state.tick);
                    }
                    std::thread::sleep(Duration::from_millis(5));
                }
                None
            });
            states.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
            drop((states, spacecraft));
            reading.join().unwrap()
        });
        assert_eq!(reading, Some(tick));
    }
}

#[test]
fn raw_endpoints_pass_the_bytes_of_typed_ones() {
    let trial = Trial::new(2);
    let player = trial.start(graph::PLAYER, "").unwrap();
    let recorder = trial.start(graph::RECORDER, "").unwrap();
    let entry = graph::SPACECRAFT_STATE.entry;
    let qos = entry.profile.qos();
    let writer = player.raw_publisher(entry.name, entry.type_name, &qos).unwrap();
    let reader = recorder.raw_subscription(entry.name, entry.type_name, &qos).unwrap();
    eventually(|| (writer.matched() > 0 && reader.matched() > 0).then_some(()));
    std::thread::sleep(Duration::from_millis(300));
    let state = SpacecraftState { tick: 7, wheel_speed: [1.0, 2.0, 3.0], ..Default::default() };
    let cdr = encode(&state).unwrap();
    writer.publish(cdr.clone()).unwrap();
    let sample = eventually(|| reader.take().unwrap());
    assert_eq!(sample.cdr, cdr);
    assert_eq!(decode::<SpacecraftState>(&sample.cdr).unwrap(), state);
    assert_eq!(sample.info.writer, writer.gid());
    assert_eq!(sample.info.sequence_number, 1);
    let sent = sample.info.source_time_ns.unwrap();
    assert!(sent <= sample.info.received_time_ns);
    assert_eq!(reader.topic(), trial.full("spacecraft/state"));
    let big_endian = swath_ros::Cdr::from_bytes(vec![0, 0, 0, 0, 1]);
    assert!(writer.publish(big_endian).is_err());
}

/// Accepts requests above a priority, and gives their names as reasons.
fn judge(request: SubmitStripsRequest) -> SubmitStripsResponse {
    let judge_one = |strip: &StripRequest| SubmitResult {
        accepted: strip.priority > 0.5,
        reason: strip.name.clone(),
        ..Default::default()
    };
    SubmitStripsResponse { results: request.requests.iter().map(judge_one).collect(), ..Default::default() }
}

fn services_answer(trial: &Trial, mapping: Mapping) {
    let manager = trial.start_mapped(graph::REQUEST_MANAGER, "", mapping).unwrap();
    let serving = std::thread::spawn(move || {
        let server = manager.server(&graph::SUBMIT_STRIPS).unwrap();
        let mut answered = server.answer_all(judge).unwrap();
        while answered < 2 {
            manager.wait(PATIENCE).unwrap();
            answered += server.answer_all(judge).unwrap();
        }
    });
    let operator = trial.start_mapped(graph::OPERATOR, "", mapping).unwrap();
    let client = operator.client(&graph::SUBMIT_STRIPS).unwrap();
    operator.wait_for_service(&client, PATIENCE).unwrap();
    for priority in [0.1, 0.9] {
        let strip = StripRequest { name: "delta".to_owned(), priority, ..Default::default() };
        let request = SubmitStripsRequest { requests: vec![strip] };
        let response = client.call(request, PATIENCE).unwrap();
        assert_eq!(response.results.len(), 1);
        assert_eq!(response.results[0].accepted, priority > 0.5);
        assert_eq!(response.results[0].reason, "delta");
    }
    serving.join().unwrap();
}

#[test]
fn services_answer_with_the_mapping_of_cyclone() {
    services_answer(&Trial::new(3), Mapping::Cyclone);
}

#[test]
fn services_answer_with_the_enhanced_mapping() {
    services_answer(&Trial::new(4), Mapping::Enhanced);
}

/// A client is often seen in two halves, the writer of its requests first.
#[test]
fn a_response_waits_until_its_client_can_hear_it() {
    let trial = Trial::new(24);
    let manager = trial.start(graph::REQUEST_MANAGER, "").unwrap();
    let server = manager.server(&graph::SUBMIT_STRIPS).unwrap();
    let service = trial.full("requests/submit");
    let mut client = Stranger::new(trial.domain, 1);
    client.announce_writer(&format!("rq{service}Request"), "swath_msgs::srv::dds_::SubmitStrips_Request_");
    std::thread::sleep(Duration::from_millis(300));
    let header = [&b"stranger"[..], &7_u64.to_le_bytes()].concat();
    client.write(1, &[&[0, 1, 0, 0][..], &header, &[0; 4]].concat());
    eventually(|| (server.answer_all(judge).unwrap() == 1).then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    client.announce_reader(&format!("rr{service}Reply"), "swath_msgs::srv::dds_::SubmitStrips_Response_");
    client.receive(&header);
}

/// What answers late has answered: who asks again takes the response to what was asked before.
#[test]
fn a_late_response_counts_although_the_call_was_made_again() {
    let trial = Trial::new(45);
    let manager = trial.start(graph::REQUEST_MANAGER, "").unwrap();
    let server = manager.server(&graph::SUBMIT_STRIPS).unwrap();
    let operator = trial.start(graph::OPERATOR, "").unwrap();
    let client = operator.client(&graph::SUBMIT_STRIPS).unwrap();
    operator.wait_for_service(&client, PATIENCE).unwrap();
    let interval = Duration::from_millis(100);
    std::thread::scope(|scope| {
        let call = scope.spawn(|| client.call_repeatedly(SubmitStripsRequest::default(), interval, PATIENCE));
        let (first, _) = eventually(|| server.take().unwrap());
        let (second, _) = eventually(|| server.take().unwrap());
        assert!(second != first);
        let reason = "late".to_owned();
        server.respond(first, SubmitStripsResponse { reason, ..Default::default() }).unwrap();
        assert_eq!(call.join().unwrap().unwrap().reason, "late");
    });
}

#[test]
fn a_service_that_nobody_serves_is_named() {
    let trial = Trial::new(5);
    let operator = trial.start(graph::OPERATOR, "").unwrap();
    let client = operator.client(&graph::SUBMIT_STRIPS).unwrap();
    let brief = Duration::from_millis(50);
    let error = operator.wait_for_service(&client, brief).unwrap_err().to_string();
    let service = trial.full("requests/submit");
    assert_eq!(error, format!("still missing after 0.05 s: nobody serves {service}"));
    let error = client.call(SubmitStripsRequest::default(), brief).unwrap_err().to_string();
    assert_eq!(error, format!("service {service} did not answer within 0.05 s"));
}

#[test]
fn parameters_are_read_and_set_from_outside() {
    let trial = Trial::new(6);
    let node = trial.start(graph::SPACECRAFT, "-p pace:=2.0").unwrap();
    let pace = Spec::new("pace", 0.0, "Speed against real time.").in_range(0.0..=100.0);
    assert_eq!(node.parameters().declare(pace).unwrap(), 2.0);
    node.parameters().check_given().unwrap();

    let tool = trial.start(graph::OPERATOR, "").unwrap();
    let list = tool.client::<ListParameters>(&graph::Service::new("spacecraft/list_parameters", &[], &[])).unwrap();
    tool.wait_for_service(&list, PATIENCE).unwrap();
    let names = list.call(ListParametersRequest::default(), PATIENCE).unwrap().result.names;
    let own = [
        "epoch",
        "external",
        "fleet",
        "memory_limit_mb",
        "orphaned_s",
        "pace",
        "packet_filter",
        "signs",
        "use_sim_time",
    ];
    assert_eq!(names, own);

    let set = tool.client::<SetParameters>(&graph::Service::new("spacecraft/set_parameters", &[], &[])).unwrap();
    let get = tool.client::<GetParameters>(&graph::Service::new("spacecraft/get_parameters", &[], &[])).unwrap();
    let events = tool.subscription(&graph::PARAMETER_EVENTS).unwrap();
    eventually(|| (events.matched() > 0).then_some(()));
    tool.wait_for_service(&set, PATIENCE).unwrap();
    tool.wait_for_service(&get, PATIENCE).unwrap();
    let wanted = |double_value| Parameter {
        name: "pace".to_owned(),
        value: ParameterValue { r#type: ParameterType::PARAMETER_DOUBLE, double_value, ..Default::default() },
    };
    let request = SetParametersRequest { parameters: vec![wanted(3.0), wanted(101.0)] };
    let results = set.call(request, PATIENCE).unwrap().results;
    assert!(results[0].successful);
    assert_eq!(results[1].reason, "parameter `pace`: 101 is outside 0 to 100");
    let request = GetParametersRequest { names: vec!["pace".to_owned(), "none".to_owned()] };
    let values = get.call(request, PATIENCE).unwrap().values;
    assert_eq!(values[0], wanted(3.0).value);
    assert_eq!(values[1].r#type, ParameterType::PARAMETER_NOT_SET);
    assert_eq!(node.parameters().value("pace"), Some(Value::Double(3.0)));
    let event = eventually(|| events.take().unwrap());
    assert_eq!(event.node, trial.full("spacecraft"));
    assert_eq!(event.changed_parameters, [wanted(3.0)]);
}

#[test]
fn a_second_node_of_the_same_name_is_refused() {
    let trial = Trial::new(7);
    let first = trial.start(graph::SPACECRAFT, "").unwrap();
    let error = trial.start(graph::SPACECRAFT, "").map(|_| ()).unwrap_err().to_string();
    let name = trial.full("spacecraft");
    let expected = format!("a node named {name} is already running in domain {}", trial.domain);
    assert!(error.starts_with(&expected), "{error}");
    first.wait(Duration::ZERO).unwrap();
    let other_namespace = format!("-r __ns:={}/two", trial.namespace);
    let elsewhere = trial.start(graph::SPACECRAFT, &other_namespace).unwrap();
    assert!(elsewhere.nodes().contains(&name));
    drop(first);
    eventually(|| (!elsewhere.nodes().contains(&name)).then_some(()));
    trial.start(graph::SPACECRAFT, "").unwrap();
}

#[test]
fn of_two_nodes_that_start_together_one_remains() {
    let spawn = || {
        std::thread::spawn(|| {
            let node = Trial::new(8).start(graph::PLANNER, "")?;
            let deadline = Instant::now() + Duration::from_secs(3);
            while Instant::now() < deadline {
                node.wait(Duration::from_millis(100))?;
            }
            Ok::<(), RosError>(())
        })
    };
    let outcomes = [spawn(), spawn()].map(|thread| thread.join().unwrap());
    let refused = outcomes.iter().filter(|outcome| outcome.is_err()).count();
    assert_eq!(refused, 1, "{outcomes:?}");
}

#[test]
fn what_is_missing_is_named() {
    let trial = Trial::new(9);
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let _torques = guidance.publisher(&graph::WHEEL_TORQUE).unwrap();
    let _states = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    let wait = |timeout| guidance.wait_for_peers(&[graph::SPACECRAFT], timeout);
    let name = trial.full("spacecraft");
    let error = wait(Duration::from_millis(100)).unwrap_err().to_string();
    assert_eq!(error, format!("still missing after 0.1 s: node {name} is not there"));
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let states = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    eventually(|| (states.matched() > 0).then_some(()));
    let error = wait(Duration::from_secs(1)).unwrap_err().to_string();
    assert_eq!(error, format!("still missing after 1 s: {name} does not read guidance/wheel_torque"));
    let _torques = spacecraft.subscription(&graph::WHEEL_TORQUE).unwrap();
    wait(PATIENCE).unwrap();
}

#[test]
fn the_recorder_is_there_when_it_reads_everything() {
    let trial = Trial::new(10);
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let recorder = trial.start(graph::RECORDER, "").unwrap();
    let mut readers = Vec::new();
    for entry in graph::TOPICS.iter().filter(|entry| entry.name != "/parameter_events") {
        readers.push(recorder.raw_subscription(entry.name, entry.type_name, &entry.profile.qos()).unwrap());
    }
    eventually(|| guidance.nodes().contains(&trial.full("recorder")).then_some(()));
    let wait = |timeout| guidance.wait_for_peers(&[graph::RECORDER], timeout);
    let error = wait(Duration::from_secs(1)).unwrap_err().to_string();
    assert_eq!(error, format!("still missing after 1 s: {} does not read /parameter_events", trial.full("recorder")));
    let entry = graph::PARAMETER_EVENTS.entry;
    readers.push(recorder.raw_subscription(entry.name, entry.type_name, &entry.profile.qos()).unwrap());
    wait(PATIENCE).unwrap();
}

/// A reader keeps only so much: what is pushed out before it is taken must not go unnoticed.
#[test]
fn what_is_not_taken_in_time_is_counted_as_lost() {
    const SENT: u64 = 1000;
    let trial = Trial::new(11);
    let spacecraft = trial.start(graph::SPACECRAFT, "").unwrap();
    let guidance = trial.start(graph::GUIDANCE, "").unwrap();
    let publisher = spacecraft.publisher(&graph::SPACECRAFT_STATE).unwrap();
    let states = guidance.subscription(&graph::SPACECRAFT_STATE).unwrap();
    spacecraft.wait_for_peers(&[graph::GUIDANCE], PATIENCE).unwrap();
    let send = |tick| publisher.publish(&SpacecraftState { tick, ..Default::default() }).unwrap();
    send(0);
    assert_eq!(eventually(|| states.take().unwrap()).tick, 0);
    (1..SENT).for_each(send);
    assert!(publisher.flush(PATIENCE));
    let mut taken = 1;
    while states.take().unwrap().is_some() {
        taken += 1;
    }
    assert!(states.lost() > 0, "a reader that keeps 64 samples kept {taken}");
    assert_eq!(taken + states.lost(), SENT);
}

#[test]
fn there_is_no_time_but_simulated_time() {
    let trial = Trial::new(40);
    let error = trial.start(graph::PLANNER, "-p use_sim_time:=false").err().unwrap().to_string();
    assert_eq!(error, "parameter `use_sim_time`: the nodes know no time but simulated time");
    drop(trial.start(graph::PLANNER, "-p use_sim_time:=true").unwrap());
}
