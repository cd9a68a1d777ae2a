//! The satellite's way over the ground, read from a bag.

use anyhow::Result;
use nalgebra::{UnitQuaternion, Vector3};
use swath_msgs::swath_msgs as msg;
use swath_node::messages::spacecraft_state::state_sample;

use crate::debrief::places::{Place, attitude_E, position_E, sub_satellite, velocity_E};
use crate::debrief::recorded::Recorded;

/// The satellite's way over the ground.
pub struct Track {
    /// Points in order of time.
    pub points: Vec<TrackPoint>,
}

/// A point of the satellite's way.
pub struct TrackPoint {
    /// Time since the mission's epoch [s].
    pub time_s: f64,
    /// The point below the satellite.
    pub place: Place,
    /// The satellite in the planet-fixed frame [m].
    pub r_E: Vector3<f64>,
    /// The satellite's velocity as that frame sees it [m/s].
    pub v_E: Vector3<f64>,
    /// The rotation that takes body components to planet-fixed ones; neighbours have like signs.
    pub attitude_E: UnitQuaternion<f64>,
}

impl Track {
    /// A point every `step_s` of simulated time, and the last one.
    ///
    /// # Errors
    /// When the bag has no states or they cannot be read.
    pub fn read(recorded: &Recorded, step_s: f64) -> Result<Self> {
        let period = recorded.model.period;
        let every = u64::from(period.ticks_ceil(step_s).max(1));
        let mut earth = recorded.model.earth.clone();
        let rotation_rad_s = recorded.model.config.earth.rotation_rad_s;
        let mut points: Vec<TrackPoint> = Vec::new();
        let mut last = None;
        let mut add = |state: &msg::SpacecraftState| -> Result<()> {
            let sample = state_sample(state)?;
            let mut attitude = attitude_E(&mut earth, &sample);
            // A quaternion and its negative are one attitude; interpolation wants the nearer one.
            if points.last().is_some_and(|before| before.attitude_E.dot(&attitude) < 0.0) {
                attitude = UnitQuaternion::new_unchecked(-attitude.into_inner());
            }
            points.push(TrackPoint {
                time_s: period.time_s(sample.tick),
                place: sub_satellite(&mut earth, &sample),
                r_E: position_E(&mut earth, &sample),
                v_E: velocity_E(&mut earth, rotation_rad_s, &sample),
                attitude_E: attitude,
            });
            Ok(())
        };
        recorded.for_each_state(|state| {
            if state.tick.is_multiple_of(every) {
                add(&state)?;
            }
            last = Some(state);
            Ok(())
        })?;
        if let Some(last) = last.filter(|last: &msg::SpacecraftState| !last.tick.is_multiple_of(every)) {
            add(&last)?;
        }
        Ok(Self { points })
    }
}
