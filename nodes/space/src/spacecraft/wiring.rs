//! The spacecraft node's topics, pace and telemetry.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use anyhow::Result;
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs::{SpacecraftState, WheelTorque};
use swath_node::messages::activity::activity;
use swath_node::messages::spacecraft_state::spacecraft_state;
use swath_ros::{Publisher, RosError, Spec, Subscription, graph};
use swath_sim::time::Tick;

use super::logic::{Acting, SpacecraftLogic};
use super::orders::OrderDesk;
use super::telemetry::{self, Telemetry};
use crate::journal::Journal;
use swath_mission::alarms::conditions::back;
use swath_mission::faults::FaultPlan;
use swath_mission::faults::grammar::Process;
use swath_mission::file::PACED_PATIENCE;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::node::{MissionNode, Severity};
use swath_node::program::{PACE, Parameter, Program};
use swath_sim::vehicle::spacecraft::StateSample;

/// In lockstep, states without an answer for so long are sent again.
const RESEND_AFTER: Duration = Duration::from_millis(300);
/// The same where messages are dropped by order, and in a paced mission.
const RESEND_SOON_AFTER: Duration = Duration::from_millis(20);
/// How long the last messages may take to reach their readers.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(5);
/// How long the last state may take when the process is asked to end in flight.
const LAST_FLUSH: Duration = Duration::from_millis(300);
/// How long others are waited for before it is looked whether something else is to be done.
const LOOK_AGAIN: Duration = Duration::from_millis(500);
/// In a paced mission, how long a late command is waited for where ticks are shorter than that.
const COMMAND_PATIENCE: Duration = PACED_PATIENCE.saturating_mul(2);
/// States that may be without an answer: two ticks are under way at once.
const IN_FLIGHT: usize = 2;

const WAIT_FOR: Parameter =
    Parameter { name: "wait_for", about: "Nodes that must be there before time begins, by commas." };
const PEER_TIMEOUT: Parameter = Parameter { name: "peer_timeout_s", about: "How long to wait for them [s]." };

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::SPACECRAFT,
    name: "swath-spacecraft",
    about: "The satellite: orbit, attitude, wheels, and the mission's time",
    parameters: &[PACE, WAIT_FOR, PEER_TIMEOUT, telemetry::PERIOD],
};

/// Runs the spacecraft node until it is asked to end.
///
/// # Errors
/// When the node cannot come up, a peer is missing, or DDS fails.
pub fn run() -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    let settings = Settings::declare(&base)?;
    lifecycle::run(base, |base| SpacecraftNode::new(base, settings.clone()))
}

/// Its own parameters.
#[derive(Clone)]
struct Settings {
    pace: f64,
    peers: Vec<String>,
    peer_timeout: Duration,
}

impl Settings {
    fn declare(base: &MissionNode) -> Result<Self> {
        let parameters = base.node.parameters();
        let pace = Spec::new(PACE.name, base.mission.pace, PACE.about);
        let pace = parameters.declare(pace.in_range(0.0..=1e6).read_only())?;
        let peers = "guidance,request_manager,planner".to_owned();
        let peers = Spec::new(WAIT_FOR.name, peers, WAIT_FOR.about);
        let peers: String = parameters.declare(peers.read_only())?;
        let peers = peers.split(',').filter(|peer| !peer.is_empty()).map(str::to_owned).collect();
        let timeout = Spec::new(PEER_TIMEOUT.name, 20.0, PEER_TIMEOUT.about);
        let timeout = parameters.declare(timeout.in_range(0.1..=3600.0).read_only())?;
        Telemetry::declare(parameters)?;
        parameters.check_given()?;
        Ok(Self { pace, peers, peer_timeout: Duration::from_secs_f64(timeout) })
    }
}

/// What a spacecraft is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// Others must be there before time begins; since when it waits.
    Waits { since: Instant },
    /// Time passes.
    Flies,
    /// The last state is told.
    Lingers,
}

struct SpacecraftNode {
    logic: SpacecraftLogic,
    clock: Publisher<Clock>,
    states: Publisher<SpacecraftState>,
    /// Tells what the sensors do not, where they are not exact.
    truths: Publisher<SpacecraftState>,
    commands: Subscription<WheelTorque>,
    telemetry: Telemetry,
    orders: OrderDesk,
    resend_after: Duration,
    unanswered: VecDeque<StateSample>,
    /// There is one where somebody would start the spacecraft again.
    journal: Option<Commands>,
    stage: Stage,
    /// When a tick was flown, or a state sent again, last.
    progress: Instant,
    /// In a paced mission, when the next tick is due, and until when its command is waited for.
    due: Instant,
    latest: Instant,
    settings: Settings,
    base: MissionNode,
}

impl SpacecraftNode {
    fn new(mut base: MissionNode, settings: Settings) -> Result<Self> {
        let orders = OrderDesk::new(&mut base)?;
        let mut logic = SpacecraftLogic::new(base.mission.spacecraft(&base.model)?, base.horizon);
        logic.set_without_guidance(without_guidance(&base));
        let (journal, unanswered, logic) = take_up(&base, logic)?;
        Ok(Self {
            logic,
            journal,
            unanswered,
            clock: base.node.publisher(&graph::CLOCK)?,
            states: base.node.publisher(&graph::SPACECRAFT_STATE)?,
            truths: base.node.publisher(&graph::SPACECRAFT_TRUTH)?,
            commands: base.node.subscription(&graph::WHEEL_TORQUE)?,
            telemetry: Telemetry::new(&base)?,
            orders,
            resend_after: resend_after(&base),
            stage: Stage::Waits { since: Instant::now() },
            progress: Instant::now(),
            due: Instant::now(),
            latest: Instant::now(),
            settings,
            base,
        })
    }

    /// Begins when everybody is there, and says for whom it waits until then.
    fn wait_for_peers(&mut self, since: Instant) -> Result<()> {
        let Settings { peers, peer_timeout, .. } = &self.settings;
        let peers: Vec<&str> = peers.iter().map(String::as_str).collect();
        match self.base.node.wait_for_peers(&peers, LOOK_AGAIN.min(*peer_timeout)) {
            Ok(()) if self.base.shutdown.asked() => return Ok(()),
            Ok(()) => {}
            Err(RosError::MissingPeers { missing, .. }) if since.elapsed() < *peer_timeout => {
                self.base.tell_missing(missing);
                return self.base.tell_of_itself();
            }
            Err(RosError::MissingPeers { missing, .. }) => {
                return Err(RosError::MissingPeers { waited: *peer_timeout, missing }.into());
            }
            Err(error) => return Err(error.into()),
        }
        self.resend()?;
        let first = self.logic.sample();
        self.publish(&first)?;
        self.stage = Stage::Flies;
        self.set_out();
        Ok(())
    }

    /// Time begins to pass, or goes on.
    fn set_out(&mut self) {
        self.progress = Instant::now();
        self.due = self.progress + self.tick();
        self.latest = self.due.max(self.progress + COMMAND_PATIENCE);
    }

    /// How long a tick takes in a paced mission.
    fn tick(&self) -> Duration {
        let pace = self.settings.pace;
        if pace > 0.0 { Duration::from_secs_f64(self.base.model.period.seconds() / pace) } else { Duration::ZERO }
    }

    fn tell_missed(&self) -> Result<()> {
        if self.logic.missed > 0 {
            let text = format!("{} ticks were flown without a command", self.logic.missed);
            self.base.alarm(Severity::Warn, "late commands", &text)?;
        }
        Ok(())
    }

    /// The last state is the one that ends the mission: it must arrive.
    fn arrive(&mut self) -> Result<()> {
        self.tell_missed()?;
        let (states, clock) = (self.states.flush(FLUSH_TIMEOUT), self.clock.flush(FLUSH_TIMEOUT));
        if !(states && clock) {
            tracing::warn!("not every reader has the last state and time");
        }
        self.stage = Stage::Lingers;
        Ok(())
    }

    /// Time stands. Where messages are dropped by order, the last states are told again and again: nobody else can end the
    /// mission.
    fn linger(&mut self) -> Result<()> {
        let dropped = drops(&self.base);
        self.base.wait(if dropped { RESEND_SOON_AFTER } else { FLUSH_TIMEOUT })?;
        while self.commands.take()?.is_some() {}
        self.take_orders()?;
        if dropped && self.progress.elapsed() >= RESEND_SOON_AFTER {
            self.progress = Instant::now();
            self.resend()?;
        }
        Ok(())
    }

    /// As fast as the nodes can go: a tick is integrated when its command has come.
    fn fly_in_lockstep(&mut self) -> Result<()> {
        self.take_commands()?;
        self.take_orders()?;
        let before = self.logic.now();
        while self.logic.ready() && !self.logic.done() {
            self.advance()?;
        }
        if self.logic.now() > before {
            self.progress = Instant::now();
        } else if self.progress.elapsed() > self.resend_after {
            self.resend()?;
            self.progress = Instant::now();
        }
        if !self.logic.ready() {
            self.base.wait(self.resend_after)?;
        }
        Ok(())
    }

    /// At a multiple of real time: a tick is integrated when its time has come.
    ///
    /// Where ticks are shorter than a decision may take, a late command is waited for, and the time lost is made up.
    fn fly_paced(&mut self) -> Result<()> {
        self.take_commands()?;
        self.take_orders()?;
        let now = Instant::now();
        let wanted = if self.logic.ready() { self.due } else { self.latest };
        if now < wanted {
            if !self.logic.ready() && self.progress.elapsed() >= RESEND_SOON_AFTER {
                self.resend()?;
                self.progress = Instant::now();
            }
            let left = wanted - now;
            self.base.wait(if self.logic.ready() { left } else { left.min(RESEND_SOON_AFTER) })?;
            return Ok(());
        }
        self.due += self.tick();
        self.latest = self.due.max(now + COMMAND_PATIENCE);
        self.progress = now;
        self.advance()
    }

    fn advance(&mut self) -> Result<()> {
        if self.base.strikes_at().is_some_and(|at| self.logic.now() >= at) {
            self.base.strike();
        }
        let command = self.logic.next_command();
        if let Some(journal) = &mut self.journal {
            journal.add(&command)?;
        }
        let sample = self.logic.advance_by(&command);
        self.base.count("missed_ticks", self.logic.missed);
        self.publish(&sample)
    }

    fn take_commands(&mut self) -> Result<()> {
        while let Some(message) = self.commands.take()? {
            let activity = message.activity.first().map(activity).transpose().map_err(|error| error.to_string());
            let taken = activity.and_then(|activity| {
                let taken = self.logic.command(Tick(message.tick), message.torque.into(), activity.unwrap_or_default());
                taken.map_err(|error| error.to_string())
            });
            if let Err(error) = taken {
                self.base.alarm(Severity::Error, "command refused", &error)?;
            }
        }
        Ok(())
    }

    /// Takes the faults that are ordered; those of wheels and sensors befall it at their ticks.
    fn take_orders(&mut self) -> Result<()> {
        let before = self.base.mission.faults.plan.len();
        if !self.orders.take(&mut self.base, self.logic.now())? {
            return Ok(());
        }
        let new = self.base.mission.faults.plan.iter().skip(before).copied().collect();
        let new = FaultPlan { plan: new, random: 0 };
        self.logic.suffer(new.vehicle(self.base.model.period));
        self.logic.set_without_guidance(without_guidance(&self.base));
        self.resend_after = resend_after(&self.base);
        Ok(())
    }

    fn publish(&mut self, sample: &StateSample) -> Result<()> {
        self.base.set_now(sample.tick);
        self.clock.publish(&Clock { clock: self.base.stamper.time(sample.tick) })?;
        self.tell(sample)?;
        if self.unanswered.len() == IN_FLIGHT {
            self.unanswered.pop_front();
        }
        self.unanswered.push_back(*sample);
        self.telemetry.publish(&self.base, sample)
    }

    fn tell(&self, sample: &StateSample) -> Result<()> {
        if let Some(body) = sample.truth {
            self.truths.publish(&spacecraft_state(&self.base.stamper, &StateSample { body, ..*sample }))?;
        }
        Ok(self.states.publish(&spacecraft_state(&self.base.stamper, sample))?)
    }

    /// A first sample can be lost to a reader that is still being matched: without this, nothing would ever move.
    fn resend(&self) -> Result<()> {
        self.unanswered.iter().try_for_each(|sample| self.tell(sample))
    }
}

impl LifecycleNode for SpacecraftNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn activate(&mut self) -> Result<()> {
        self.set_out();
        Ok(())
    }

    fn turn(&mut self) -> Result<()> {
        match self.stage {
            Stage::Waits { since } => return self.wait_for_peers(since),
            Stage::Flies if self.settings.pace > 0.0 => self.fly_paced()?,
            Stage::Flies => self.fly_in_lockstep()?,
            Stage::Lingers => self.linger()?,
        }
        if self.stage == Stage::Flies && self.logic.done() {
            self.arrive()?;
        }
        Ok(())
    }

    /// The clock stands.
    fn rest(&mut self) -> Result<()> {
        self.take_commands()?;
        self.take_orders()?;
        self.base.wait(FLUSH_TIMEOUT)?;
        Ok(())
    }

    fn end(self) -> Result<MissionNode> {
        if self.stage == Stage::Flies {
            self.tell_missed()?;
            let _ = self.states.flush(LAST_FLUSH);
        }
        Ok(self.base)
    }
}

/// In lockstep, after how long without an answer states are sent again.
fn resend_after(base: &MissionNode) -> Duration {
    if drops(base) { RESEND_SOON_AFTER } else { RESEND_AFTER }
}

/// Whether messages are dropped by order.
fn drops(base: &MissionNode) -> bool {
    !base.mission.faults.drops(base.model.period).is_empty()
}

/// Between which states there is no guidance, by order.
fn without_guidance(base: &MissionNode) -> Vec<(Tick, Tick)> {
    let lost = base.mission.faults.of(Process::Guidance, base.model.period);
    lost.iter().map(|(it, _)| (it.from, back(it))).collect()
}

/// What was flown, kept so that a spacecraft that is started again goes on where the one before was: the
/// state follows from them.
type Commands = Journal<Acting>;
/// Their file.
const JOURNAL: &str = "spacecraft.commands";

/// A spacecraft where the one before was, if there was one, and the states that may be without an answer, but for the last.
fn take_up(
    base: &MissionNode,
    mut logic: SpacecraftLogic,
) -> Result<(Option<Commands>, VecDeque<StateSample>, SpacecraftLogic)> {
    let Some(path) = base.keeps(JOURNAL) else { return Ok((None, VecDeque::new(), logic)) };
    let (journal, flown) = Commands::open(&path, base.goes_on())?;
    let mut before = None;
    for command in &flown {
        before = Some(logic.sample());
        logic.advance_by(command);
    }
    if !flown.is_empty() {
        tracing::info!("the spacecraft goes on at {}", logic.now());
    }
    Ok((Some(journal), before.into_iter().collect(), logic))
}
