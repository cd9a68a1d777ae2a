//! What a report tells: a recorded mission in numbers that can be plotted.

use anyhow::Result;
use swath_mission::outcome::OrderOutcome;
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;
use swath_sim::config::RAD_S_PER_RPM;

use super::radio::RadioStory;
use crate::debrief::export::track::Track;
use crate::debrief::places::{Place, strip_places};
use crate::debrief::recorded::Recorded;
use crate::requests::json::state_name;
use crate::requests::orders::Orders;

/// Time between points of the ground track [s].
const TRACK_STEP_S: f64 = 10.0;
/// Points of a line; of more, the least and greatest of each portion are kept.
const POINTS: usize = 2400;

/// A value over time [s].
pub type Points = Vec<(f64, f64)>;

/// A mission to tell of.
pub struct Story {
    /// Length of an orbit [s].
    pub orbit_s: f64,
    /// Time of the last state [s].
    pub end_s: f64,
    /// Largest ‖σ_BR‖ while imaging.
    pub sigma_max: f64,
    /// Largest speed of a wheel [rpm].
    pub wheel_speed_max_rpm: f64,
    /// Largest torque of a wheel [N m].
    pub wheel_torque_max_Nm: f64,
    /// The tasks, in order.
    pub tasks: Vec<Task>,
    /// Every strip that was accepted.
    pub strips: Vec<Strip>,
    /// Lines and areas that became several strips.
    pub orders: Vec<OrderOutcome>,
    /// The points below the satellite.
    pub track: Vec<Place>,
    /// ‖σ_BR‖.
    pub attitude_error: Points,
    /// Wheel speeds [rpm].
    pub wheel_speed: [Points; 3],
    /// Wheel torques [N m].
    pub wheel_torque: [Points; 3],
    /// Strip requests in each state that occurs.
    pub requests: Vec<(&'static str, Points)>,
    /// The radio between ground and satellite, if there is one.
    pub radio: RadioStory,
    /// Power, data and momentum, if the mission has them.
    pub resources: Option<Resources>,
}

/// Power, data and momentum over time.
pub struct Resources {
    /// Charge of the battery, as a share of its capacity [%].
    pub charge: Points,
    /// Storage in use, as a share of all [%].
    pub storage: Points,
    /// Momentum of the wheel that has most, as a share of its limit [%].
    pub momentum: Points,
    /// Share of the Sun's disc that is seen [%].
    pub illumination: Points,
}

/// A task.
pub struct Task {
    /// When it began [s].
    pub start_s: f64,
    /// When it ended [s].
    pub end_s: f64,
    /// Its transition [s].
    pub t_pre_s: f64,
    /// The strip's number and name; absent for a wait.
    pub strip: Option<(u64, String)>,
    /// Whether the strip was imaged.
    pub success: bool,
    /// Why not.
    pub reason: Option<String>,
    /// Largest ‖σ_BR‖ while imaging.
    pub max_attitude_error: f64,
    /// Least elevation while imaging [deg].
    pub min_elevation_deg: f64,
    /// Reward earned.
    pub reward: f64,
}

/// A strip.
pub struct Strip {
    /// Points along it.
    pub places: Vec<Place>,
    /// Whether it was imaged, itself or by its twin.
    pub imaged: bool,
    /// How often it was tried.
    pub attempts: u32,
}

impl Story {
    /// Gathers what there is to tell.
    ///
    /// # Errors
    /// When the bag cannot be read.
    pub fn of(recorded: &Recorded) -> Result<Self> {
        let period = recorded.model.period;
        let config = &recorded.model.config;
        let (mut wheel_speed, mut wheel_torque) = (<[Points; 3]>::default(), <[Points; 3]>::default());
        let mut end_s: f64 = 0.0;
        recorded.for_each_state(|state| {
            end_s = state.tick as f64 * period.seconds();
            for axis in 0..3 {
                wheel_speed[axis].push((end_s, state.wheel_speed[axis] / RAD_S_PER_RPM));
                wheel_torque[axis].push((end_s, state.wheel_torque[axis]));
            }
            Ok(())
        })?;
        let mut attitude_error = Points::new();
        recorded.for_each(&graph::WHEEL_TORQUE, |torque| {
            if torque.phase != msg::WheelTorque::PHASE_HOLD {
                attitude_error.push((torque.tick as f64 * period.seconds(), torque.attitude_error));
            }
            Ok(())
        })?;
        let track = Track::read(recorded, TRACK_STEP_S)?;
        Ok(Self {
            orbit_s: recorded.model.orbit_period_s(),
            end_s: end_s.max(period.seconds()),
            sigma_max: config.imaging.sigma_max,
            wheel_speed_max_rpm: config.spacecraft.wheel_speed_max_rpm,
            wheel_torque_max_Nm: config.spacecraft.wheel_torque_max_nm,
            tasks: tasks(recorded),
            strips: strips(recorded),
            orders: Orders::of(recorded.last_events().into_values().cloned()).outcomes(),
            track: track.points.iter().map(|point| point.place).collect(),
            attitude_error: thinned(&attitude_error),
            wheel_speed: wheel_speed.map(|points| thinned(&points)),
            wheel_torque: wheel_torque.map(|points| thinned(&points)),
            requests: requests(recorded)?,
            radio: RadioStory::of(recorded)?,
            resources: resources(recorded)?,
        })
    }
}

fn tasks(recorded: &Recorded) -> Vec<Task> {
    let seconds = |ticks: u64| ticks as f64 * recorded.model.period.seconds();
    let task = |line: &swath_mission::outcome::TaskLine| Task {
        start_s: seconds(line.start_tick),
        end_s: seconds(line.end_tick),
        t_pre_s: seconds(line.t_pre_ticks.into()),
        strip: line.strip.map(|id| (id, line.name.clone().unwrap_or_default())),
        success: line.success,
        reason: line.reason.map(|reason| format!("{reason:?}").to_lowercase()),
        max_attitude_error: line.max_attitude_error,
        min_elevation_deg: line.min_elevation_deg,
        reward: line.reward,
    };
    recorded.tasks.iter().map(|(_, line)| task(line)).collect()
}

fn strips(recorded: &Recorded) -> Vec<Strip> {
    let imaged = [msg::StripStatus::STATE_COMPLETED, msg::StripStatus::STATE_FULFILLED_BY_LINK];
    let strip = |event: &&msg::StripStatus| Strip {
        places: strip_places(&recorded.model, &event.strip),
        imaged: imaged.contains(&event.state),
        attempts: event.attempts,
    };
    recorded.last_events().values().map(strip).collect()
}

fn requests(recorded: &Recorded) -> Result<Vec<(&'static str, Points)>> {
    let states = 0..=msg::StripStatus::STATE_FULFILLED_BY_LINK;
    let mut series: Vec<(&'static str, Points)> = states.map(|state| (state_name(state), Points::new())).collect();
    recorded.for_each(&graph::REQUEST_SUMMARY, |summary| {
        let time_s = summary.tick as f64 * recorded.model.period.seconds();
        // In the order of the states' numbers.
        let counts = [
            summary.received,
            summary.rejected,
            summary.held,
            summary.accepted,
            summary.scheduled,
            summary.executing,
            summary.completed,
            summary.cancelled_by_user,
            summary.cancelled_by_system,
            summary.expired,
            summary.failed,
            summary.superseded,
            summary.fulfilled_by_link,
        ];
        for ((_, points), count) in series.iter_mut().zip(counts) {
            points.push((time_s, count as f64));
        }
        Ok(())
    })?;
    series.retain(|(_, points)| points.iter().any(|(_, count)| *count > 0.0));
    Ok(series)
}

/// How power, data and momentum stood.
fn resources(recorded: &Recorded) -> Result<Option<Resources>> {
    let Some(config) = &recorded.model.config.resources else { return Ok(None) };
    if !recorded.has(&graph::RESOURCES) {
        return Ok(None);
    }
    let mut told = <[Points; 4]>::default();
    recorded.for_each(&graph::RESOURCES, |state| {
        let time_s = state.tick as f64 * recorded.model.period.seconds();
        let shares = [
            state.charge / state.capacity,
            state.stored_bits as f64 / state.storage_bits.max(1) as f64,
            state.wheel_momentum / config.wheel_momentum_max_nms,
            state.illumination,
        ];
        told.iter_mut().zip(shares).for_each(|(points, share)| points.push((time_s, 100.0 * share)));
        Ok(())
    })?;
    let [charge, storage, momentum, illumination] = told.map(|points| thinned(&points));
    Ok(Some(Resources { charge, storage, momentum, illumination }))
}

/// The same line in few points: of each portion the least and the greatest, so that no peak is lost.
fn thinned(points: &[(f64, f64)]) -> Points {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let portion = points.len().div_ceil(POINTS / 2);
    let mut kept = Points::new();
    for portion in points.chunks(portion) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (least, greatest) = (portion.iter().min_by(by_value), portion.iter().max_by(by_value));
        let mut pair: Points = least.into_iter().chain(greatest).copied().collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        kept.extend(pair);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_peaks_and_order() {
        let mut points: Points = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        (points[12_345].1, points[12_346].1) = (9.0, -9.0);
        let kept = thinned(&points);
        assert!(kept.len() <= POINTS);
        assert!(kept.is_sorted_by(|a, b| a.0 <= b.0));
        assert!(kept.contains(&(12_345.0, 9.0)) && kept.contains(&(12_346.0, -9.0)));
    }
}
