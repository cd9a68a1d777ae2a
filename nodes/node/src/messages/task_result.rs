//! How a task went, from its message.

use swath_msgs::swath_msgs as msg;
use swath_sim::task::{Duty, FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::numbers::checked;
use crate::error::MessageError;

/// Largest number in a task's result.
const RESULT_MAX: f64 = 1e3;

/// What a task of a kind does for the satellite itself; `None` for an image or a wait.
#[must_use]
pub fn duty(kind: u8) -> Option<Duty> {
    match kind {
        msg::ImagingTask::KIND_CHARGE => Some(Duty::Charge),
        msg::ImagingTask::KIND_DOWNLINK => Some(Duty::Downlink),
        msg::ImagingTask::KIND_DESATURATE => Some(Duty::Desaturate),
        _ => None,
    }
}

/// The kind of a task that images nothing.
#[must_use]
pub fn kind_without_strip(duty: Option<Duty>) -> u8 {
    match duty {
        None => msg::ImagingTask::KIND_WAIT,
        Some(Duty::Charge) => msg::ImagingTask::KIND_CHARGE,
        Some(Duty::Downlink) => msg::ImagingTask::KIND_DOWNLINK,
        Some(Duty::Desaturate) => msg::ImagingTask::KIND_DESATURATE,
    }
}

/// The task that just ended.
///
/// # Errors
/// When a constant is unknown.
pub fn task_record(result: &msg::TaskResult) -> Result<TaskRecord, MessageError> {
    let failure = match result.reason {
        msg::TaskResult::REASON_NONE => None,
        msg::TaskResult::REASON_ATTITUDE => Some(FailureReason::Attitude),
        msg::TaskResult::REASON_ELEVATION => Some(FailureReason::Elevation),
        msg::TaskResult::REASON_INTERRUPTED => Some(FailureReason::Interrupted),
        value => return Err(MessageError::Constant { field: "reason", value }),
    };
    checked("task result", [result.max_attitude_error, result.min_elevation, 0.0], RESULT_MAX)?;
    Ok(TaskRecord {
        task: result.task,
        start: Tick(result.start_tick),
        end: Tick(result.end_tick),
        strip: (result.kind == msg::ImagingTask::KIND_IMAGE).then_some(StripId(result.strip_id)),
        duty: duty(result.kind),
        t_pre: result.t_pre_ticks,
        t_acq: result.t_acq_ticks,
        outcome: TaskOutcome {
            failure,
            max_attitude_error: result.max_attitude_error,
            min_elevation: result.min_elevation,
        },
    })
}
