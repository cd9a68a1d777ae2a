//! The request manager at scale: its process, its store and its services over DDS.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use swath_ground::requests::store::Store;
use swath_mission::file::Mission;
use swath_mission::orders::import;
use swath_mission::orders::order::Order;
use swath_mission::requests::logic::RequestLogic;
use swath_msgs::swath_msgs as msg;
use swath_node::orders::request_message;
use swath_ros::{Client, Environment, Node, RosArgs, graph};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripRequest;

use super::{anonymous_kb, median};

/// A day, as the paper counts it.
const MISSION: &str = "orbits = 15.0\n";
const TIMEOUT: Duration = Duration::from_secs(60);
/// Strips of the file, and of the measurement of durable submissions.
const FILE: u32 = 5000;
/// Strips held in the end.
const MANY: u32 = 100_000;

/// Figures of the request manager; `swath` is the launcher's program.
pub fn measure(swath: &Path) -> Result<serde_json::Value> {
    let folder = tempfile::tempdir()?;
    let mission = folder.path().join("mission.toml");
    std::fs::write(&mission, MISSION)?;
    let store = folder.path().join("requests.sqlite");
    let program = swath.with_file_name("swath-requests");
    let mut manager = Manager::start(&program, &mission, &store)?;
    let submit_5000_s = submit_file(swath, folder.path())?;

    let environment = Environment { localhost_only: true, ..Environment::read()? };
    let node = Node::start_in(environment, "bench", &RosArgs::default())?;
    let submit = node.client(&graph::SUBMIT_STRIPS)?;
    node.wait_for_service(&submit, TIMEOUT)?;
    let started = Instant::now();
    submit_all(&submit, FILE..2 * FILE, 100)?;
    let durable_submits_per_s = f64::from(FILE) / started.elapsed().as_secs_f64();
    submit_all(&submit, 2 * FILE..MANY, 1000)?;

    let list = node.client(&graph::LIST_STRIPS)?;
    node.wait_for_service(&list, TIMEOUT)?;
    let list_page_100k_ms = longest_page(&list)?;
    let memory_100k_mb = anonymous_kb(manager.0.id()) as f64 / 1e3;
    manager.kill()?;
    let started = Instant::now();
    let _manager = Manager::start(&program, &mission, &store)?;
    // Whoever asks again and again gets an answer as soon as the requests are there.
    let one = msg::ListStripsRequest { limit: 1, after_id: u64::from(MANY) - 1, ..Default::default() };
    while list.call(one.clone(), Duration::from_millis(100)).is_err() {
        ensure!(started.elapsed() < TIMEOUT, "the request manager does not come back");
    }
    let restart_100k_s = started.elapsed().as_secs_f64();
    Ok(serde_json::json!({
        "submit_5000_s": submit_5000_s,
        "durable_submits_per_s": durable_submits_per_s,
        "list_page_100k_ms": list_page_100k_ms,
        "requests_100k_memory_MB": memory_100k_mb,
        "restart_100k_s": restart_100k_s,
        "next_n_100k_ms": next_n(&mission, &store)?,
    }))
}

fn local(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.env("ROS_LOCALHOST_ONLY", "1");
    command
}

struct Manager(Child);

impl Manager {
    fn start(program: &Path, mission: &Path, store: &Path) -> Result<Self> {
        let parameter = |name: &str, path: &Path| format!("{name}:={}", path.display());
        let child = local(program)
            .args(["--ros-args", "-p", &parameter("mission", mission), "-p", &parameter("store", store)])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        Ok(Self(child))
    }

    fn kill(&mut self) -> Result<()> {
        self.0.kill()?;
        self.0.wait()?;
        Ok(())
    }
}

impl Drop for Manager {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.kill();
    }
}

/// Strips spread over the part of the Earth that the satellite sees, no two the same.
fn order(number: u32) -> Order {
    let golden = f64::from(number) * 0.618_033_988_749_895;
    let latitude = f64::from(number % 8009) / 8009.0 * 90.0 - 45.0;
    let longitude = golden.fract() * 340.0 - 170.0;
    let request = StripRequest {
        start_latitude_deg: latitude,
        start_longitude_deg: longitude,
        end_latitude_deg: latitude + 1.0,
        end_longitude_deg: longitude + 1.5,
        priority: golden.fract(),
        acquisition_speed_m_s: 3000.0,
        bidirectional: false,
    };
    Order::new(format!("b{number}"), format!("bench {number}"), request)
}

/// Seconds for `swath strips submit` from its start to its end.
fn submit_file(swath: &Path, folder: &Path) -> Result<f64> {
    let file: PathBuf = folder.join("strips.geojson");
    import::write(&file, &(0..FILE).map(order).collect::<Vec<_>>())?;
    // The node has come up by then: what is measured is the submission.
    let ask = || local(swath).args(["strips", "list", "--limit", "1"]).stdout(Stdio::null()).status();
    ensure!(ask()?.success(), "the request manager does not answer");
    let started = Instant::now();
    let words = ["strips", "submit", "--submitter", "bench"];
    let status = local(swath).args(words).arg(file).stdout(Stdio::null()).status()?;
    ensure!(status.success(), "not all strips of the file are accepted");
    Ok(started.elapsed().as_secs_f64())
}

fn submit_all(client: &Client<msg::SubmitStrips>, numbers: std::ops::Range<u32>, batch: u32) -> Result<()> {
    for first in numbers.clone().step_by(batch as usize) {
        let requests = (first..(first + batch).min(numbers.end)).map(|number| request_message(&order(number)));
        let answer = client.call(msg::SubmitStripsRequest { requests: requests.collect::<Vec<_>>() }, TIMEOUT)?;
        let refused = answer.results.iter().find(|result| !result.accepted);
        ensure!(refused.is_none(), "a strip was refused: {refused:?}");
    }
    Ok(())
}

/// The longest of some pages of 100: by state, by area, by time, from the middle of all [ms].
fn longest_page(client: &Client<msg::ListStrips>) -> Result<f64> {
    let all = msg::ListStripsRequest { limit: 100, ..Default::default() };
    let middle = msg::ListStripsRequest { after_id: u64::from(MANY) / 2, ..all.clone() };
    let accepted = msg::ListStripsRequest { states: vec![msg::StripStatus::STATE_ACCEPTED], ..middle.clone() };
    let europe = msg::ListStripsRequest {
        in_area: true,
        south_deg: 35.0,
        north_deg: 70.0,
        west_deg: -10.0,
        east_deg: 40.0,
        ..all.clone()
    };
    let mut soon = accepted.clone();
    soon.opportunity_until = swath_ros::stamp(1_767_240_000_000_000_000);
    let mut longest: f64 = 0.0;
    for call in [all, middle, accepted, europe, soon] {
        let times = (0..9).map(|_| {
            let started = Instant::now();
            let page = client.call(call.clone(), TIMEOUT)?;
            ensure!(!page.strips.is_empty(), "a page is empty: {}", page.reason);
            Ok(started.elapsed().as_secs_f64() * 1e3)
        });
        longest = longest.max(median(times.collect::<Result<_>>()?));
    }
    Ok(longest)
}

/// The longest of a day's decisions among all strips that are held [ms].
fn next_n(mission: &Path, store: &Path) -> Result<f64> {
    let mission = Mission::read(mission)?;
    let model = mission.model()?;
    let horizon = mission.horizon(&model);
    let snapshot = Store::open_read_only(store)?.snapshot()?;
    let mut logic = RequestLogic::new(model, &mission.initial(), horizon, mission.rules());
    logic.restore(snapshot.requests, snapshot.rejected, snapshot.progress, snapshot.last_settled)?;
    ensure!(logic.len() == MANY as usize, "{} strips are held", logic.len());
    let mut longest: f64 = 0.0;
    for (task, tick) in (0..horizon.0).step_by(250).enumerate() {
        let started = Instant::now();
        std::hint::black_box(logic.on_decision_point(task as u64, Tick(tick), &[]));
        longest = longest.max(started.elapsed().as_secs_f64() * 1e3);
    }
    Ok(longest)
}
