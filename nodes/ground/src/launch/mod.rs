//! The launcher: starts the nodes of a mission, watches them, and leaves its outputs.

mod kept;
mod losses;
mod output;
mod over_dds;
mod process;
mod progress;
mod start;
mod supervisor;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context as _, Error, Result, bail};
use clap::Args;
use swath_sim::planner::{Planner, PlannerSpec};
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::task::Totals;
use swath_sim::time::Tick;

use output::{Flown, OutputFolder};
use progress::Progress;
use start::Wishes;
use swath_mission::approval::{Gate, GatedPlanner};
use swath_mission::fallback::{GuardedPlanner, Policies, made_instead};
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::link::config::LinkConfig;
use swath_mission::orders::order::Order;
use swath_mission::origin::Origins;
use swath_mission::outcome::{Summary, SummaryInputs};
use swath_node::out;
use swath_node::stamp::Stamper;
use swath_ros::RosArgs;

use crate::place::Place;
use crate::requests::orders::outcomes;

/// `swath launch`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath launch examples/missions/one_orbit.toml --out out/one\n  \
    swath launch examples/missions/one_orbit.toml --in-process --seed 7\n  \
    swath launch examples/missions/operators_day.toml --console")]
pub struct LaunchArgs {
    /// Mission file (TOML).
    #[arg(required_unless_present = "attach")]
    pub mission: Option<PathBuf>,
    /// Take over a mission whose launcher is gone: its output folder. Its nodes fly on, those that have ended are started
    /// again, and it is watched to its end.
    #[arg(long, value_name = "OUT", conflicts_with_all = ["mission", "out", "in_process", "no_bag", "orbits", "requests",
        "planner", "seed", "pace", "console", "without", "namespace"])]
    pub attach: Option<PathBuf>,
    /// Folder for bag, tasks and summary; it must be empty or not exist [default: out/NAME-SEED-N].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Fly in this process, without DDS and without a bag.
    #[arg(long)]
    pub in_process: bool,
    /// Do not record a bag.
    #[arg(long)]
    pub no_bag: bool,
    /// Length [orbits] instead of the mission's.
    #[arg(long, allow_negative_numbers = true)]
    pub orbits: Option<f64>,
    /// Number of random strips instead of the mission's.
    #[arg(long)]
    pub requests: Option<u32>,
    /// Planner instead of the mission's: random, heuristic:SECONDS, lookahead, lookahead:TICKS, beam, beam:WIDTHxDEPTH,
    /// frugal, beam+handmade:SHARE, repair, repair:TICKS, aspen (these two also with -annealing or -squeaky), or a policy: hop-ppo, hop-ppo-mlp, h-ppo
    /// or discrete-ppo, each also with +lookahead, and with :FILE for one that is not shipped.
    #[arg(long)]
    pub planner: Option<PlannerSpec>,
    /// Seed instead of the mission's.
    #[arg(long)]
    pub seed: Option<u64>,
    /// 0: lockstep; 1: real time; x: x times real time; instead of the mission's.
    #[arg(long, allow_negative_numbers = true)]
    pub pace: Option<f64>,
    /// Print the summary as JSON instead of a table.
    #[arg(long)]
    pub json: bool,
    /// Show the mission as a page in a browser, at this address of this machine.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8080",
        conflicts_with = "in_process")]
    pub console: Option<std::net::SocketAddr>,
    /// Do not start this node: another program takes its place. Time begins when it is there.
    #[arg(long, value_name = "NODE", value_parser = Origins::NAMES, conflicts_with = "in_process")]
    pub without: Vec<String>,
    /// Where it flies.
    #[command(flatten)]
    pub place: Place,
}

impl LaunchArgs {
    fn mission(&self) -> Result<Mission> {
        let path = self.mission.as_deref().context("there is no mission file")?;
        let mut mission = Mission::read(path)?;
        if let Some(orbits) = self.orbits {
            mission.orbits = orbits;
        }
        if let Some(count) = self.requests {
            let scenario = mission.requests.random.take().unwrap_or_default();
            mission.requests.random = Some(ScenarioConfig { count: [count, count], ..scenario });
        }
        if let Some(planner) = &self.planner {
            mission.planner = planner.clone();
            mission.planner.resolve(&std::env::current_dir()?);
        }
        if let Some(seed) = self.seed {
            mission.seed = seed;
        }
        if let Some(pace) = self.pace {
            mission.pace = pace;
        }
        for name in &self.without {
            mission.nodes.set_external(name);
        }
        mission.validate()?;
        Ok(mission.resolved())
    }
}

/// The exit code of a mission that was flown, but not by the planner that was asked for.
const NOT_AS_ASKED: u8 = 3;

/// The exit code of a mission that came into safe mode.
const SAFE_MODE: u8 = 4;

/// Flies a mission and prints its summary.
///
/// The exit code is 3 when another planner decided in the place of the one that was asked for, and 4 when the mission
/// came into safe mode because a node was lost again and again.
///
/// # Errors
/// When the mission is not valid, a node fails or never comes up, or an output cannot be written. What was flown until
/// then is in the outputs; where nothing was, there are none.
pub fn run(args: &LaunchArgs, ros: &RosArgs, policies: &Policies) -> Result<ExitCode> {
    if let Some(folder) = &args.attach {
        let (mut output, lines) = OutputFolder::reopen(folder)?;
        let mission = Mission::read(&folder.join("mission.toml"))?;
        let flown = over_dds::take_over(&mission, ros, &mut output, &lines)?;
        return tell(args, &mission, &output, flown);
    }
    let mission = args.mission()?;
    if args.in_process {
        mission.faults.fits_one_process()?;
        if let [external, ..] = mission.nodes.external()[..] {
            bail!("a mission whose {external} is another program does not fly in one process");
        }
    } else {
        mission.faults.fits_dds()?;
    }
    for unseen in mission.stations_never_seen()? {
        tracing::warn!("{unseen}");
    }
    let (requests, faults) = mission.initial_requests()?;
    faults.iter().for_each(out::say);
    let mut output = OutputFolder::create(args.out.as_deref(), &mission)?;
    let flown = fly(args, &args.place.args(ros), &mission, &requests, &mut output, policies);
    match flown {
        Ok(flown) => tell(args, &mission, &output, flown),
        Err(error) => {
            output.discard()?;
            Err(error)
        }
    }
}

/// Writes and prints what came of a mission, and puts it into an exit code.
fn tell(args: &LaunchArgs, mission: &Mission, output: &OutputFolder, flown: Flown) -> Result<ExitCode> {
    let Flown { summary, failure, safe_mode } = flown;
    output.write_summary(&summary)?;
    if args.json {
        out::print_line(serde_json::to_string_pretty(&summary)?)?;
    } else {
        out::print(&format!("{}\n  outputs              {}\n", summary.table().trim_end(), output.path().display()))?;
    }
    if let Some(reason) = safe_mode {
        out::say(format_args!("safe mode: {reason}"));
        return Ok(ExitCode::from(SAFE_MODE));
    }
    if let Some(error) = failure {
        return Err(error);
    }
    match summary.decided_instead.values().sum::<u64>() {
        0 => Ok(ExitCode::SUCCESS),
        count => {
            out::say(format_args!("{count} decisions were not made by {}, which was asked for", mission.planner));
            Ok(ExitCode::from(NOT_AS_ASKED))
        }
    }
}

/// Flies a mission; an error where nothing was flown.
fn fly(
    args: &LaunchArgs,
    ros: &RosArgs,
    mission: &Mission,
    requests: &[Order],
    output: &mut OutputFolder,
    policies: &Policies,
) -> Result<Flown> {
    let mission_file = output.write_mission(mission, requests)?;
    // What is flown is what was written: nodes, in-process missions and re-flights read the same file.
    let mission = Mission::read(&mission_file)?;
    if args.in_process {
        fly_in_process(&mission, output, policies)
    } else {
        let predicts = |link: &LinkConfig| link.predicts_h(mission.pace) > 0.0;
        let learned = matches!(mission.planner, PlannerSpec::Learned { .. });
        let wishes = Wishes {
            record: !args.no_bag,
            console: args.console,
            radio: mission.link.is_some(),
            foresees_policy: learned && mission.link.as_ref().is_some_and(predicts),
            external: &mission.nodes.external(),
        };
        over_dds::fly(&mission, &mission_file, ros, output, wishes, policies)
    }
}

fn fly_in_process(mission: &Mission, output: &mut OutputFolder, policies: &Policies) -> Result<Flown> {
    let mut flight = InProcessMission::new(mission)?;
    let planner = GuardedPlanner::make(policies, &mission.planner, mission.seed);
    if let Some(reason) = planner.missing() {
        out::say(format_args!("no planner {}: {reason}; {} takes over", mission.planner, planner.name()));
    }
    if let Some(warning) = policies.warning(&mission.planner, &mission.sim) {
        out::say(format_args!("warning: {warning}"));
    }
    let period = flight.model().period;
    let mut planner = GatedPlanner { gate: Gate::new(&mission.approval, period), planner };
    let horizon = mission.horizon(flight.model());
    let mut totals = Totals::default();
    let mut progress = Progress::new(horizon, period);
    let started = Instant::now();
    let mut end = Tick(0);
    let mut unwritten = None;
    let outcome = flight.run(&mut planner, |settled, line| {
        totals.add(settled);
        end = settled.record.end;
        progress.task(end, &totals);
        if let Err(error) = output.write_task(&line) {
            unwritten.get_or_insert(error);
        }
    });
    progress.finish();
    let failure = outcome.err().map(Error::from);
    let failure = failure.or(unwritten.map(|error| error.context("cannot write tasks.jsonl")));
    let kept = output.finish(&flight.board().take_journal());
    let failure = failure.or(kept.err()).or(output.write_ways(&flight.ways()).err());
    let (requested, accepted) = flight.counts();
    let inputs = SummaryInputs {
        planner: mission.planner.to_string(),
        decided_instead: made_instead(planner.planner.deciders().clone(), &mission.planner),
        failure: failure.as_ref().map(out::chain),
        seed: mission.seed,
        orbits: mission.orbits,
        ticks: if failure.is_some() { end.0 } else { horizon.0 },
        wall_seconds: started.elapsed().as_secs_f64(),
        requests: requested as u64,
        accepted: accepted as u64,
        orders: outcomes(&Stamper::new(mission.epoch_unix_s, period), flight.requests()),
        resources: flight.resources(),
        link: flight.link_summary(),
        ..SummaryInputs::default()
    };
    Ok(Flown { summary: Summary::new(inputs, &totals, period), failure, safe_mode: None })
}
