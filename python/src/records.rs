//! Tasks as they were flown, as rows of a table.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use swath_sim::task::{FailureReason, TaskRecord};
use swath_sim::time::TickPeriod;
use swath_sim::vehicle::resources::ResourceState;

/// A task as a row of a table.
pub fn task_row<'py>(py: Python<'py>, record: &TaskRecord, period: TickPeriod) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("task", record.task)?;
    row.set_item("start_s", period.time_s(record.start))?;
    row.set_item("end_s", period.time_s(record.end))?;
    row.set_item("strip", record.strip.map(|it| it.0))?;
    row.set_item("t_pre_s", period.duration_s(record.t_pre))?;
    row.set_item("t_acq_s", period.duration_s(record.t_acq))?;
    row.set_item("success", record.success())?;
    row.set_item("failure", record.outcome.failure.map(failure_name))?;
    row.set_item("max_attitude_error", record.outcome.max_attitude_error)?;
    row.set_item("min_elevation_deg", record.outcome.min_elevation.to_degrees())?;
    Ok(row)
}

/// How power and data stand.
pub fn resource_row<'py>(py: Python<'py>, state: &ResourceState, period: TickPeriod) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("charge_wh", state.charge_j / 3600.0)?;
    row.set_item("capacity_wh", state.capacity_j / 3600.0)?;
    row.set_item("illumination", state.illumination)?;
    row.set_item("generated_w", state.generated_w)?;
    row.set_item("load_w", state.asked_w)?;
    row.set_item("stored_bits", state.stored_bits)?;
    row.set_item("to_send_bits", state.to_send_bits)?;
    row.set_item("storage_bits", state.storage_bits)?;
    row.set_item("in_contact", state.in_contact)?;
    row.set_item("contact_s", state.contact.map(|(rise, set)| (period.time_s(rise), period.time_s(set))))?;
    Ok(row)
}

fn failure_name(reason: FailureReason) -> &'static str {
    match reason {
        FailureReason::Attitude => "attitude",
        FailureReason::Elevation => "elevation",
        FailureReason::Interrupted => "interrupted",
    }
}

/// Number of a reason, as `swath.Failure` has it.
pub fn failure_number(reason: FailureReason) -> i64 {
    match reason {
        FailureReason::Attitude => 1,
        FailureReason::Elevation => 2,
        FailureReason::Interrupted => 3,
    }
}
