//! The store gives back what was written, and refuses what it does not know.

use rusqlite::Connection;
use swath_sim::config::SimConfig;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use super::store::{Durability, Store, StoreError};
use swath_mission::orders::action::Review;
use swath_mission::orders::order::Order;
use swath_mission::requests::journal::{InFlight, Outcome};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{RequestLogic, Rules};

fn empty() -> RequestLogic {
    let model = Model::new(SimConfig::default()).unwrap();
    let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
    RequestLogic::new(model, &initial, Tick(172_800), Rules { epoch_ns: 0, max_attempts: 10 })
}

fn requests(count: usize) -> Vec<Order> {
    let scenario = ScenarioConfig::default();
    let random = scenario.generate(&mut rng::stream(3, rng::CATALOGUE), count, 6_378_136.6);
    (1..).zip(random).map(|(i, request)| Order::new(format!("r{i}"), format!("strip {i}"), request)).collect()
}

fn write(store: &mut Store, logic: &mut RequestLogic) {
    store.write(logic.take_journal().iter(), &logic.progress(), Durability::Process).unwrap();
}

/// A life with something of everything.
fn busy(store: &mut Store) -> RequestLogic {
    let mut logic = empty();
    for (i, mut order) in requests(60).into_iter().enumerate() {
        order.request.bidirectional = i % 4 == 0;
        order.hold_for_approval = i % 7 == 0;
        order.valid_until_ns = if i % 5 == 0 { 80_000_000_000_000 } else { 0 };
        let _ = logic.submit(order, logic.now());
    }
    write(store, &mut logic);
    let held: Vec<_> =
        (1..=logic.len() as u64).map(StripId).filter(|&id| logic.state(id) == Some(State::Held)).collect();
    logic.review(held[0], Review::Release, "ops", "seen").unwrap();
    logic.review(held[2], Review::Reject, "ops", "not now").unwrap();
    let accepted: Vec<_> =
        (1..=logic.len() as u64).map(StripId).filter(|&id| logic.state(id) == Some(State::Accepted)).collect();
    logic.cancel(accepted[1], "ops", "clouds").unwrap();
    let old = logic.request(accepted[2]).unwrap().order.clone();
    let mut better = old.clone();
    better.request.priority = 0.99;
    logic.replace(accepted[2], better, logic.now()).unwrap();
    let outcome = |failure| TaskOutcome { failure, max_attitude_error: 0.25, min_elevation: 0.5 };
    for (task, id, failure) in [(0, accepted[5], None), (1, accepted[8], Some(FailureReason::Elevation))] {
        let start = Tick(task * 300);
        logic.on_task(InFlight { task, id, start, t_pre: 100, t_acq: 200 });
        let (strip, outcome) = (Some(id), outcome(failure));
        let end = start.after(300);
        let record = TaskRecord { task, start, end, strip, duty: None, t_pre: 100, t_acq: 200, outcome };
        logic.on_decision_point(task + 1, record.end, std::slice::from_ref(&record));
    }
    logic.on_task(InFlight { task: 2, id: accepted[11], start: Tick(600), t_pre: 100, t_acq: 200 });
    write(store, &mut logic);
    logic
}

#[test]
fn a_request_manager_that_is_restored_is_the_same_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.sqlite");
    let mut store = Store::open(&path, "mission").unwrap();
    let mut before = busy(&mut store);
    drop(store);
    let store = Store::open(&path, "mission").unwrap();
    let snapshot = store.snapshot().unwrap();
    assert!(snapshot.begun);
    let mut after = empty();
    after.restore(snapshot.requests, snapshot.rejected, snapshot.progress, snapshot.last_settled).unwrap();
    assert_eq!((after.len(), after.progress(), after.reward()), (before.len(), before.progress(), before.reward()));
    for id in (1..=before.len() as u64).map(StripId) {
        assert_eq!(after.request(id), before.request(id), "{id:?}");
        assert_eq!(after.strip(id).unwrap().linked, before.strip(id).unwrap().linked);
    }
    for state in State::ALL {
        assert_eq!(after.count(state), before.count(state), "{state:?}");
    }
    for task in 3..200 {
        let now = Tick(task * 900);
        assert_eq!(after.on_decision_point(task, now, &[]), before.on_decision_point(task, now, &[]));
    }
    let now = after.now();
    assert_eq!(after.submit(requests(1).remove(0), now), before.submit(requests(1).remove(0), now));
}

#[test]
fn the_history_of_a_replacement_begins_with_that_of_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(&folder.path().join("store.sqlite"), "mission").unwrap();
    let mut logic = empty();
    let order = requests(1).remove(0);
    let old = logic.submit(order.clone(), Tick(0)).unwrap();
    let new = logic.replace(old, Order { name: "better".to_owned(), ..order }, Tick(0)).unwrap();
    logic.cancel(new, "ops", "after all").unwrap();
    let _ = logic.submit(Order { name: "x".repeat(300), ..requests(2).remove(1) }, Tick(0));
    write(&mut store, &mut logic);
    let lines = store.history(new).unwrap();
    let went: Vec<_> = lines.iter().map(|line| (line.id, line.state, line.actor.as_str())).collect();
    assert_eq!(
        went,
        [
            (old, State::Accepted, "mission"),
            (new, State::Accepted, "mission"),
            (old, State::Superseded, "mission"),
            (new, State::CancelledByUser, "ops"),
        ]
    );
    let trail = store.trail(1, 100).unwrap();
    assert_eq!(trail.iter().map(|line| line.sequence).collect::<Vec<_>>(), [2, 3, 4, 5]);
    assert_eq!((trail[3].id, trail[3].reason.0, trail[3].client_ref.as_str()), (StripId(0), 107, "r2"));
}

#[test]
fn attempts_come_back_and_a_task_cannot_be_settled_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.sqlite");
    let mut store = Store::open(&path, "mission").unwrap();
    let logic = busy(&mut store);
    let flown: Vec<_> =
        (1..=logic.len() as u64).flat_map(|id| store.attempts(StripId(id)).unwrap()).map(|it| it.outcome).collect();
    assert_eq!(flown, [Outcome::Succeeded, Outcome::Failed(FailureReason::Elevation)]);
    let raw = Connection::open(&path).unwrap();
    let twice = "INSERT INTO attempts SELECT * FROM attempts WHERE task = 0";
    assert!(raw.execute(twice, []).unwrap_err().to_string().contains("UNIQUE constraint failed"));
    for rewrite in ["UPDATE changes SET tick = 0", "DELETE FROM changes"] {
        assert!(raw.execute(rewrite, []).unwrap_err().to_string().contains("the history is never"), "{rewrite}");
    }
}

#[test]
fn stores_of_other_missions_and_of_the_future_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.sqlite");
    drop(Store::open(&path, "one").unwrap());
    assert!(matches!(Store::open(&path, "two"), Err(StoreError::OtherMission { .. })));
    Connection::open(&path).unwrap().execute_batch("PRAGMA user_version=77").unwrap();
    for error in [Store::open(&path, "one").err(), Store::open_read_only(&path).err()] {
        let error = error.unwrap().to_string();
        assert!(error.contains("has schema 77, this program knows schemas up to 4"), "{error}");
    }
    std::fs::write(&path, "this is no database, although it is long enough to look like one").unwrap();
    assert!(Store::open(&path, "one").is_err());
    assert!(Store::open_read_only(&folder.path().join("missing.sqlite")).is_err());
}

#[test]
fn a_store_of_the_first_schema_is_brought_up_to_date() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.sqlite");
    let raw = Connection::open(&path).unwrap();
    raw.execute_batch(include_str!("schema_1.sql")).unwrap();
    raw.execute_batch(
        "PRAGMA user_version=1; INSERT INTO settings VALUES ('mission', 'one');
        INSERT INTO changes (request, tick, state, reason_code, reason, actor, refused_ref, refused_name)
            VALUES (0, 5, 1, 101, 'too far north', 'request_manager', 'ref', 'name');",
    )
    .unwrap();
    drop(raw);
    let read = Store::open_read_only(&path).unwrap();
    assert_eq!((read.snapshot().unwrap().rejected, read.trail(0, 10).unwrap().len()), (1, 1));
    drop(read);
    let store = Store::open(&path, "one").unwrap();
    assert_eq!(store.snapshot().unwrap().rejected, 1);
    assert_eq!(store.trail(0, 10).unwrap()[0].reason.1, "too far north");
    let raw = Connection::open(&path).unwrap();
    let version: i64 = raw.query_row("PRAGMA user_version", [], |row| row.get(0)).unwrap();
    let index = "SELECT COUNT(*) FROM sqlite_master WHERE name = 'changes_of_request'";
    let count: i64 = raw.query_row(index, [], |row| row.get(0)).unwrap();
    assert_eq!((version, count), (4, 1));
}

/// As when one is stopped, replaced, and goes on.
#[test]
fn whoever_opened_a_store_before_cannot_write_it_any_more() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("store.sqlite");
    let mut stopped = Store::open(&path, "mission").unwrap();
    let mut logic = busy(&mut stopped);
    let mut fresh = Store::open(&path, "mission").unwrap();
    let before = fresh.snapshot().unwrap();
    logic.submit(requests(1).remove(0), logic.now()).unwrap();
    let entries = logic.take_journal();
    assert!(!entries.is_empty());
    let progress = logic.progress();
    let error = stopped.write(entries.iter(), &progress, Durability::Machine).unwrap_err();
    assert!(error.to_string().ends_with("another request manager has taken it over"), "{error}");
    let after = fresh.snapshot().unwrap();
    let known = before.requests.len();
    assert_eq!((after.requests, after.progress), (before.requests, before.progress));
    fresh.write(entries.iter(), &progress, Durability::Machine).unwrap();
    assert_eq!(fresh.snapshot().unwrap().requests.len(), known + 1);
}

/// What SQLite says when its file may not grow is what it says when the disk is full.
#[test]
fn a_store_without_room_says_so_and_goes_on_once_there_is_some() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(&folder.path().join("store.sqlite"), "mission").unwrap();
    let mut logic = empty();
    store.set_pages_max(1).unwrap();
    for order in requests(300) {
        let _ = logic.submit(order, logic.now());
    }
    let (journal, progress) = (logic.take_journal(), logic.progress());
    let error = store.write(journal.iter(), &progress, Durability::Machine).unwrap_err();
    assert!(error.is_full() && store.full().is_full(), "{error}");
    assert!(!store.snapshot().unwrap().begun, "nothing of it is there");
    store.set_pages_max(1_000_000).unwrap();
    store.write(journal.iter(), &progress, Durability::Machine).unwrap();
    assert_eq!(store.snapshot().unwrap().requests.len(), logic.len());
    let other = StoreError::TakenOver { path: folder.path().to_owned() };
    assert!(!other.is_full());
}
