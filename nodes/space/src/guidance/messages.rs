//! Guidance's messages.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use swath_msgs::swath_msgs as msg;
use swath_node::error::MessageError;
use swath_node::messages::activity::activity_message;
use swath_node::messages::numbers::vector3;
use swath_node::messages::spacecraft_state::spacecraft_state;
use swath_node::messages::strip::acquisition;
use swath_node::messages::task_result::{duty, kind_without_strip, task_record};
use swath_node::stamp::{BODY_FRAME, Stamper};
use swath_sim::task::{FailureReason, Task};
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use super::logic::{Command, DecisionPoint, FinishedTask, Kept, TaskOrder};

/// A task as guidance takes it.
///
/// # Errors
/// When its kind is unknown or its strip cannot be flown.
pub fn task_order(model: &Model, message: &msg::ImagingTask) -> Result<TaskOrder, MessageError> {
    let (kind, name) = match message.kind {
        msg::ImagingTask::KIND_IMAGE => {
            let strip = acquisition(model, &message.strip, message.t_acq_ticks)?;
            let (id, t_pre, t_acq) = (StripId(message.strip.id), message.t_pre_ticks, message.t_acq_ticks);
            (Task::Image { id, strip, t_pre, t_acq }, message.strip.name.clone())
        }
        msg::ImagingTask::KIND_WAIT => (Task::Wait { ticks: message.wait_ticks }, String::new()),
        value => {
            // Duties need resources.
            let resources = model.config.resources.as_ref();
            let duty = resources.and_then(|_| duty(value)).ok_or(MessageError::Constant { field: "kind", value })?;
            (Task::Serve { duty, ticks: message.wait_ticks }, String::new())
        }
    };
    Ok(TaskOrder { task: message.task, kind, name })
}

/// A torque command with the tracking error that it rests on.
#[must_use]
pub fn wheel_torque(stamper: &Stamper, command: &Command) -> msg::WheelTorque {
    let guidance = &command.guidance;
    msg::WheelTorque {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        torque: guidance.torque.into(),
        task: command.task,
        phase: phase(command),
        sigma_br: guidance.error.sigma_BR.into(),
        omega_br_b: vector3(&guidance.error.omega_BR_B),
        attitude_error: guidance.error.sigma_BR.norm(),
        elevation: guidance.elevation(),
        activity: command.activity.iter().map(activity_message).collect::<Vec<_>>(),
    }
}

/// What guidance is doing; `strip` is the number and name of the strip in hand.
#[must_use]
pub fn guidance_status(stamper: &Stamper, command: &Command, strip: Option<(u64, &str)>) -> msg::GuidanceStatus {
    let (strip_id, strip_name) = strip.unwrap_or_default();
    msg::GuidanceStatus {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        task: command.task,
        phase: phase(command),
        strip_id,
        strip_name: strip_name.to_owned(),
        attitude_error: command.guidance.error.sigma_BR.norm(),
        elevation: command.guidance.elevation(),
        remaining_ticks: command.remaining,
    }
}

/// A task is wanted.
#[must_use]
pub fn decision_point(stamper: &Stamper, point: &DecisionPoint) -> msg::DecisionPoint {
    let state = spacecraft_state(stamper, &point.state);
    msg::DecisionPoint {
        header: state.header.clone(),
        tick: point.state.tick.0,
        task: point.task,
        state,
        servo_integral: point.situation.servo_integral.into(),
        torque_pending: point.situation.torque_pending.into(),
        wheel_share: point.situation.wheels.into(),
        mission_over: point.mission_over,
        result: point.finished.as_ref().map(task_result).into_iter().collect::<Vec<_>>(),
        last_imaging: point.last_imaging.as_ref().map(task_result).into_iter().collect::<Vec<_>>(),
    }
}

/// How a task went.
#[must_use]
pub fn task_result(finished: &FinishedTask) -> msg::TaskResult {
    let record = &finished.record;
    msg::TaskResult {
        task: record.task,
        start_tick: record.start.0,
        end_tick: record.end.0,
        kind: record.strip.map_or(kind_without_strip(record.duty), |_| msg::ImagingTask::KIND_IMAGE),
        strip_id: record.strip.map_or(0, |id| id.0),
        strip_name: finished.name.clone(),
        t_pre_ticks: record.t_pre,
        t_acq_ticks: record.t_acq,
        success: record.success(),
        reason: match record.outcome.failure {
            None => msg::TaskResult::REASON_NONE,
            Some(FailureReason::Attitude) => msg::TaskResult::REASON_ATTITUDE,
            Some(FailureReason::Elevation) => msg::TaskResult::REASON_ELEVATION,
            Some(FailureReason::Interrupted) => msg::TaskResult::REASON_INTERRUPTED,
        },
        max_attitude_error: record.outcome.max_attitude_error,
        min_elevation: record.outcome.min_elevation,
        // Whoever keeps the requests settles it.
        reward: 0.0,
    }
}

/// What guidance keeps, as it lies in its file.
#[derive(Serialize, Deserialize)]
struct KeptTasks {
    task: u64,
    flying: Option<msg::TaskResult>,
    finished: Option<msg::TaskResult>,
    last_imaging: Option<msg::TaskResult>,
}

/// The text of what guidance keeps.
///
/// # Errors
/// When a number cannot be written.
pub fn kept_text(kept: &Kept) -> Result<String> {
    let of = |task: &Option<FinishedTask>| task.as_ref().map(task_result);
    let tasks = KeptTasks {
        task: kept.task,
        flying: of(&kept.flying),
        finished: of(&kept.finished),
        last_imaging: of(&kept.last_imaging),
    };
    Ok(serde_json::to_string(&tasks)?)
}

/// What guidance kept.
///
/// # Errors
/// When the text is not one of [`kept_text`].
pub fn kept(text: &str) -> Result<Kept> {
    let tasks: KeptTasks = serde_json::from_str(text).context("what guidance kept cannot be read")?;
    let of = |result: Option<msg::TaskResult>| {
        let task = |result: msg::TaskResult| {
            Ok::<_, MessageError>(FinishedTask { record: task_record(&result)?, name: result.strip_name })
        };
        result.map(task).transpose()
    };
    Ok(Kept {
        task: tasks.task,
        flying: of(tasks.flying)?,
        finished: of(tasks.finished)?,
        last_imaging: of(tasks.last_imaging)?,
    })
}

/// The task in hand enters a phase.
#[must_use]
pub fn task_phase(stamper: &Stamper, command: &Command, strip: u64) -> msg::TaskPhase {
    msg::TaskPhase {
        header: stamper.header(command.tick, BODY_FRAME),
        tick: command.tick.0,
        task: command.task,
        strip_id: strip,
        phase: phase(command),
    }
}

fn phase(command: &Command) -> u8 {
    match (command.has_strip, command.guidance.imaging) {
        (false, _) => msg::WheelTorque::PHASE_HOLD,
        (true, false) => msg::WheelTorque::PHASE_TRANSITION,
        (true, true) => msg::WheelTorque::PHASE_IMAGING,
    }
}
