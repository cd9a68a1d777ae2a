//! The spacecraft node without ROS: it integrates what it is told, one tick after the other.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::TimedFault;
use swath_sim::vehicle::resources::Activity;
use swath_sim::vehicle::spacecraft::{Spacecraft, StateSample};
use thiserror::Error;

/// Why a torque command is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CommandError {
    /// A torque that is NaN or infinite.
    #[error("torque command of {tick} has a component that is not finite: {torque:?} N m")]
    NotFinite {
        /// Tick it was computed from.
        tick: Tick,
        /// The command [N m].
        torque: [f64; 3],
    },
    /// A command from a state that was not sent yet.
    #[error("torque command is of {tick}, the state sent last is of {now}")]
    FromTheFuture {
        /// Tick it was computed from.
        tick: Tick,
        /// Tick of the latest state.
        now: Tick,
    },
}

/// What acts over a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Acting {
    /// Torque commanded from the state before the last one [N m].
    pub torque: Vector3<f64>,
    /// What is done besides turning, commanded from the last state, where resources have bounds.
    pub activity: Option<Activity>,
}

/// The spacecraft and the commands that it has not used yet.
#[derive(Clone, Debug)]
pub struct SpacecraftLogic {
    spacecraft: Spacecraft,
    horizon: Tick,
    commands: BTreeMap<Tick, (Vector3<f64>, Activity)>,
    /// What was done over the last tick; it goes on where no command has come.
    activity: Activity,
    /// From which state on there is no guidance by order, and from which on there is one again.
    without: Vec<(Tick, Tick)>,
    /// Ticks flown without a command because none had come in time.
    pub missed: u64,
}

impl SpacecraftLogic {
    /// A spacecraft that stops at `horizon`.
    #[must_use]
    pub fn new(spacecraft: Spacecraft, horizon: Tick) -> Self {
        let (commands, activity) = (BTreeMap::new(), Activity::default());
        Self { spacecraft, horizon, commands, activity, without: Vec::new(), missed: 0 }
    }

    /// Between these ticks there is no guidance, by order: the wheels hold no torque where it would have commanded.
    pub fn set_without_guidance(&mut self, without: Vec<(Tick, Tick)>) {
        self.without = without;
    }

    /// From now on wheels and sensors have these faults, too.
    pub fn suffer(&mut self, faults: impl IntoIterator<Item = TimedFault>) {
        self.spacecraft.suffer(faults);
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.spacecraft.now
    }

    /// Whether the mission's end is reached.
    #[must_use]
    pub fn done(&self) -> bool {
        self.now() >= self.horizon
    }

    /// What the spacecraft tells of itself now.
    pub fn sample(&mut self) -> StateSample {
        self.spacecraft.sample()
    }

    /// Takes the command computed from the state at `tick`; one that came too late is left out.
    ///
    /// # Errors
    /// When the command is not finite or belongs to a state that was not sent yet.
    pub fn command(&mut self, tick: Tick, torque: Vector3<f64>, activity: Activity) -> Result<(), CommandError> {
        if !torque.iter().all(|component| component.is_finite()) {
            return Err(CommandError::NotFinite { tick, torque: torque.into() });
        }
        let now = self.now();
        if tick > now {
            return Err(CommandError::FromTheFuture { tick, now });
        }
        if tick.after(1) >= now {
            self.commands.insert(tick, (torque, activity));
        }
        Ok(())
    }

    /// Whether the commands that the next tick needs have come: that of the state before this one for its torque, and where
    /// resources have bounds that of this one for what else is done.
    #[must_use]
    pub fn ready(&self) -> bool {
        let has_come = |tick: &Tick| self.commands.contains_key(tick) || self.is_without(*tick);
        let before = self.now().0.checked_sub(1).map(Tick);
        before.as_ref().is_none_or(has_come) && (self.spacecraft.onboard().is_none() || has_come(&self.now()))
    }

    fn is_without(&self, tick: Tick) -> bool {
        self.without.iter().any(|&(from, back)| (from..back).contains(&tick))
    }

    /// Integrates one tick. The wheels idle when no command has come: the first tick has none, and in a paced mission
    /// guidance may be late.
    pub fn advance(&mut self) -> StateSample {
        let acting = self.next_command();
        self.advance_by(&acting)
    }

    /// What acts over the next tick: the commands that came for it; without one the wheels hold no torque.
    pub fn next_command(&mut self) -> Acting {
        let now = self.now();
        let before = now.0.checked_sub(1).map(Tick);
        let command = before.filter(|&before| !self.is_without(before)).map(|before| {
            let command = self.commands.remove(&before).map(|(torque, _)| torque);
            self.missed += u64::from(command.is_none());
            command.unwrap_or_default()
        });
        self.commands = self.commands.split_off(&now);
        Acting {
            torque: command.unwrap_or_default(),
            activity: self.spacecraft.onboard().map(|_| self.next_activity()),
        }
    }

    /// What is done over the next tick: what came for it, nothing without guidance, else what was done before.
    fn next_activity(&self) -> Activity {
        let now = self.now();
        match self.commands.get(&now) {
            Some((_, activity)) => *activity,
            None if self.is_without(now) => Activity::default(),
            None => Activity { image_worth: None, ..self.activity },
        }
    }

    /// Integrates one tick.
    pub fn advance_by(&mut self, acting: &Acting) -> StateSample {
        self.activity = acting.activity.unwrap_or_default();
        self.spacecraft.advance_doing(&acting.torque, self.activity);
        self.sample()
    }
}

#[cfg(test)]
mod tests {
    use swath_sim::config::SimConfig;
    use swath_sim::rng;
    use swath_sim::vehicle::initial::InitialState;
    use swath_sim::vehicle::model::Model;

    use super::*;

    fn spacecraft() -> SpacecraftLogic {
        let model = Model::new(SimConfig::default()).unwrap();
        let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
        SpacecraftLogic::new(Spacecraft::new(&model, &initial), Tick(100))
    }

    #[test]
    fn a_command_acts_one_tick_after_its_state() {
        let mut spacecraft = spacecraft();
        assert!(spacecraft.ready());
        let torque = Vector3::new(0.1, -0.2, 0.3);
        spacecraft.command(Tick(0), torque, Activity::default()).unwrap();
        assert_eq!(spacecraft.advance().torque_applied, Vector3::zeros());
        assert!(spacecraft.ready());
        assert_eq!(spacecraft.advance().torque_applied, torque);
        assert!(!spacecraft.ready());
        assert_eq!(spacecraft.missed, 0);
        assert_eq!(spacecraft.advance().torque_applied, Vector3::zeros());
        assert_eq!(spacecraft.missed, 1);
    }

    #[test]
    fn without_guidance_no_command_is_waited_for() {
        let mut spacecraft = spacecraft();
        spacecraft.set_without_guidance(vec![(Tick(1), Tick(3))]);
        let torque = Vector3::new(0.1, -0.2, 0.3);
        spacecraft.command(Tick(0), torque, Activity::default()).unwrap();
        spacecraft.advance();
        assert_eq!(spacecraft.advance().torque_applied, torque);
        for now in [2, 3] {
            assert_eq!(spacecraft.now(), Tick(now));
            assert!(spacecraft.ready());
            assert_eq!(spacecraft.advance().torque_applied, Vector3::zeros());
        }
        assert!(!spacecraft.ready(), "the command of tick 3 comes from the next guidance");
        assert_eq!(spacecraft.missed, 0);
    }

    #[test]
    fn commands_that_make_no_sense_are_refused() {
        let mut spacecraft = spacecraft();
        let nan = Vector3::new(f64::NAN, 0.0, 0.0);
        let none = Activity::default();
        assert!(matches!(spacecraft.command(Tick(0), nan, none), Err(CommandError::NotFinite { .. })));
        let early = spacecraft.command(Tick(1), Vector3::zeros(), none);
        assert!(matches!(early, Err(CommandError::FromTheFuture { .. })));
        for _ in 0..5 {
            spacecraft.advance();
        }
        spacecraft.command(Tick(1), Vector3::zeros(), none).unwrap();
        assert!(!spacecraft.ready(), "a command that came too late is not used");
    }
}
