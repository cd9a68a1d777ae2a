//! Tasks, states and decisions of a recorded mission as tables.

use std::path::Path;

use anyhow::Result;

use super::table::{Kind, Table, Value};
use crate::debrief::recorded::Recorded;

const TASKS: &[(&str, Kind)] = &[
    ("task", Kind::Int),
    ("start_tick", Kind::Int),
    ("end_tick", Kind::Int),
    ("start_s", Kind::Float),
    ("end_s", Kind::Float),
    ("strip", Kind::Int),
    ("name", Kind::Text),
    ("t_pre_s", Kind::Float),
    ("t_acq_s", Kind::Float),
    ("success", Kind::Bool),
    ("reason", Kind::Text),
    ("max_attitude_error", Kind::Float),
    ("min_elevation_deg", Kind::Float),
    ("reward", Kind::Float),
];

const STATES: &[(&str, Kind)] = &[
    ("tick", Kind::Int),
    ("time_s", Kind::Float),
    ("r_bn_n_x_m", Kind::Float),
    ("r_bn_n_y_m", Kind::Float),
    ("r_bn_n_z_m", Kind::Float),
    ("v_bn_n_x_m_s", Kind::Float),
    ("v_bn_n_y_m_s", Kind::Float),
    ("v_bn_n_z_m_s", Kind::Float),
    ("sigma_bn_1", Kind::Float),
    ("sigma_bn_2", Kind::Float),
    ("sigma_bn_3", Kind::Float),
    ("omega_bn_b_x_rad_s", Kind::Float),
    ("omega_bn_b_y_rad_s", Kind::Float),
    ("omega_bn_b_z_rad_s", Kind::Float),
    ("wheel_speed_x_rad_s", Kind::Float),
    ("wheel_speed_y_rad_s", Kind::Float),
    ("wheel_speed_z_rad_s", Kind::Float),
    ("wheel_torque_x_Nm", Kind::Float),
    ("wheel_torque_y_Nm", Kind::Float),
    ("wheel_torque_z_Nm", Kind::Float),
];

const DECISIONS: &[(&str, Kind)] = &[
    ("task", Kind::Int),
    ("tick", Kind::Int),
    ("time_s", Kind::Float),
    ("planner", Kind::Text),
    ("policy_hash", Kind::Text),
    ("candidates", Kind::Int),
    ("candidate_strips", Kind::Text),
    ("chosen_strip", Kind::Int),
    ("probability", Kind::Float),
    ("value", Kind::Float),
    ("t_pre_s", Kind::Float),
    ("compute_time_s", Kind::Float),
];

/// One row a task.
pub fn write_tasks(recorded: &Recorded, folder: &Path, formats: (bool, bool)) -> Result<()> {
    let period = recorded.model.period;
    let seconds = |ticks: u64| Value::Float(ticks as f64 * period.seconds());
    let mut table = Table::create(folder, "tasks", TASKS, formats)?;
    for (_, line) in &recorded.tasks {
        let reason = line.reason.map(|reason| format!("{reason:?}").to_lowercase());
        table.push(vec![
            line.task.into(),
            line.start_tick.into(),
            line.end_tick.into(),
            seconds(line.start_tick),
            seconds(line.end_tick),
            line.strip.into(),
            line.name.as_deref().into(),
            seconds(line.t_pre_ticks.into()),
            seconds(line.t_acq_ticks.into()),
            line.success.into(),
            reason.as_deref().into(),
            line.max_attitude_error.into(),
            line.min_elevation_deg.into(),
            line.reward.into(),
        ])?;
    }
    table.finish()
}

/// One row a control tick.
pub fn write_states(recorded: &Recorded, folder: &Path, formats: (bool, bool)) -> Result<()> {
    let period = recorded.model.period;
    let mut table = Table::create(folder, "states", STATES, formats)?;
    recorded.for_each_state(|state| {
        let (r, v, omega) = (&state.r_bn_n, &state.v_bn_n, &state.omega_bn_b);
        let numbers = [[r.x, r.y, r.z], [v.x, v.y, v.z], state.sigma_bn, [omega.x, omega.y, omega.z]];
        let wheels = [state.wheel_speed, state.wheel_torque];
        let time = [state.tick.into(), (state.tick as f64 * period.seconds()).into()];
        let numbers = numbers.as_flattened().iter().chain(wheels.as_flattened()).map(|number| (*number).into());
        table.push(time.into_iter().chain(numbers).collect())
    })?;
    table.finish()
}

/// One row a decision.
pub fn write_decisions(recorded: &Recorded, folder: &Path, formats: (bool, bool)) -> Result<()> {
    let period = recorded.model.period;
    let mut table = Table::create(folder, "decisions", DECISIONS, formats)?;
    for (task, decision) in &recorded.decisions {
        let chosen = decision.chosen as usize;
        let ids: Vec<String> = decision.candidate_ids.iter().map(u64::to_string).collect();
        let tick = recorded.offers.get(task).map(|offer| offer.tick);
        table.push(vec![
            (*task).into(),
            tick.into(),
            tick.map(|tick| tick as f64 * period.seconds()).into(),
            decision.planner.as_str().into(),
            Some(decision.policy_hash.as_str()).filter(|hash| !hash.is_empty()).into(),
            (ids.len() as u64).into(),
            ids.join(" ").as_str().into(),
            decision.candidate_ids.get(chosen).copied().into(),
            decision.probabilities.get(chosen).map(|p| f64::from(*p)).into(),
            f64::from(decision.value).into(),
            period.duration_s(decision.t_pre_ticks).into(),
            decision.compute_time_s.into(),
        ])?;
    }
    table.finish()
}
