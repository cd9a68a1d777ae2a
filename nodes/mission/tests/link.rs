//! Missions over the radio in one process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::orders::action::{Act, Action, Review};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::RequestLogic;
use swath_sim::planner::Lookahead;
use swath_sim::task::{FailureReason, SettledTask};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

const SEVEN: &str = "\"boulder\", \"merritt\", \"singapore\", \"weilheim\", \"santiago\", \"dongara\", \"hawaii\"";

/// A mission of some orbits with `count` strips and a `[link]`.
fn mission(orbits: f64, count: u32, seed: u64, link: &str) -> Mission {
    let text =
        format!("orbits = {orbits}\nseed = {seed}\n[requests.random]\ncount = [{count}, {count}]\n[link]\n{link}\n");
    let mission: Mission = toml::from_str(&text).unwrap();
    mission.validate().unwrap();
    mission.resolved()
}

fn flown(mission: &Mission, actions: Vec<Action>) -> (Vec<SettledTask>, InProcessMission) {
    let mut flight = InProcessMission::with_actions(mission, actions).unwrap();
    let mut tasks = Vec::new();
    flight.run(&mut Lookahead::default(), |settled, _| tasks.push(settled.clone())).unwrap();
    (tasks, flight)
}

fn action(at: u64, act: Act) -> Action {
    Action { at: Tick(at), initial: false, actor: "ops".to_owned(), reason: "test".to_owned(), act }
}

/// Requests of two that are not the same strip by strip, up to what is on board.
fn differences(ground: &RequestLogic, space: &RequestLogic) -> Vec<String> {
    let of = |id: StripId| {
        let (ground, space) = (ground.request(id)?, space.request(id)?);
        (ground != space).then(|| format!("{id:?}: {ground:?} on the ground, {space:?} on board"))
    };
    (1..=space.len() as u64).map(StripId).filter_map(of).collect()
}

/// What must hold once the radio has been open long enough after the last change.
fn assert_settled(flight: &InProcessMission) {
    let link = flight.link().unwrap();
    let (ground, space) = (link.ground().requests(), link.space().requests());
    assert_eq!(ground.len(), space.len(), "each accepted order is on board exactly once, and none is invented");
    assert_eq!(differences(ground, space), Vec::<String>::new());
    // Whoever comes back adds them up anew.
    assert!((ground.reward() - space.reward()).abs() < 1e-9, "{} and {}", ground.reward(), space.reward());
    assert_eq!((link.ground().misread(), link.space().misread()), (0, 0));
}

/// Hours after the last order in which nothing is imaged, so that all that happened can come down.
fn with_an_end(mission: &mut Mission, valid_hours: f64) {
    let (orders, _) = mission.initial_requests().unwrap();
    let until = u64::from(mission.epoch_unix_s) * 1_000_000_000 + (valid_hours * 3.6e12) as u64;
    let folder = tempfile::tempdir().unwrap();
    let orders: Vec<_> = orders
        .into_iter()
        .map(|order| swath_mission::orders::order::Order { valid_until_ns: until, ..order })
        .collect();
    let path = folder.keep().join("strips.geojson");
    swath_mission::orders::import::write(&path, &orders).unwrap();
    mission.requests.random = None;
    mission.requests.files = vec![path];
}

#[test]
fn after_the_last_pass_the_ground_knows_what_the_satellite_does() {
    for (stations, seed) in [(SEVEN, 1), ("\"puertollano\", \"awarua\", \"punta-arenas\"", 2)] {
        for loss in ["0.0", "0.1", "0.5"] {
            let link = format!("stations = [{stations}]\nloss = {loss}\nstrip_bits = 50e6");
            let mut mission = mission(8.0, 400, seed, &link);
            with_an_end(&mut mission, 6.0);
            let (tasks, flight) = flown(&mission, Vec::new());
            let imaged = tasks.iter().filter(|it| it.record.success()).count();
            assert!(imaged > 20, "{imaged} imaged");
            assert_settled(&flight);
            let lines = flight.ways();
            assert!(lines.iter().all(|it| it.acknowledged_tick.is_some()), "loss {loss}");
            let delivered = lines.iter().filter(|it| it.delivered_tick.is_some()).count();
            assert_eq!(delivered, imaged, "loss {loss}");
            for line in &lines {
                let times = [Some(line.queued_tick), line.uplinked_tick, line.on_board_tick, line.acknowledged_tick];
                assert!(times.is_sorted() && times[1] < times[2] && times[2] < times[3], "{line:?}");
                assert!(line.imaged_tick.is_none_or(|imaged| line.on_board_tick < Some(imaged)), "{line:?}");
                assert!(line.imaged_tick.is_none() || line.imaged_tick < line.known_tick, "{line:?}");
                assert!(line.delivered_tick.is_none_or(|delivered| line.imaged_tick < Some(delivered)), "{line:?}");
            }
        }
    }
}

#[test]
fn the_same_mission_twice_is_the_same_to_the_bit() {
    for loss in ["0.0", "0.2"] {
        let mission = mission(3.0, 800, 4, &format!("stations = [{SEVEN}]\nloss = {loss}"));
        let ((one, first), (two, second)) = (flown(&mission, Vec::new()), flown(&mission, Vec::new()));
        assert_eq!(one, two);
        assert_eq!(first.ways(), second.ways());
        let (first, second) = (first.link().unwrap(), second.link().unwrap());
        assert_eq!(first.space().counts(), second.space().counts());
        assert!(loss == "0.0" || first.space().counts().sent > first.ground().counts().heard);
    }
}

#[test]
fn what_waits_for_a_pass_is_not_imaged_before() {
    let mission = mission(4.0, 1500, 3, "stations = [\"puertollano\", \"awarua\"]");
    let (tasks, flight) = flown(&mission, Vec::new());
    let link = flight.link().unwrap();
    let rise = link.radio().contacts().all()[0].rise;
    assert!(rise > Tick(0));
    assert!(tasks.iter().filter(|it| it.record.start <= rise).all(|it| it.record.strip.is_none()));
    assert!(tasks.iter().any(|it| it.record.success()));
    // Between passes the ground knows nothing new: all that it knows came while a station heard the satellite.
    let known: Vec<Tick> = flight.ways().iter().filter_map(|it| it.known_tick).collect();
    let heard = |tick: Tick| link.radio().contacts().all().iter().any(|it| it.rise < tick && tick.0 <= it.set.0 + 2);
    assert!(known.iter().all(|tick| heard(*tick)), "{known:?}");
}

#[test]
fn with_a_link_that_never_opens_the_ground_knows_nothing() {
    let (tasks, flight) = flown(&mission(1.0, 200, 3, "stations = [\"svalbard\"]"), Vec::new());
    assert!(tasks.iter().all(|it| it.record.strip.is_none()));
    let link = flight.link().unwrap();
    assert!(link.space().requests().is_empty());
    assert_eq!(link.ground().requests().count(State::Accepted), link.ground().requests().len());
    assert!(flight.ways().iter().all(|it| it.uplinked_tick.is_none() && it.acknowledged_tick.is_none()));
    assert_eq!(link.ground().housekeeping(), None);
}

#[test]
fn without_commands_the_satellite_images_nothing_until_it_hears_again() {
    let link = "stations = [\"puertollano\", \"awarua\", \"punta-arenas\"]\ncommand_loss_h = 1.0";
    let mission = mission(8.0, 1500, 2, link);
    let (tasks, mut flight) = flown(&mission, Vec::new());
    let journal = flight.board().take_journal();
    assert!(!journal.is_empty() && journal.iter().all(|it| it.key.name == "ground silent"), "{}", journal.len());
    let passes: Vec<(Tick, Tick)> = flight.link().unwrap().radio().contacts().from(Tick(0)).to_vec();
    let lost = |tick: Tick| passes.iter().all(|(rise, set)| tick < *rise || tick.since(*set) >= 7200);
    let images = |it: &&SettledTask| it.record.strip.is_some();
    assert!(tasks.iter().filter(images).count() > 10);
    assert_eq!(tasks.iter().filter(images).filter(|it| lost(it.record.start)).count(), 0);
    assert!(tasks.iter().any(|it| it.record.start > passes[0].1 && lost(it.record.start)), "{passes:?}");
}

#[test]
fn a_satellite_that_is_to_go_on_without_commands_images_what_is_on_board_and_says_that_it_hears_nobody() {
    let stations = "stations = [\"puertollano\", \"awarua\", \"punta-arenas\"]";
    let silent = format!("{stations}\ncommand_loss_h = 1.0\ncommand_loss_mode = \"continue\"");
    let (tasks, mut flight) = flown(&mission(8.0, 1500, 2, &silent), Vec::new());
    let journal = flight.board().take_journal();
    assert!(!journal.is_empty() && journal.iter().all(|it| it.key.name == "ground silent"), "{}", journal.len());
    let (never_lost, _) = flown(&mission(8.0, 1500, 2, stations), Vec::new());
    assert_eq!(tasks, never_lost);
}

#[test]
fn changes_in_time_count_and_late_ones_are_answered_so() {
    let mut mission = mission(5.0, 600, 1, "mode = \"always\"\nprocessing_s = 5.0\nloss = 0.1");
    with_an_end(&mut mission, 5.0);
    let (before, _) = flown(&mission, Vec::new());
    let imaging: Vec<&SettledTask> = before.iter().filter(|it| it.record.success()).collect();
    let id = |at: usize| imaging[at].record.strip.unwrap();
    let start = |at: usize| imaging[at].record.start.0;
    let slewing = &imaging[12].record;
    assert!(slewing.t_pre > 14, "{slewing:?}");
    let orders = InProcessMission::new(&mission).unwrap();
    let order = |at: usize| orders.link().unwrap().ground().requests().request(id(at)).unwrap().order.clone();
    let replacement = |at: usize, client_ref: &str| {
        let mut order = order(at);
        order.request.priority = 0.5;
        Box::new(swath_mission::orders::order::Order { client_ref: client_ref.to_owned(), ..order })
    };
    let mut actions = vec![
        action(100, Act::Cancel(id(20))),
        action(100, Act::Review(id(21), Review::Hold)),
        action(100, Act::Replace(id(22), replacement(22, "in time"))),
        // It is being imaged or was when this comes.
        action(start(4) + 20, Act::Cancel(id(4))),
        action(start(4) + 30, Act::Replace(id(5), replacement(5, "too late"))),
        // The satellite slews to it when this comes.
        action(slewing.start.0 + 1, Act::Cancel(id(12))),
    ];
    actions[4].at = Tick(imaging[5].record.end.0 - 2);
    actions[3].at = Tick(imaging[4].record.end.0 - 2);
    actions.sort_by_key(|it| it.at);
    let (tasks, flight) = flown(&mission, actions);
    assert_settled(&flight);
    let link = flight.link().unwrap();
    let ground = link.ground().requests();
    assert_eq!(ground.state(id(20)), Some(State::CancelledByUser));
    assert_eq!(ground.state(id(21)), Some(State::Expired));
    assert!(tasks.iter().all(|it| it.record.strip != Some(id(21))), "what is held is not imaged");
    assert_eq!(ground.state(id(22)), Some(State::Superseded));
    assert_eq!(ground.state(id(4)), Some(State::Completed));
    assert_eq!(ground.state(id(5)), Some(State::Completed));
    let late = ground.by_reference("mission", "too late").unwrap();
    assert_eq!(ground.state(late), Some(State::CancelledBySystem));
    let reason = &ground.request(late).unwrap().reason.1;
    assert!(reason.starts_with("too late: request") && reason.contains("is completed"), "{reason}");
    let answer = link.ground().asked().iter().find(|it| it.action.act == Act::Cancel(id(4))).unwrap();
    let refusal = answer.refusal.as_deref().unwrap();
    assert!(refusal.contains("cannot become cancelled by user"), "{refusal}");
    assert!(answer.uplinked < answer.decided && answer.decided < answer.answered, "{answer:?}");
    let given_up = tasks.iter().find(|it| it.record.strip == Some(id(12))).unwrap();
    assert_eq!(given_up.record.outcome.failure, Some(FailureReason::Interrupted), "{given_up:?}");
    assert!(given_up.record.end.0 < slewing.start.0 + u64::from(slewing.t_pre));
    assert_eq!(ground.state(id(12)), Some(State::CancelledByUser));
}

#[test]
fn a_ground_that_is_lost_and_comes_back_loses_and_doubles_nothing() {
    // The orders take more than one pass.
    let link = format!("stations = [{SEVEN}]\nloss = 0.2\nuplink_bps = 1000");
    let mut mission = mission(8.0, 1000, 1, &link);
    with_an_end(&mut mission, 6.0);
    let (nominal, _) = flown(&mission, Vec::new());
    // Lost every five minutes, for half a minute each time.
    let plan: Vec<String> = (1..140).map(|at| format!("\"request_manager:hang@{}s+30s\"", at * 300)).collect();
    mission.faults = toml::from_str(&format!("plan = [{}]", plan.join(", "))).unwrap();
    let (tasks, flight) = flown(&mission, Vec::new());
    assert_settled(&flight);
    assert!(tasks != nominal, "its absence is felt");
    assert!(tasks.iter().filter(|it| it.record.success()).count() > 20);
    assert!(flight.ways().iter().all(|it| it.acknowledged_tick.is_some()));
}

#[test]
fn frames_that_are_lost_by_order_cost_time_and_nothing_else() {
    let mut mission = mission(6.0, 800, 1, &format!("stations = [{SEVEN}]\nuplink_bps = 1000"));
    with_an_end(&mut mission, 4.0);
    let (nominal, before) = flown(&mission, Vec::new());
    mission.faults = toml::from_str("plan = [\"link:drop 80%@0s+6000s\"]").unwrap();
    mission.validate().unwrap();
    let (tasks, mut flight) = flown(&mission, Vec::new());
    let lost = |flight: &InProcessMission| {
        let link = flight.link().unwrap();
        link.ground().counts().sent - link.space().counts().heard
    };
    assert!(lost(&before) < 20 && lost(&flight) > 50, "{} and {}", lost(&before), lost(&flight));
    assert!(tasks != nominal, "it is felt");
    assert_settled(&flight);
    let journal = flight.board().take_journal();
    assert!(journal.iter().any(|it| it.key.name == "frames lost" && it.tick == Tick(0)), "{journal:?}");
    // Of nodes that are replaced at once, while the clock stands, nothing is felt.
    mission.faults = toml::from_str("plan = [\"link:kill@900s\", \"catalogue:hang@1500s\"]").unwrap();
    mission.validate().unwrap();
    let (tasks, mut flight) = flown(&mission, Vec::new());
    assert_eq!(tasks, nominal);
    let names: Vec<_> = flight.board().take_journal().iter().map(|it| it.key.name.clone()).collect();
    assert_eq!(names, ["link lost", "link lost", "catalogue lost", "catalogue lost"]);
    mission.link = None;
    let error = mission.validate().unwrap_err().to_string();
    assert!(error.ends_with("link:kill@900s: the mission has no [link], so nothing of the radio can fail"), "{error}");
}
