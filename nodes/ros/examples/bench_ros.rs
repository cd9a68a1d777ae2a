//! Measures the traffic of the control loop between processes over DDS, without what the nodes compute.
//!
//! Five processes as in a mission: the spacecraft sends clock and state each tick and needs the command of the tick
//! before; guidance answers each state; the recorder takes everything; planner and request manager are there.
//! Prints one JSON object.

use std::error::Error;
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Parser, ValueEnum};
use serde::{Deserialize, Serialize};
use serde_json::json;
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs::{SpacecraftState, WheelTorque};
use swath_ros::qos::{History, QosProfile};
use swath_ros::{Environment, Mapping, Node, RosArgs, Subscription, graph, stamp};

/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(30);
/// Samples of a topic that the recorder may lag behind.
const RECORDER_DEPTH: usize = 8192;
/// How long the recorder lets samples gather.
const GATHER: Duration = Duration::from_millis(2);

#[derive(Parser)]
struct Options {
    /// Which of the processes this is; without it, the one that starts the others.
    #[arg(long, hide = true)]
    role: Option<Role>,
    /// Ticks to measure, after a tenth as many to warm up.
    #[arg(long, default_value_t = 20_000)]
    ticks: u64,
    /// DDS domain.
    #[arg(long, default_value_t = 29)]
    domain: u16,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Role {
    Spacecraft,
    Guidance,
    Recorder,
    Planner,
    RequestManager,
}

/// What a process found.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Report {
    ticks_per_s: f64,
    cpu_s: f64,
    lost: u64,
    messages: u64,
    memory_kb: u64,
}

type Outcome<T> = Result<T, Box<dyn Error>>;

#[expect(clippy::print_stdout, reason = "the result goes to stdout")]
fn main() -> Outcome<()> {
    let options = Options::parse();
    let line = match options.role {
        None => conduct(&options)?,
        Some(role) => serde_json::to_string(&play(role, &options)?)?,
    };
    println!("{line}");
    Ok(())
}

/// Starts the processes and merges their reports.
fn conduct(options: &Options) -> Outcome<String> {
    let others = [Role::Guidance, Role::Recorder, Role::Planner, Role::RequestManager];
    let others: Vec<Child> = others.iter().map(|role| start(*role, options)).collect::<Outcome<_>>()?;
    let spacecraft = finish(start(Role::Spacecraft, options)?)?;
    let reports: Vec<Report> = others.into_iter().map(finish).collect::<Outcome<_>>()?;
    let all = || reports.iter().chain([&spacecraft]);
    let cpu_s: f64 = all().map(|report| report.cpu_s).sum();
    let figures = json!({
        "dds_loop_ticks_per_s": spacecraft.ticks_per_s.round(),
        "dds_loop_cpu_us_per_tick": (cpu_s / options.ticks as f64 * 1e7).round() / 10.0,
        "dds_loop_messages_recorded": all().map(|report| report.messages).sum::<u64>(),
        "dds_loop_messages_lost": all().map(|report| report.lost).sum::<u64>(),
        "dds_loop_memory_mb": (all().map(|report| report.memory_kb).sum::<u64>() as f64 / 1024.0).round(),
    });
    Ok(serde_json::to_string_pretty(&figures)?)
}

fn start(role: Role, options: &Options) -> Outcome<Child> {
    let value = role.to_possible_value().ok_or("a role has no name")?;
    let (ticks, domain) = (options.ticks.to_string(), options.domain.to_string());
    let words = ["--role", value.get_name(), "--ticks", &ticks, "--domain", &domain];
    Ok(Command::new(std::env::current_exe()?).args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?)
}

/// Tells a process that it is over, by the end of its input, and reads its report.
fn finish(mut child: Child) -> Outcome<Report> {
    drop(child.stdin.take());
    let mut line = String::new();
    BufReader::new(child.stdout.take().ok_or("a process has no output")?).read_line(&mut line)?;
    let status = child.wait()?;
    if !status.success() {
        return Err(format!("a process ended with {status}").into());
    }
    Ok(serde_json::from_str(&line)?)
}

fn play(role: Role, options: &Options) -> Outcome<Report> {
    let environment = Environment { domain: options.domain, localhost_only: true, mapping: Mapping::Cyclone };
    let start = |name| Node::start_in(environment.clone(), name, &RosArgs::default());
    let warm_up = options.ticks / 10;
    let mut report = match role {
        Role::Spacecraft => fly(&start(graph::SPACECRAFT)?, warm_up, options.ticks)?,
        Role::Guidance => command(&start(graph::GUIDANCE)?, warm_up, options.ticks)?,
        Role::Recorder => record(&start(graph::RECORDER)?)?,
        Role::Planner => idle(&start(graph::PLANNER)?),
        Role::RequestManager => idle(&start(graph::REQUEST_MANAGER)?),
    };
    report.memory_kb = peak_memory_kb();
    Ok(report)
}

fn fly(node: &Node, warm_up: u64, ticks: u64) -> Outcome<Report> {
    let clock = node.publisher(&graph::CLOCK)?;
    let states = node.publisher(&graph::SPACECRAFT_STATE)?;
    let torques = node.subscription(&graph::WHEEL_TORQUE)?;
    node.wait_for_peers(&[graph::GUIDANCE, graph::RECORDER, graph::PLANNER, graph::REQUEST_MANAGER], PATIENCE)?;
    let (mut began, mut cpu_before) = (Instant::now(), 0.0);
    for tick in 0..warm_up + ticks {
        if tick == warm_up {
            (began, cpu_before) = (Instant::now(), cpu_s());
        }
        let time = stamp(tick * 500_000_000);
        clock.publish(&Clock { clock: time })?;
        let mut state = SpacecraftState { tick, ..Default::default() };
        state.header.stamp = time;
        state.header.frame_id = "N".to_owned();
        states.publish(&state)?;
        if tick > 0 {
            expect_torque(node, &torques, tick - 1)?;
        }
    }
    expect_torque(node, &torques, warm_up + ticks - 1)?;
    let (wall_s, cpu_s) = (began.elapsed().as_secs_f64(), cpu_s() - cpu_before);
    assert!(clock.flush(PATIENCE));
    assert!(states.flush(PATIENCE));
    Ok(Report { ticks_per_s: ticks as f64 / wall_s, cpu_s, lost: torques.lost(), ..Default::default() })
}

fn expect_torque(node: &Node, torques: &Subscription<WheelTorque>, tick: u64) -> Outcome<()> {
    match torques.wait(node.signal(), PATIENCE)? {
        Some(torque) if torque.tick == tick => Ok(()),
        Some(torque) => Err(format!("the command of tick {} came for tick {tick}", torque.tick).into()),
        None => Err(format!("no command for tick {tick}").into()),
    }
}

fn command(node: &Node, warm_up: u64, ticks: u64) -> Outcome<Report> {
    let states = node.subscription(&graph::SPACECRAFT_STATE)?;
    let torques = node.publisher(&graph::WHEEL_TORQUE)?;
    node.wait_for_peers(&[graph::SPACECRAFT, graph::RECORDER], PATIENCE)?;
    let mut cpu_before = 0.0;
    for done in 0..warm_up + ticks {
        if done == warm_up {
            cpu_before = cpu_s();
        }
        let state = states.wait(node.signal(), PATIENCE)?.ok_or("no state")?;
        torques.publish(&WheelTorque { tick: state.tick, header: state.header, ..Default::default() })?;
    }
    let cpu_s = cpu_s() - cpu_before;
    assert!(torques.flush(PATIENCE));
    until_input_ends();
    Ok(Report { cpu_s, lost: states.lost(), ..Default::default() })
}

fn record(node: &Node) -> Outcome<Report> {
    let qos = |entry: &graph::Entry| -> QosProfile {
        entry.profile.qos().history(History::KeepLast { depth: RECORDER_DEPTH })
    };
    let subscriptions = graph::TOPICS
        .iter()
        .map(|entry| node.raw_subscription(entry.name, entry.type_name, &qos(entry)))
        .collect::<Result<Vec<_>, _>>()?;
    let over = Arc::new(AtomicBool::new(false));
    let (flag, signal) = (Arc::clone(&over), node.signal().clone());
    std::thread::spawn(move || {
        until_input_ends();
        flag.store(true, Ordering::Relaxed);
        signal.raise();
    });
    let mut messages = 0;
    loop {
        let ending = over.load(Ordering::Relaxed);
        for subscription in &subscriptions {
            while subscription.take()?.is_some() {
                messages += 1;
            }
        }
        if ending {
            break;
        }
        node.signal().wait_gathering(GATHER, PATIENCE);
    }
    let lost = subscriptions.iter().map(|subscription| subscription.lost()).sum();
    Ok(Report { cpu_s: cpu_s(), lost, messages, ..Default::default() })
}

fn idle(_node: &Node) -> Report {
    until_input_ends();
    Report { cpu_s: cpu_s(), ..Default::default() }
}

fn until_input_ends() {
    // Nothing is ever written there: reading ends when the other end is closed.
    let _ = std::io::stdin().lock().read_line(&mut String::new());
}

/// Processor time of this process so far [s], all threads.
fn cpu_s() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let on_cpu_ns = |task: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse().ok()
    };
    tasks.filter_map(on_cpu_ns).sum::<f64>() / 1e9
}

/// Most memory that this process had so far [kB].
fn peak_memory_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix(" kB")?.trim().parse().ok()).unwrap_or(0)
}
