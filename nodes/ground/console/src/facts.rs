//! What the console tells: facts, one JSON record each, made from the messages of a mission.

use std::collections::BTreeMap;

use serde::Serialize;
use swath_msgs::diagnostic_msgs::DiagnosticStatus;
use swath_msgs::sensor_msgs::{JointState, NavSatFix};
use swath_msgs::swath_msgs as msg;
use swath_sim::config::RAD_S_PER_RPM;

use crate::telemetry::{Link, Plan, Resources};
use crate::ticks::milliseconds;

/// A fact. Times are ms since 1970-01-01 UTC of simulated time, 0 for none; ticks count from the mission's epoch;
/// places are longitude and latitude [deg].
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Fact {
    /// What a tick is.
    Clock {
        /// Time of tick 0.
        epoch_ms: f64,
        /// Length of a tick [ms].
        tick_ms: f64,
    },
    /// A request, as it was made.
    Strip {
        /// Its number.
        id: u64,
        /// Name for people.
        name: String,
        /// Who submitted it.
        submitter: String,
        /// The submitter's own reference.
        client_ref: String,
        /// Where it starts.
        start: [f64; 2],
        /// Where it ends.
        end: [f64; 2],
        /// Reward for imaging it.
        priority: f64,
        /// Acquisition speed [m/s].
        speed_m_s: f64,
        /// The same strip scanned the other way, 0 if there is none.
        linked_to: u64,
        /// The request that it replaces, 0 if there is none.
        supersedes: u64,
    },
    /// A request enters a state, or more is known of it in its state.
    Change {
        /// Its number.
        strip: u64,
        /// A STATE constant of `StripStatus`.
        state: u8,
        /// A REASON constant of `StripStatus`.
        reason_code: u16,
        /// The reason in words.
        reason: String,
        /// Who made the change.
        actor: String,
        /// Attempts so far.
        attempts: u32,
        /// Reward earned.
        reward: f64,
        /// Opening of the next start window.
        open_ms: f64,
        /// Its close.
        close_ms: f64,
        /// When imaging starts or started last.
        imaging_ms: f64,
        /// The request that replaces it, 0 if there is none.
        superseded_by: u64,
    },
    /// A request that got no number.
    Refused {
        /// Name for people.
        name: String,
        /// Who submitted it.
        submitter: String,
        /// A REASON constant of `StripStatus`.
        reason_code: u16,
        /// The reason in words.
        reason: String,
    },
    /// The point below the satellite.
    Point {
        /// Longitude [deg].
        lon: f64,
        /// Latitude [deg].
        lat: f64,
        /// Altitude [m].
        altitude_m: f64,
    },
    /// What guidance is doing.
    Status {
        /// The task in hand.
        task: u64,
        /// A PHASE constant of `WheelTorque`.
        phase: u8,
        /// The strip in hand, 0 if none.
        strip: u64,
        /// Norm of sigma_br.
        error: f64,
        /// Elevation of the satellite seen from the target [deg].
        elevation_deg: f64,
        /// Ticks that remain in the phase.
        remaining: u32,
    },
    /// The wheels.
    Wheels {
        /// Their speeds [rpm].
        rpm: Vec<f64>,
        /// Their torques [N m].
        torque_nm: Vec<f64>,
    },
    /// A task that was chosen.
    Task {
        /// Its number.
        task: u64,
        /// Tick at which it starts.
        start: u64,
        /// The strip, 0 for a wait.
        strip: u64,
        /// Transition [ticks].
        t_pre: u32,
        /// Acquisition [ticks].
        t_acq: u32,
        /// Length of a wait [ticks].
        wait: u32,
    },
    /// How a task went.
    Result {
        /// Its number.
        task: u64,
        /// Tick at which it started.
        start: u64,
        /// Tick at which it ended.
        end: u64,
        /// The strip, 0 for a wait.
        strip: u64,
        /// The strip's name.
        name: String,
        /// Transition [ticks].
        t_pre: u32,
        /// Whether the strip was imaged.
        success: bool,
        /// A REASON constant of `TaskResult`.
        reason: u8,
        /// Greatest norm of sigma_br while imaging.
        max_error: f64,
        /// Least elevation while imaging [deg].
        min_elevation_deg: f64,
        /// Reward earned.
        reward: f64,
    },
    /// What the planner may choose among.
    Offer {
        /// The task that is wanted.
        task: u64,
        /// The strips, by the close of their windows.
        candidates: Vec<Candidate>,
        /// Strips that wait.
        pending: u64,
        /// Strips that are fulfilled.
        fulfilled: u64,
    },
    /// How the planner chose.
    Choice {
        /// The task.
        task: u64,
        /// Name of the planner.
        planner: String,
        /// Numbers of the strips it chose among.
        candidates: Vec<u64>,
        /// Their probabilities, if the planner has any.
        probabilities: Vec<f32>,
        /// Expected return as the critic sees it.
        value: f32,
        /// Index of the chosen one; as long as the list for a wait.
        chosen: u32,
        /// Transition chosen [ticks].
        t_pre: u32,
        /// Wall-clock time that choosing took [s].
        compute_s: f64,
    },
    /// What the planner may do, and what it proposes.
    Planner {
        /// `autonomous`, `approve` or `hold`.
        mode: &'static str,
        /// Name of the planner.
        planner: String,
        /// `none`, `open` or `approved`.
        proposal_state: &'static str,
        /// Number of the proposal, 0 if there is none.
        proposal: u64,
        /// The strip proposed.
        strip: u64,
        /// Its name.
        name: String,
        /// Transition [ticks].
        t_pre: u32,
        /// Last tick at which imaging may start.
        close: u64,
        /// Tick after which it is decided without an operator, 0 for never.
        deadline: u64,
        /// What became of the proposal before.
        last_outcome: String,
    },
    /// How many requests are in which state.
    Summary {
        /// Counts, in the order of the states' numbers.
        counts: [u64; 13],
        /// Reward earned so far.
        reward: f64,
    },
    /// An alarm was raised; the same number again is the same alarm once more.
    Alarm {
        /// Its number, from 1.
        alarm: u64,
        /// Who raised it, and its name.
        name: String,
        /// 1 warning, 2 error, 3 critical.
        level: u8,
        /// What it says.
        text: String,
    },
    /// What was wrong is no more.
    Returned {
        /// Number of the alarm.
        alarm: u64,
    },
    /// An operator has seen an alarm.
    Acknowledged {
        /// Its number.
        alarm: u64,
        /// Who.
        actor: String,
    },
    /// An operator has put an alarm aside for a while.
    Shelved {
        /// Its number.
        alarm: u64,
        /// Until then it does not count.
        until_ms: f64,
        /// Who.
        actor: String,
        /// Why.
        reason: String,
    },
    /// Which nodes of the mission are there.
    Nodes {
        /// Those that are.
        present: Vec<String>,
        /// Those that are not.
        missing: Vec<String>,
        /// How often each was started anew; not those that never were.
        restarts: BTreeMap<String, u64>,
    },
    /// The radio, as the ground knows it; in missions with `[link]`.
    Link(Link),
    /// What the satellite is going to do, as the ground predicts it; in missions with `[link]`.
    Plan(Plan),
    /// Power, data and momentum as the simulator has them, of which the ground knows only what comes down; in missions
    /// with `[resources]`.
    Resources(Resources),
}

/// A strip that may be imaged next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Its number.
    pub strip: u64,
    /// First tick at which imaging may start.
    pub open: u64,
    /// Last tick at which imaging may start.
    pub close: u64,
    /// Acquisition [ticks].
    pub t_acq: u32,
}

/// A request as it was made.
#[must_use]
pub fn strip(status: &msg::StripStatus) -> Fact {
    let strip = &status.strip;
    Fact::Strip {
        id: strip.id,
        name: strip.name.clone(),
        submitter: status.submitter.clone(),
        client_ref: status.client_ref.clone(),
        start: [strip.start_longitude_deg, strip.start_latitude_deg],
        end: [strip.end_longitude_deg, strip.end_latitude_deg],
        priority: strip.priority,
        speed_m_s: strip.acquisition_speed,
        linked_to: status.linked_to,
        supersedes: status.supersedes,
    }
}

/// How a request stands.
#[must_use]
pub fn change(status: &msg::StripStatus) -> Fact {
    Fact::Change {
        strip: status.strip.id,
        state: status.state,
        reason_code: status.reason_code,
        reason: status.reason.clone(),
        actor: status.actor.clone(),
        attempts: status.attempts,
        reward: status.reward,
        open_ms: milliseconds(&status.window_open),
        close_ms: milliseconds(&status.window_close),
        imaging_ms: milliseconds(&status.imaging),
        superseded_by: status.superseded_by,
    }
}

/// A request that got no number.
#[must_use]
pub fn refused(status: &msg::StripStatus) -> Fact {
    Fact::Refused {
        name: status.strip.name.clone(),
        submitter: status.submitter.clone(),
        reason_code: status.reason_code,
        reason: status.reason.clone(),
    }
}

/// The point below the satellite.
#[must_use]
pub fn point(fix: &NavSatFix) -> Fact {
    Fact::Point { lon: fix.longitude, lat: fix.latitude, altitude_m: fix.altitude }
}

/// What guidance is doing.
#[must_use]
pub fn status(status: &msg::GuidanceStatus) -> Fact {
    Fact::Status {
        task: status.task,
        phase: status.phase,
        strip: status.strip_id,
        error: status.attitude_error,
        elevation_deg: status.elevation.to_degrees(),
        remaining: status.remaining_ticks,
    }
}

/// The wheels.
#[must_use]
pub fn wheels(joints: &JointState) -> Fact {
    let rpm = joints.velocity.iter().map(|rad_s| rad_s / RAD_S_PER_RPM).collect();
    Fact::Wheels { rpm, torque_nm: joints.effort.clone() }
}

/// A task that was chosen.
#[must_use]
pub fn task(task: &msg::ImagingTask) -> Fact {
    let images = task.kind == msg::ImagingTask::KIND_IMAGE;
    Fact::Task {
        task: task.task,
        start: task.start_tick,
        strip: if images { task.strip.id } else { 0 },
        t_pre: if images { task.t_pre_ticks } else { 0 },
        t_acq: if images { task.t_acq_ticks } else { 0 },
        wait: if images { 0 } else { task.wait_ticks },
    }
}

/// How a task went.
#[must_use]
pub fn result(result: &msg::TaskResult) -> Fact {
    Fact::Result {
        task: result.task,
        start: result.start_tick,
        end: result.end_tick,
        strip: result.strip_id,
        name: result.strip_name.clone(),
        t_pre: result.t_pre_ticks,
        success: result.success,
        reason: result.reason,
        max_error: result.max_attitude_error,
        min_elevation_deg: result.min_elevation.to_degrees(),
        reward: result.reward,
    }
}

/// What the planner may choose among.
#[must_use]
pub fn offer(offer: &msg::UpcomingStrips) -> Fact {
    let candidate = |it: &msg::Candidate| Candidate {
        strip: it.strip.id,
        open: it.window_open_tick,
        close: it.window_close_tick,
        t_acq: it.t_acq_ticks,
    };
    Fact::Offer {
        task: offer.task,
        candidates: offer.candidates.iter().map(candidate).collect(),
        pending: offer.pending,
        fulfilled: offer.fulfilled,
    }
}

/// How the planner chose.
#[must_use]
pub fn choice(decision: &msg::Decision) -> Fact {
    Fact::Choice {
        task: decision.task,
        planner: decision.planner.clone(),
        candidates: decision.candidate_ids.clone(),
        probabilities: decision.probabilities.clone(),
        value: decision.value,
        chosen: decision.chosen,
        t_pre: decision.t_pre_ticks,
        compute_s: decision.compute_time_s,
    }
}

/// What the planner may do, and what it proposes.
#[must_use]
pub fn planner(status: &msg::PlannerStatus) -> Fact {
    Fact::Planner {
        mode: match status.mode {
            msg::PlannerStatus::MODE_APPROVE => "approve",
            msg::PlannerStatus::MODE_HOLD => "hold",
            _ => "autonomous",
        },
        planner: status.planner.clone(),
        proposal_state: match status.proposal_state {
            msg::PlannerStatus::PROPOSAL_OPEN => "open",
            msg::PlannerStatus::PROPOSAL_APPROVED => "approved",
            _ => "none",
        },
        proposal: status.proposal,
        strip: status.strip.id,
        name: status.strip.name.clone(),
        t_pre: status.t_pre_ticks,
        close: status.window_close_tick,
        deadline: status.deadline_tick,
        last_outcome: status.last_outcome.clone(),
    }
}

/// How many requests are in which state.
#[must_use]
pub fn summary(it: &msg::RequestSummary) -> Fact {
    let counts = [
        it.received,
        it.rejected,
        it.held,
        it.accepted,
        it.scheduled,
        it.executing,
        it.completed,
        it.cancelled_by_user,
        it.cancelled_by_system,
        it.expired,
        it.failed,
        it.superseded,
        it.fulfilled_by_link,
    ];
    Fact::Summary { counts, reward: it.reward }
}

/// An operator has seen an alarm.
#[must_use]
pub fn acknowledged(alarm: u64, actor: &str) -> Fact {
    Fact::Acknowledged { alarm, actor: actor.to_owned() }
}

/// An alarm.
#[must_use]
pub fn alarm(number: u64, status: &DiagnosticStatus) -> Fact {
    Fact::Alarm { alarm: number, name: status.name.clone(), level: status.level, text: status.message.clone() }
}
