//! The request manager's life cycle, by examples.

use std::collections::BTreeSet;

use swath_sim::config::SimConfig;
use swath_sim::rng;
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::{StripId, StripRequest};

use super::index::Area;
use super::journal::{Entry, InFlight};
use super::lifecycle::State;
use super::logic::{Abort, RequestLogic, Rules};
use super::query::Filter;
use super::reason_number::Reason;
use super::refusal::Refusal;
use crate::orders::action::Review;
use crate::orders::order::{Order, Part};

const EPOCH_NS: u64 = 1_767_225_600_000_000_000;

fn logic() -> RequestLogic {
    let model = Model::new(SimConfig::default()).unwrap();
    let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
    RequestLogic::new(model, &initial, Tick(172_800), Rules { epoch_ns: EPOCH_NS, max_attempts: 3 })
}

/// A strip of 250 km near the equator.
fn equatorial(client_ref: &str, longitude_deg: f64) -> Order {
    let request = StripRequest {
        start_latitude_deg: 5.0,
        start_longitude_deg: longitude_deg,
        end_latitude_deg: 6.0,
        end_longitude_deg: longitude_deg + 2.0,
        priority: 0.5,
        acquisition_speed_m_s: 3000.0,
        bidirectional: false,
    };
    Order::new(client_ref.to_owned(), client_ref.to_owned(), request)
}

fn both_ways(client_ref: &str, longitude_deg: f64) -> Order {
    let mut order = equatorial(client_ref, longitude_deg);
    order.request.bidirectional = true;
    order
}

/// Submits now.
fn submit(logic: &mut RequestLogic, order: Order) -> Result<StripId, Refusal> {
    logic.submit(order, logic.now())
}

/// Replaces now.
fn replace(logic: &mut RequestLogic, old: StripId, order: Order) -> Result<StripId, Refusal> {
    logic.replace(old, order, logic.now())
}

fn chosen(task: u64, id: StripId) -> InFlight {
    InFlight { task, id, start: Tick(task * 300), t_pre: 100, t_acq: 200 }
}

fn record(task: u64, id: StripId, failure: Option<FailureReason>) -> TaskRecord {
    let outcome = TaskOutcome { failure, max_attitude_error: 0.05, min_elevation: 0.5 };
    let (start, end) = (Tick(task * 300), Tick(task * 300 + 300));
    TaskRecord { task, start, end, strip: Some(id), duty: None, t_pre: 100, t_acq: 200, outcome }
}

/// Imaged at the opening of its first window.
fn imaged(logic: &RequestLogic, task: u64, id: StripId) -> TaskRecord {
    let opens = logic.strip(id).unwrap().windows[0].open;
    let flown = record(task, id, None);
    let start = Tick(opens.0 - u64::from(flown.t_pre));
    TaskRecord { start, end: opens.after(flown.t_acq), ..flown }
}

/// Chooses, images and reports a strip.
fn fly(logic: &mut RequestLogic, task: u64, id: StripId, failure: Option<FailureReason>) {
    logic.on_task(chosen(task, id));
    logic.on_imaging(task, Tick(task * 300 + 100));
    logic.on_decision_point(task + 1, Tick(task * 300 + 300), &[record(task, id, failure)]);
}

fn states(logic: &mut RequestLogic, id: StripId) -> Vec<State> {
    let changed = |entry| match entry {
        Entry::Changed(change) if change.id == id => Some(change.state),
        _ => None,
    };
    logic.take_journal().into_iter().filter_map(changed).collect()
}

#[test]
fn the_same_request_again_is_the_same_strip_and_another_under_its_name_is_refused() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    assert_eq!(submit(&mut logic, equatorial("a", 10.0)), Ok(id));
    assert_eq!(submit(&mut logic, equatorial("a", 20.0)).unwrap_err().code(), 108);
    let renamed = Order { name: "another name".to_owned(), ..equatorial("a", 10.0) };
    assert_eq!(submit(&mut logic, renamed), Ok(id));
    let other = Order { submitter: "ops".to_owned(), ..equatorial("a", 20.0) };
    assert_eq!(submit(&mut logic, other), Ok(StripId(2)), "references are each submitter's own");
    assert_eq!((logic.count(State::Accepted), logic.count(State::Rejected)), (2, 1));
}

#[test]
fn the_same_strip_is_found_although_it_has_another_name() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("", 10.0)).unwrap();
    let refusal = submit(&mut logic, equatorial("", 10.000_001)).unwrap_err();
    assert_eq!(refusal, Refusal::SameStrip { id: id.0, state: "accepted" });
    let day_ns = 86_400_000_000_000;
    let morning = Order { valid_until_ns: EPOCH_NS + day_ns / 2, ..equatorial("m", 30.0) };
    let evening = Order { valid_from_ns: EPOCH_NS + day_ns / 2, ..equatorial("e", 30.0) };
    submit(&mut logic, morning).unwrap();
    submit(&mut logic, evening).unwrap();
    logic.cancel(id, "ops", "").unwrap();
    submit(&mut logic, equatorial("again", 10.0)).unwrap();
}

#[test]
fn what_was_not_imaged_may_be_asked_for_again_and_what_was_is_known() {
    let mut logic = logic();
    let first = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    logic.cancel(first, "ops", "").unwrap();
    let second = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    assert_eq!((second, logic.state(second)), (StripId(2), Some(State::Accepted)));
    assert_eq!(logic.by_reference("mission", "a"), Some(second));
    fly(&mut logic, 0, second, None);
    assert_eq!(submit(&mut logic, equatorial("a", 10.0)), Ok(second), "it was imaged");
    assert_eq!((logic.len(), logic.count(State::Completed)), (2, 1));
}

fn of_other(submitter: &str, priority: f64) -> Order {
    let mut order = Order { submitter: submitter.to_owned(), ..both_ways("x", 10.0) };
    order.request.priority = priority;
    order
}

#[test]
fn one_imaging_serves_all_who_ask_for_the_same_strip() {
    let mut logic = logic();
    let a = submit(&mut logic, of_other("a", 0.4)).unwrap();
    let b = submit(&mut logic, of_other("b", 0.9)).unwrap();
    let c = submit(&mut logic, of_other("c", 0.4)).unwrap();
    assert_eq!((logic.served_by(a), logic.served_by(b), logic.served_by(c)), (Some(b), None, Some(b)));
    assert_eq!(logic.on_decision_point(0, Tick(0), &[]).pending, 2, "both ways of the greatest priority");
    let record = imaged(&logic, 0, b);
    assert_eq!(logic.on_result(&record), 0.9);
    assert_eq!(logic.count(State::Completed), 1);
    assert_eq!(logic.count(State::FulfilledByLink), 5);
    assert_eq!(logic.on_decision_point(1, record.end, &[]).pending, 0);
    assert_eq!(logic.take_contradictions(), []);
}

#[test]
fn the_cancel_of_one_does_not_cost_the_other() {
    let mut logic = logic();
    let a = submit(&mut logic, of_other("a", 0.4)).unwrap();
    let b = submit(&mut logic, of_other("b", 0.9)).unwrap();
    logic.cancel(b, "ops", "").unwrap();
    assert_eq!((logic.served_by(a), logic.state(a)), (None, Some(State::Accepted)));
    assert_eq!(logic.on_decision_point(0, Tick(0), &[]).pending, 2);
    let b = submit(&mut logic, of_other("b", 0.9)).unwrap();
    assert_eq!(logic.served_by(a), Some(b));
    logic.review(b, Review::Hold, "ops", "").unwrap();
    assert_eq!(logic.served_by(a), None);
    logic.review(b, Review::Release, "ops", "").unwrap();
    assert_eq!(logic.served_by(a), Some(b));
    logic.on_task(chosen(0, b));
    let c = submit(&mut logic, of_other("c", 1.0)).unwrap();
    assert_eq!(logic.served_by(c), Some(b), "what is under way is not put off");
    logic.cancel(a, "ops", "").unwrap();
    logic.on_result(&record(0, b, Some(FailureReason::Attitude)));
    assert_eq!((logic.served_by(b), logic.served_by(c)), (Some(c), None));
    assert_eq!(logic.on_decision_point(1, Tick(900), &[]).pending, 2);
}

#[test]
fn imaging_that_is_too_early_for_one_does_not_serve_it() {
    let mut logic = logic();
    let a = submit(&mut logic, of_other("a", 0.4)).unwrap();
    let record = imaged(&logic, 0, a);
    let later_ns = EPOCH_NS + (record.end.0 + 1) * logic.model.period.nanoseconds();
    let b = submit(&mut logic, Order { valid_from_ns: later_ns, ..of_other("b", 0.3) }).unwrap();
    assert_eq!(logic.served_by(b), Some(a));
    assert_eq!(logic.on_result(&record), 0.4);
    assert_eq!((logic.state(b), logic.served_by(b)), (Some(State::Accepted), None));
}

fn strip_of(order_ref: &str, number: u32, longitude_deg: f64) -> Order {
    let part = Part { order_ref: order_ref.to_owned(), number, of: 3, share: 1.0 / 3.0 };
    Order { part: Some(part), ..both_ways(&format!("{order_ref} {number}/3"), longitude_deg) }
}

#[test]
fn the_strips_of_an_order_are_listed_by_its_number() {
    let mut logic = logic();
    let alone = submit(&mut logic, both_ways("alone", 0.0)).unwrap();
    let first = submit(&mut logic, strip_of("po", 1, 10.0)).unwrap();
    submit(&mut logic, strip_of("rhein", 1, 20.0)).unwrap();
    submit(&mut logic, strip_of("po", 2, 30.0)).unwrap();
    let strips = |logic: &RequestLogic, order| {
        logic.list(&Filter { order: Some(order), ..Filter::default() }, StripId(0), 100).ids
    };
    assert_eq!(strips(&logic, alone), [1, 2].map(StripId));
    assert_eq!(strips(&logic, first), [3, 4, 7, 8].map(StripId));
    logic.cancel(StripId(7), "ops", "").unwrap();
    submit(&mut logic, strip_of("po", 2, 30.0)).unwrap();
    assert_eq!(strips(&logic, first), [3, 4, 7, 8, 9, 10].map(StripId), "what is asked for again belongs to it");
    let mut bad = strip_of("po", 4, 40.0);
    assert_eq!(submit(&mut logic, bad.clone()).unwrap_err().to_string(), "part is 4, outside 1 to parts");
    bad.part = Some(Part { order_ref: "po".to_owned(), number: 3, of: 3, share: f64::NAN });
    assert_eq!(submit(&mut logic, bad).unwrap_err().to_string(), "share is NaN, outside 0 to 1");
}

#[test]
fn a_failed_strip_is_offered_again_until_its_attempts_are_used_up() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    fly(&mut logic, 0, id, Some(FailureReason::Attitude));
    fly(&mut logic, 1, id, Some(FailureReason::Interrupted));
    fly(&mut logic, 2, id, Some(FailureReason::Elevation));
    assert_eq!(logic.state(id), Some(State::Accepted));
    assert_eq!(logic.request(id).unwrap().reason.0, Reason::Elevation);
    fly(&mut logic, 3, id, Some(FailureReason::Attitude));
    let request = logic.request(id).unwrap();
    assert_eq!((request.state, request.standing.attempts, request.standing.counted), (State::Failed, 4, 3));
    assert!(request.reason.1.ends_with("this was attempt 3 of 3"), "{:?}", request.reason);
    assert_eq!(request.reason.0, Reason::Attempts);
    assert!(logic.on_decision_point(5, Tick(1500), &[]).candidates.is_empty());
}

#[test]
fn an_imaged_strip_pays_once_and_is_not_offered_again() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    fly(&mut logic, 0, id, None);
    let again = record(0, id, None);
    let offer = logic.on_decision_point(1, Tick(300), &[again.clone(), again]);
    assert_eq!((offer.pending, offer.fulfilled, logic.reward()), (0, 1, 0.5));
    let went = states(&mut logic, id);
    assert_eq!(went, [State::Accepted, State::Scheduled, State::Executing, State::Completed]);
}

#[test]
fn a_result_is_settled_although_its_beginning_was_not_heard_of() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    logic.on_decision_point(1, Tick(300), &[record(0, id, None)]);
    let went = states(&mut logic, id);
    assert_eq!(went, [State::Accepted, State::Scheduled, State::Executing, State::Completed]);
    let id = submit(&mut logic, equatorial("b", 10.0)).unwrap();
    logic.on_task(chosen(1, id));
    logic.on_decision_point(3, Tick(900), &[]);
    assert_eq!(logic.request(id).unwrap().reason.0, Reason::NotFlown, "task 1 was not flown");
    logic.on_task(chosen(1, id));
    assert_eq!(logic.state(id), Some(State::Accepted), "task 1 is no longer wanted");
    logic.on_task(chosen(3, id));
    assert_eq!(logic.state(id), Some(State::Scheduled));
    assert!(logic.take_aborts().is_empty());
}

#[test]
fn twins_are_fulfilled_cancelled_and_held_together() {
    let mut logic = logic();
    let (one, two) = (submit(&mut logic, both_ways("a", 10.0)).unwrap(), StripId(2));
    assert_eq!(submit(&mut logic, both_ways("a", 10.0)), Ok(one));
    fly(&mut logic, 0, two, None);
    assert_eq!((logic.state(one), logic.state(two)), (Some(State::FulfilledByLink), Some(State::Completed)));
    let (three, four) = (submit(&mut logic, both_ways("b", 40.0)).unwrap(), StripId(4));
    logic.review(four, Review::Hold, "ops", "weather").unwrap();
    assert_eq!((logic.state(three), logic.state(four)), (Some(State::Held), Some(State::Held)));
    assert_eq!(logic.on_decision_point(2, Tick(600), &[]).pending, 0);
    logic.review(three, Review::Release, "ops", "").unwrap();
    logic.cancel(four, "ops", "no longer needed").unwrap();
    assert_eq!((logic.count(State::CancelledByUser), logic.count(State::Accepted)), (2, 0));
}

#[test]
fn cancelling_while_slewing_gives_the_task_up_and_is_refused_once_imaging_has_begun() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    logic.on_task(chosen(0, id));
    logic.cancel(id, "ops", "clouds").unwrap();
    assert_eq!(logic.take_aborts(), [Abort { task: 0, id }]);
    logic.on_decision_point(1, Tick(50), &[record(0, id, Some(FailureReason::Interrupted))]);
    assert_eq!(logic.state(id), Some(State::CancelledByUser));
    let id = submit(&mut logic, both_ways("b", 10.0)).unwrap();
    logic.on_task(chosen(1, id));
    logic.on_imaging(1, Tick(400));
    for id in [id, StripId(id.0 + 1)] {
        let refusal = logic.cancel(id, "ops", "").unwrap_err();
        assert_eq!(refusal.code(), 121);
        assert!(refusal.to_string().contains("that is executing cannot become cancelled by user"), "{refusal}");
    }
    assert_eq!(replace(&mut logic, id, equatorial("c", 50.0)).unwrap_err().code(), 121);
    assert_eq!(logic.state(id), Some(State::Executing));
    // Chosen before the cancellation was heard of.
    let late = submit(&mut logic, equatorial("late", 80.0)).unwrap();
    logic.on_decision_point(2, Tick(600), &[record(1, id, None)]);
    logic.cancel(late, "ops", "").unwrap();
    logic.on_task(chosen(2, late));
    assert_eq!(logic.take_aborts(), [Abort { task: 2, id: late }]);
}

#[test]
fn a_replacement_takes_over_and_a_refused_one_changes_nothing() {
    let mut logic = logic();
    let old = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    let mut bad = equatorial("a", 10.0);
    bad.request.priority = 2.0;
    assert_eq!(replace(&mut logic, old, bad).unwrap_err().code(), 103);
    assert_eq!(logic.state(old), Some(State::Accepted));
    let mut better = equatorial("a", 10.0);
    better.request.priority = 0.9;
    let new = replace(&mut logic, old, better.clone()).unwrap();
    assert_eq!(logic.request(old).unwrap().standing.superseded_by, Some(new));
    assert_eq!(logic.request(new).unwrap().supersedes, Some(old));
    assert_eq!((logic.state(old), logic.state(new)), (Some(State::Superseded), Some(State::Accepted)));
    assert_eq!(replace(&mut logic, old, better.clone()), Ok(new), "the same call again");
    assert_eq!(submit(&mut logic, better), Ok(new), "the reference is the new one's");
    assert_eq!(replace(&mut logic, old, equatorial("z", 80.0)).unwrap_err().code(), 121);
    assert_eq!(replace(&mut logic, StripId(99), equatorial("z", 80.0)).unwrap_err().code(), 120);
}

#[test]
fn requests_expire_when_their_last_window_or_their_validity_is_over() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    let held = submit(&mut logic, Order { hold_for_approval: true, ..equatorial("b", 40.0) }).unwrap();
    assert_eq!(logic.state(held), Some(State::Held));
    logic.on_decision_point(1, Tick(400_000), &[]);
    assert_eq!((logic.state(id), logic.state(held)), (Some(State::Expired), Some(State::Expired)));
    assert_eq!(logic.review(held, Review::Release, "ops", "").unwrap_err().code(), 121);
}

#[test]
fn bad_requests_are_refused_each_with_its_reason() {
    let mut logic = logic();
    let mut code = |change: fn(&mut Order)| {
        let mut order = equatorial("bad", 10.0);
        change(&mut order);
        submit(&mut logic, order).unwrap_err().code()
    };
    assert_eq!(code(|n| n.request.start_latitude_deg = f64::NAN), 100);
    assert_eq!(code(|n| n.request.acquisition_speed_m_s = f64::INFINITY), 100);
    assert_eq!(code(|n| n.request.end_latitude_deg = 91.0), 101);
    assert_eq!(code(|n| n.request.start_longitude_deg = -181.0), 102);
    assert_eq!(code(|n| n.request.priority = 1.01), 103);
    assert_eq!(code(|n| n.request.acquisition_speed_m_s = 4001.0), 104);
    assert_eq!(code(|n| (n.request.end_latitude_deg, n.request.end_longitude_deg) = (5.1, 10.1)), 105);
    assert_eq!(code(|n| (n.request.end_latitude_deg, n.request.end_longitude_deg) = (5.0, 10.0)), 105);
    assert_eq!(code(|n| n.request.end_longitude_deg = 30.0), 105);
    assert_eq!(code(|n| (n.request.end_latitude_deg, n.request.end_longitude_deg) = (-5.0, -170.0)), 111);
    assert_eq!(code(|n| (n.valid_from_ns, n.valid_until_ns) = (EPOCH_NS + 10, EPOCH_NS + 5)), 106);
    assert_eq!(code(|n| n.valid_until_ns = 1), 106);
    assert_eq!(code(|n| n.valid_until_ns = EPOCH_NS + 1_000_000_000), 110);
    assert_eq!(code(|n| (n.request.start_latitude_deg, n.request.end_latitude_deg) = (80.0, 82.0)), 110);
    assert_eq!(code(|n| n.name = "x".repeat(10_000_000)), 107);
    assert_eq!(code(|n| n.client_ref = "a\u{0}b".to_owned()), 107);
    assert_eq!(code(|n| n.max_attempts = 1001), 122);
    assert_eq!(logic.count(State::Rejected), 17);
    let longest = logic.take_journal().into_iter().filter_map(|entry| match entry {
        Entry::Changed(change) => change.refused.map(|order| order.name.len()),
        _ => None,
    });
    assert_eq!(longest.max(), Some(256), "what is written down of a refused request is short");
}

#[test]
fn calls_hold_one_to_a_hundred_thousand_entries() {
    let code = |count| super::refusal::check_batch(count).map_err(|refusal| refusal.code());
    assert_eq!((code(0), code(1), code(100_000), code(100_001)), (Err(112), Ok(()), Ok(()), Err(109)));
}

#[test]
fn lists_go_by_state_area_and_time_page_by_page() {
    let mut logic = logic();
    let ids: Vec<_> =
        (0..30).map(|i| submit(&mut logic, equatorial(&format!("{i}"), f64::from(i) * 5.0)).unwrap()).collect();
    for id in &ids[..10] {
        logic.cancel(*id, "ops", "").unwrap();
    }
    let all = Filter::default();
    let page = logic.list(&all, StripId(0), 12);
    assert_eq!((page.ids.as_slice(), page.more), (&ids[..12], true));
    let page = logic.list(&all, StripId(24), 12);
    assert_eq!((page.ids.as_slice(), page.more), (&ids[24..], false));
    let cancelled = Filter { states: vec![State::CancelledByUser, State::Expired], ..Filter::default() };
    let page = logic.list(&cancelled, StripId(4), 3);
    assert_eq!((page.ids.as_slice(), page.more), (&ids[4..7], true));
    let area = Area { south_deg: 0.0, north_deg: 10.0, west_deg: 39.0, east_deg: 61.0 };
    let near = Filter { states: vec![State::Accepted], area: Some(area), ..Filter::default() };
    assert_eq!(logic.list(&near, StripId(0), 100).ids, [StripId(11), StripId(12), StripId(13)]);
    let first = logic.strip(ids[20]).unwrap().windows[0];
    let soon = Filter { between: Some((first.open, first.close)), ..Filter::default() };
    let page = logic.list(&soon, StripId(0), 100);
    assert!(page.ids.contains(&ids[20]) && page.ids.len() < 30, "{page:?}");
    assert!(logic.list(&all, StripId(u64::MAX), 10).ids.is_empty());
}

#[test]
fn previews_say_when_and_at_what_cost_without_taking_anything() {
    let mut logic = logic();
    let rivals: Vec<_> = (0..5)
        .map(|i| {
            let mut order = equatorial(&format!("{i}"), 10.0 + f64::from(i));
            order.request.priority = 0.1 + 0.1 * f64::from(i);
            submit(&mut logic, order).unwrap()
        })
        .collect();
    let opportunities = logic.preview(&equatorial("mine", 12.5), Tick(172_800)).unwrap();
    assert!(opportunities.len() > 2);
    let first = &opportunities[0];
    assert!(first.min_elevation.to_degrees() > 10.0);
    assert!(first.conflicts > 0 && rivals.contains(&first.conflict_ids[0]), "{first:?}");
    assert_eq!(first.transition, None, "nothing is known of the satellite yet");
    assert_eq!(logic.len(), 5);
    let until = first.window.close;
    assert_eq!(logic.preview(&equatorial("mine", 12.5), until).unwrap().len(), 1);
    assert_eq!(logic.outlook(StripId(77), until).unwrap_err().code(), 120);
    assert_eq!(logic.outlook(rivals[0], Tick(172_800)).unwrap()[0].window, logic.strip(rivals[0]).unwrap().windows[0]);
    logic.cancel(rivals[0], "ops", "").unwrap();
    assert!(logic.outlook(rivals[0], Tick(172_800)).unwrap().is_empty());
}

/// A life in which everything goes wrong that can; every reason that anybody is given.
fn reasons_of_a_bad_day() -> BTreeSet<Reason> {
    let mut logic = logic();
    let mut refused =
        vec![super::refusal::check_batch(0).unwrap_err(), super::refusal::check_batch(100_001).unwrap_err()];
    let spoilt: [fn(&mut Order); 11] = [
        |order| order.request.start_latitude_deg = f64::NAN,
        |order| order.request.end_latitude_deg = 91.0,
        |order| order.request.start_longitude_deg = -181.0,
        |order| order.request.priority = 1.01,
        |order| order.request.acquisition_speed_m_s = 4001.0,
        |order| order.request.end_longitude_deg = 30.0,
        |order| order.valid_until_ns = 1,
        |order| order.name = "\u{7}".to_owned(),
        |order| order.valid_until_ns = EPOCH_NS + 1_000_000_000,
        |order| (order.request.end_latitude_deg, order.request.end_longitude_deg) = (-5.0, -170.0),
        |order| order.max_attempts = 1001,
    ];
    for spoil in spoilt {
        let mut order = equatorial("bad", 10.0);
        spoil(&mut order);
        refused.push(submit(&mut logic, order).unwrap_err());
    }
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    refused.push(submit(&mut logic, equatorial("a", 20.0)).unwrap_err());
    refused.push(submit(&mut logic, equatorial("b", 10.0)).unwrap_err());
    refused.push(logic.cancel(StripId(99), "ops", "").unwrap_err());
    refused.push(logic.review(id, Review::Release, "ops", "").unwrap_err());
    // The request manager's node says this one, which has a disk.
    refused.push(Refusal::StoreFull);
    logic.on_task(chosen(0, id));
    logic.on_decision_point(1, Tick(300), &[]);
    let went_wrong =
        [FailureReason::Interrupted, FailureReason::Elevation, FailureReason::Attitude, FailureReason::Attitude];
    for (task, failure) in (1..).zip(went_wrong) {
        fly(&mut logic, task, id, Some(failure));
    }
    assert_eq!(logic.state(id), Some(State::Failed));
    let told = logic.take_journal().into_iter().filter_map(|entry| match entry {
        Entry::Changed(change) => Some(change.reason.0),
        _ => None,
    });
    told.chain(refused.iter().map(Refusal::reason)).collect()
}

#[test]
fn every_reason_is_given_by_something() {
    assert_eq!(reasons_of_a_bad_day().into_iter().collect::<Vec<_>>(), Reason::ALL);
}

#[test]
fn a_report_that_contradicts_the_life_cycle_is_told() {
    let mut logic = logic();
    let id = submit(&mut logic, equatorial("a", 10.0)).unwrap();
    logic.on_task(chosen(0, id));
    logic.on_imaging(0, Tick(100));
    assert!(logic.take_contradictions().is_empty());
    // Its last window has closed, and yet nobody said how its imaging ended.
    logic.on_decision_point(0, Tick(400_000), &[]);
    let told = logic.take_contradictions();
    let [contradiction] = &told[..] else { panic!("{told:?}") };
    assert_eq!(
        contradiction.to_string(),
        "reported by request_manager: request 1: a request that is executing cannot become expired"
    );
    assert_eq!(logic.state(id), Some(State::Executing));
}
