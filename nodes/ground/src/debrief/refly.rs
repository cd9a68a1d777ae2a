//! `swath refly`: a recorded mission flown again in process, beside what was recorded.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
use swath_sim::planner::{Decision, DecisionContext, Planner, PlannerError, PlannerSpec};
use swath_sim::task::{FailureReason, SettledTask, Totals};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::recorded::{Recorded, RecordedArgs};
use swath_mission::approval::{Gate, GatedPlanner};
use swath_mission::fallback::{GuardedPlanner, Policies};
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::orders::action::{Act, Action};
use swath_mission::outcome::TaskLine;
use swath_node::out;

/// Arguments of `refly`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  swath refly bags/samples/mission
  swath refly bags/samples/mission --planner heuristic:90

Takes configuration, seed and requests with their arrival times from the bag. With the recording's own planner
the tasks of a mission that was flown in lockstep are the recorded ones byte by byte; the exit code is 1 when
they are not.")]
pub struct ReflyArgs {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// Planner instead of the recorded one
    #[arg(long)]
    planner: Option<PlannerSpec>,
    /// Write the tasks flown now, as `tasks.jsonl` of a launch
    #[arg(long, value_name = "FILE")]
    tasks: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Both flights side by side.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Name of the mission.
    pub mission: String,
    /// Its seed.
    pub seed: u64,
    /// Planner of the recording.
    pub recorded_planner: String,
    /// Planner of the flight in process.
    pub reflown_planner: String,
    /// Whether the tasks are the same, byte by byte.
    pub identical: bool,
    /// Whether the recording reaches the mission's end.
    pub complete: bool,
    /// Tasks that were flown while nothing was recorded: they are not compared.
    #[serde(skip_serializing_if = "is_zero")]
    pub not_recorded: usize,
    /// Number of the first task that differs.
    pub first_difference: Option<u64>,
    /// Totals of the recording.
    pub recorded: Totals,
    /// Totals of the flight in process.
    pub reflown: Totals,
    /// Strips that only one of the two imaged: recorded, re-flown.
    pub imaged_by_one: (usize, usize),
    /// Each decision of both.
    pub decisions: Vec<Pair>,
    #[serde(skip)]
    period_s: f64,
}

/// A decision of both flights; they are of the same number, and of the same time up to the first difference.
#[derive(Debug, Serialize)]
pub struct Pair {
    /// Number of the task.
    pub task: u64,
    /// Whether the tasks are the same, byte by byte.
    pub same: bool,
    /// Whether both chose among the same strips.
    pub same_candidates: bool,
    /// The task of the recording.
    pub recorded: Option<TaskLine>,
    /// The task flown in process.
    pub reflown: Option<TaskLine>,
}

/// A flight in process: each task, and the numbers of the strips that it was chosen from.
struct Flown {
    tasks: Vec<(SettledTask, TaskLine)>,
    candidates: BTreeMap<u64, Vec<u64>>,
}

impl ReflyArgs {
    /// Flies and prints.
    ///
    /// # Errors
    /// When the bag holds no mission from its beginning, or the planner fails.
    pub fn run(self, policies: &Policies) -> Result<ExitCode> {
        let recorded = self.recorded.open()?;
        let own = recorded.mission.planner.clone();
        let planner = self.planner.unwrap_or_else(|| own.clone());
        let flown = fly(&recorded, &planner, policies)?;
        if let Some(path) = &self.tasks {
            let lines: Result<String> = flown.tasks.iter().map(|(_, line)| Ok(json_line(line)? + "\n")).collect();
            fs::write(path, lines?).with_context(|| format!("cannot write {}", path.display()))?;
        }
        let comparison = compare(&recorded, &flown, &planner)?;
        match self.json {
            true => out::print_line(serde_json::to_string_pretty(&comparison)?)?,
            false => out::print(&comparison.text())?,
        };
        let as_it_should_be = comparison.identical || planner != own;
        Ok(if as_it_should_be { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

fn json_line(line: &TaskLine) -> Result<String> {
    Ok(serde_json::to_string(line)?)
}

/// Flies a recorded mission in process; what was asked for on the way comes at the ticks at which it came then.
fn fly(recorded: &Recorded, planner: &PlannerSpec, policies: &Policies) -> Result<Flown> {
    let (actions, operators) = recorded.actions()?;
    let gate = Gate::new(&recorded.mission.approval, recorded.model.period);
    let own = *planner == recorded.mission.planner;
    let planner = GuardedPlanner::new((policies.make)(planner, recorded.mission.seed)?);
    let planner = GatedPlanner { gate, planner };
    let mut planner = Watching { planner, operators: operators.into(), candidates: BTreeMap::new() };
    // Over DDS, what cannot be flown here has changed no task.
    let faults = recorded.mission.faults.clone().within_one_process();
    let mission = Mission { faults, ..recorded.mission.clone() };
    let mut flight = InProcessMission::with_actions(&mission, actions)?;
    let numbered: BTreeMap<u64, _> = recorded.tasks.iter().map(|(task, _)| (task.record.task, &task.record)).collect();
    let mut tasks = Vec::new();
    loop {
        // A task that was given up then is given up now, at the same tick.
        let then = numbered.get(&(tasks.len() as u64)).filter(|_| own);
        let given_up = then.filter(|then| then.outcome.failure == Some(FailureReason::Interrupted));
        match flight.step(&mut planner, given_up.map_or(Tick(u64::MAX), |then| then.end))? {
            Some(task) => tasks.push(task),
            None => return Ok(Flown { tasks, candidates: planner.candidates }),
        }
    }
}

/// A planner whose choices are noted, and to whom operators say what they said then.
struct Watching {
    planner: GatedPlanner,
    operators: VecDeque<Action>,
    /// By the number of the task; there are none where the planner was not asked.
    candidates: BTreeMap<u64, Vec<u64>>,
}

impl Planner for Watching {
    fn name(&self) -> String {
        self.planner.name()
    }

    fn forget(&mut self) {
        self.planner.forget();
    }

    fn minds_resources(&self) -> bool {
        self.planner.minds_resources()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let now = context.situation.now;
        while let Some(action) = self.operators.pop_front_if(|action| action.initial || action.at < now) {
            match action.act {
                Act::SetMode(mode) => self.planner.gate.set_mode(mode),
                // With another planner another proposal may be open, or none: then nobody decides.
                Act::Decide { proposal, approve } => _ = self.planner.gate.review(proposal, approve, &action.actor),
                _ => {}
            }
        }
        let candidates = context.candidates.iter().map(|candidate| candidate.id.0).collect();
        self.candidates.insert(context.task, candidates);
        self.planner.decide(context)
    }
}

fn compare(recorded: &Recorded, flown: &Flown, planner: &PlannerSpec) -> Result<Comparison> {
    let lines: BTreeMap<u64, &TaskLine> = recorded.tasks.iter().map(|(_, line)| (line.task, line)).collect();
    // A recording that was cut short is compared as far as it goes, and one with a gap around it.
    let last = lines.keys().next_back().map_or(0, |last| last + 1);
    let end = if recorded.complete { last.max(flown.tasks.len() as u64) } else { last };
    let is_compared = |task: u64| lines.contains_key(&task) || (last..end).contains(&task);
    let mut decisions = Vec::new();
    for task in (0..end).filter(|task| is_compared(*task)) {
        let then = lines.get(&task).map(|line| (*line).clone());
        let now = flown.tasks.get(task as usize).map(|(_, line)| line.clone());
        let bytes = |line: &Option<TaskLine>| line.as_ref().map(json_line).transpose();
        let offered = recorded.offers.get(&task);
        let offered = offered.map(|offer| offer.candidates.iter().map(|candidate| candidate.strip.id).collect());
        decisions.push(Pair {
            task,
            same: bytes(&then)? == bytes(&now)?,
            same_candidates: offered.as_ref() == flown.candidates.get(&task),
            recorded: then,
            reflown: now,
        });
    }
    let then: Vec<_> = recorded.tasks.iter().map(|(task, _)| task).collect();
    let now: Vec<_> = flown.tasks.iter().map(|(task, _)| task).filter(|it| is_compared(it.record.task)).collect();
    let (then_imaged, now_imaged) = (imaged(&then), imaged(&now));
    Ok(Comparison {
        mission: recorded.mission.name.clone(),
        seed: recorded.mission.seed,
        recorded_planner: recorded.mission.planner.to_string(),
        reflown_planner: planner.to_string(),
        identical: decisions.iter().all(|pair| pair.same),
        complete: recorded.complete,
        not_recorded: (0..last).filter(|task| !lines.contains_key(task)).count(),
        first_difference: decisions.iter().find(|pair| !pair.same).map(|pair| pair.task),
        recorded: totals(&then),
        reflown: totals(&now),
        imaged_by_one: (then_imaged.difference(&now_imaged).count(), now_imaged.difference(&then_imaged).count()),
        decisions,
        period_s: recorded.model.period.seconds(),
    })
}

fn totals(tasks: &[&SettledTask]) -> Totals {
    let mut totals = Totals::default();
    tasks.iter().for_each(|task| totals.add(task));
    totals
}

/// The strips that were imaged.
fn imaged(tasks: &[&SettledTask]) -> BTreeSet<StripId> {
    tasks.iter().map(|task| &task.record).filter(|it| it.success()).filter_map(|it| it.strip).collect()
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Comparison {
    /// The comparison for people.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = format!("mission {:?}, seed {}\n", self.mission, self.seed);
        if !self.complete {
            text += "the recording ends before the mission: compared as far as it goes\n";
        }
        if self.not_recorded > 0 {
            _ = writeln!(
                text,
                "{} tasks were flown while nothing was recorded: they are not compared",
                self.not_recorded
            );
        }
        self.write_totals(&mut text);
        match self.first_difference {
            None => _ = writeln!(text, "\nall {} tasks are the same, byte by byte", self.decisions.len()),
            Some(first) => {
                let same_candidates = self.decisions.iter().any(|pair| pair.task == first && pair.same_candidates);
                let among = if same_candidates { "among the same strips" } else { "among other strips" };
                _ = writeln!(text, "\nfirst difference: decision {first}, {among}");
            }
        }
        let (heading, rule) = (["task", "recorded", "re-flown"], "-".repeat(2 * CHOICE_WIDTH + 10));
        _ = writeln!(text, "\n{:>5}   {:<CHOICE_WIDTH$} {}\n{rule}", heading[0], heading[1], heading[2]);
        for pair in &self.decisions {
            let mark = if pair.same { ' ' } else { '*' };
            let (then, now) = (self.choice(pair.recorded.as_ref()), self.choice(pair.reflown.as_ref()));
            let now = if pair.same { "the same".to_owned() } else { now };
            _ = writeln!(text, "{:>5} {mark} {then:<CHOICE_WIDTH$} {now}", pair.task);
        }
        text
    }

    fn write_totals(&self, text: &mut String) {
        let seconds = |ticks: u64| format!("{:.0} s", ticks as f64 * self.period_s);
        let rate = |totals: &Totals| match totals.attempts {
            0 => "-".to_owned(),
            _ => format!("{:.1} %", 100.0 * totals.success_rate()),
        };
        let (then, now) = (&self.recorded, &self.reflown);
        for (name, then, now) in [
            ("", "recorded".to_owned(), "re-flown".to_owned()),
            ("planner", self.recorded_planner.clone(), self.reflown_planner.clone()),
            ("attempts", then.attempts.to_string(), now.attempts.to_string()),
            ("strips imaged", then.fulfilled.to_string(), now.fulfilled.to_string()),
            ("imaged only here", self.imaged_by_one.0.to_string(), self.imaged_by_one.1.to_string()),
            ("success rate", rate(then), rate(now)),
            ("reward", format!("{:.2}", then.reward), format!("{:.2}", now.reward)),
            ("slewing", seconds(then.t_pre_ticks), seconds(now.t_pre_ticks)),
            ("imaging", seconds(then.t_acq_ticks), seconds(now.t_acq_ticks)),
            ("waiting", seconds(then.wait_ticks), seconds(now.wait_ticks)),
        ] {
            _ = writeln!(text, "  {name:<18} {then:>14} {now:>14}");
        }
    }

    /// A task in a line.
    fn choice(&self, line: Option<&TaskLine>) -> String {
        let Some(line) = line else { return "-".to_owned() };
        let seconds = |ticks: f64| ticks * self.period_s;
        let start = seconds(line.start_tick as f64);
        let Some(strip) = line.strip else {
            return format!("{start:>8.1} s wait {:.1} s", seconds((line.end_tick - line.start_tick) as f64));
        };
        let name: String = line.name.as_deref().unwrap_or("").chars().take(18).collect();
        let outcome = match line.reason {
            None => format!("imaged, +{:.3}", line.reward),
            Some(reason) => format!("{reason:?}").to_lowercase(),
        };
        format!("{start:>8.1} s strip {strip} {name}, T_pre {:.1} s: {outcome}", seconds(line.t_pre_ticks.into()))
    }
}

/// Width of a task in the table [characters].
const CHOICE_WIDTH: usize = 68;
