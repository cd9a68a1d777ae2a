//! One alarm: its states, and the one function that every change of them goes through.

use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use thiserror::Error;

/// Where an alarm stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Nothing is wrong, and nobody needs to know that something was.
    #[default]
    Normal,
    /// Something is wrong, and nobody has said that they know.
    Unacknowledged,
    /// Something is wrong, and an operator knows.
    Acknowledged,
    /// Nothing is wrong any more, and nobody has said that they know of it.
    ReturnedUnacknowledged,
    /// An operator does not want to be told of it for a while.
    Shelved,
}

impl State {
    /// The states, in the order of their numbers.
    pub const ALL: [Self; 5] =
        [Self::Normal, Self::Unacknowledged, Self::Acknowledged, Self::ReturnedUnacknowledged, Self::Shelved];

    /// Its name in messages, files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unacknowledged => "unacknowledged",
            Self::Acknowledged => "acknowledged",
            Self::ReturnedUnacknowledged => "returned unacknowledged",
            Self::Shelved => "shelved",
        }
    }
}

/// When a condition counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rules {
    /// Reports in a row that something is wrong before the alarm is raised; at least 1.
    pub violations: u32,
    /// How long nothing may be wrong before the alarm returns [ticks].
    pub off_delay: u32,
    /// Whether reports tell of moments only: nothing is wrong any more once the off-delay has passed since the last.
    pub momentary: bool,
}

/// What happens to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Its node says whether something is wrong.
    Condition(bool),
    /// An operator knows of it.
    Acknowledge,
    /// An operator does not want to be told of it before a tick.
    Shelve(Tick),
    /// An operator wants to be told again.
    Unshelve,
    /// Time passes.
    Time,
}

/// Why an operator's wish is not followed.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Refused {
    /// There is nothing to acknowledge or to shelve.
    #[error("the alarm does not stand: it is {}", .0.name())]
    DoesNotStand(State),
    /// It is acknowledged already.
    #[error("the alarm is acknowledged already")]
    Acknowledged,
    /// It is shelved already, or not shelved.
    #[error("the alarm is {}shelved", if *.0 { "already " } else { "not " })]
    Shelved(bool),
}

/// An alarm as it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Alarm {
    /// Where it would stand if it were not shelved; never [`State::Shelved`].
    beneath: State,
    shelved_until: Option<Tick>,
    /// Reports in a row that something is wrong.
    violations: u32,
    /// Since when nothing is wrong, or the last report that something was.
    quiet_since: Tick,
    /// Whether the last report was that something is wrong.
    wrong: bool,
    /// Times that it was raised.
    pub sequence: u64,
    /// When it was raised last.
    pub raised: Tick,
}

impl Alarm {
    /// An alarm as a journal tells of it.
    #[must_use]
    pub fn restored(beneath: State, shelved_until: Option<Tick>, sequence: u64, raised: Tick, now: Tick) -> Self {
        let wrong = matches!(beneath, State::Unacknowledged | State::Acknowledged);
        Self { beneath, shelved_until, violations: u32::from(wrong), quiet_since: now, wrong, sequence, raised }
    }

    /// Where it stands.
    #[must_use]
    pub fn state(&self) -> State {
        if self.shelved_until.is_some() { State::Shelved } else { self.beneath }
    }

    /// Where it would stand if it were not shelved.
    #[must_use]
    pub fn beneath(&self) -> State {
        self.beneath
    }

    /// Tick at which it is told of again, when it is shelved.
    #[must_use]
    pub fn shelved_until(&self) -> Option<Tick> {
        self.shelved_until
    }

    /// Whether something is wrong.
    #[must_use]
    pub fn active(&self) -> bool {
        matches!(self.beneath, State::Unacknowledged | State::Acknowledged)
    }

    /// Tick at which it returns if nothing more is heard.
    #[must_use]
    pub fn returns(&self, rules: &Rules) -> Option<Tick> {
        let waits = self.active() && (rules.momentary || !self.wrong);
        waits.then(|| self.quiet_since.after(rules.off_delay))
    }

    /// The alarm after something has happened to it at a tick.
    ///
    /// While it is shelved it goes through its states all the same, without being told of.
    ///
    /// # Errors
    /// When an operator's wish makes no sense as it stands.
    pub fn step(mut self, rules: &Rules, now: Tick, input: Input) -> Result<Self, Refused> {
        match input {
            Input::Condition(wrong) => self.report(rules, now, wrong),
            Input::Acknowledge => self.beneath = self.acknowledged()?,
            Input::Shelve(_) if self.shelved_until.is_some() => return Err(Refused::Shelved(true)),
            Input::Shelve(_) if self.beneath == State::Normal => return Err(Refused::DoesNotStand(State::Normal)),
            Input::Shelve(until) => self.shelved_until = Some(until),
            Input::Unshelve if self.shelved_until.is_none() => return Err(Refused::Shelved(false)),
            Input::Unshelve => self.shelved_until = None,
            Input::Time => {}
        }
        self.shelved_until = self.shelved_until.filter(|&until| now < until);
        if self.returns(rules).is_some_and(|tick| now >= tick) {
            self.violations = 0;
            self.beneath = match self.beneath {
                State::Unacknowledged => State::ReturnedUnacknowledged,
                _ => State::Normal,
            };
        }
        Ok(self)
    }

    fn report(&mut self, rules: &Rules, now: Tick, wrong: bool) {
        let changed = self.wrong != wrong;
        self.wrong = wrong;
        if wrong || changed {
            self.quiet_since = now;
        }
        if !wrong {
            self.violations = 0;
            return;
        }
        self.violations = self.violations.saturating_add(1);
        if self.violations >= rules.violations && !self.active() {
            self.beneath = State::Unacknowledged;
            self.sequence += 1;
            self.raised = now;
        }
    }

    fn acknowledged(&self) -> Result<State, Refused> {
        match self.beneath {
            State::Unacknowledged => Ok(State::Acknowledged),
            State::ReturnedUnacknowledged => Ok(State::Normal),
            State::Acknowledged => Err(Refused::Acknowledged),
            state => Err(Refused::DoesNotStand(state)),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RULES: Rules = Rules { violations: 1, off_delay: 0, momentary: false };

    fn through(rules: &Rules, inputs: &[(u64, Input)]) -> Vec<State> {
        let mut alarm = Alarm::default();
        let step = |&(tick, input): &(u64, Input)| {
            alarm = alarm.step(rules, Tick(tick), input).unwrap();
            alarm.state()
        };
        inputs.iter().map(step).collect()
    }

    /// What comes at which tick, and the states that follow.
    type Case<'a> = (&'a [(u64, Input)], &'a [State]);

    #[test]
    fn an_alarm_goes_through_its_states() {
        use Input::{Acknowledge, Condition, Shelve, Time, Unshelve};
        use State::{Acknowledged, Normal, ReturnedUnacknowledged, Shelved, Unacknowledged};
        let cases: [Case; 6] = [
            (&[(1, Condition(true)), (2, Acknowledge), (3, Condition(false))], &[Unacknowledged, Acknowledged, Normal]),
            (
                &[(1, Condition(true)), (2, Condition(false)), (3, Acknowledge)],
                &[Unacknowledged, ReturnedUnacknowledged, Normal],
            ),
            (
                &[(1, Condition(true)), (2, Condition(false)), (3, Condition(true))],
                &[Unacknowledged, ReturnedUnacknowledged, Unacknowledged],
            ),
            (
                &[(1, Condition(true)), (2, Shelve(Tick(9))), (8, Time), (9, Time)],
                &[Unacknowledged, Shelved, Shelved, Unacknowledged],
            ),
            (
                &[(1, Condition(true)), (2, Shelve(Tick(9))), (3, Acknowledge), (4, Condition(false)), (9, Time)],
                &[Unacknowledged, Shelved, Shelved, Shelved, Normal],
            ),
            (&[(1, Condition(true)), (2, Shelve(Tick(9))), (3, Unshelve)], &[Unacknowledged, Shelved, Unacknowledged]),
        ];
        for (inputs, states) in cases {
            assert_eq!(through(&RULES, inputs), states, "{inputs:?}");
        }
    }

    #[test]
    fn chatter_is_held_back_by_violations_and_off_delay() {
        use Input::{Condition, Time};
        use State::{Normal, ReturnedUnacknowledged, Unacknowledged};
        let rules = Rules { violations: 3, off_delay: 10, momentary: false };
        let wrong = |tick| (tick, Condition(true));
        let right = |tick| (tick, Condition(false));
        assert_eq!(through(&rules, &[wrong(1), wrong(2), right(3), wrong(4), wrong(5)]), [Normal; 5]);
        assert_eq!(
            through(&rules, &[wrong(1), wrong(2), wrong(3), right(4), wrong(5), right(6), (15, Time), (16, Time)]),
            [
                Normal,
                Normal,
                Unacknowledged,
                Unacknowledged,
                Unacknowledged,
                Unacknowledged,
                Unacknowledged,
                ReturnedUnacknowledged,
            ]
        );
        let moment = Rules { violations: 1, off_delay: 10, momentary: true };
        assert_eq!(
            through(&moment, &[wrong(1), wrong(8), (17, Time), (18, Time)]),
            [Unacknowledged, Unacknowledged, Unacknowledged, ReturnedUnacknowledged,]
        );
    }

    #[test]
    fn wishes_that_make_no_sense_are_refused_in_words() {
        let alarm = Alarm::default();
        let words = |alarm: Alarm, input| alarm.step(&RULES, Tick(5), input).unwrap_err().to_string();
        assert_eq!(words(alarm, Input::Acknowledge), "the alarm does not stand: it is normal");
        assert_eq!(words(alarm, Input::Shelve(Tick(9))), "the alarm does not stand: it is normal");
        assert_eq!(words(alarm, Input::Unshelve), "the alarm is not shelved");
        let raised = alarm.step(&RULES, Tick(1), Input::Condition(true)).unwrap();
        let known = raised.step(&RULES, Tick(2), Input::Acknowledge).unwrap();
        assert_eq!(words(known, Input::Acknowledge), "the alarm is acknowledged already");
        let shelved = raised.step(&RULES, Tick(2), Input::Shelve(Tick(9))).unwrap();
        assert_eq!(words(shelved, Input::Shelve(Tick(9))), "the alarm is already shelved");
    }

    fn any_input() -> impl Strategy<Value = Input> {
        prop_oneof![
            4 => any::<bool>().prop_map(Input::Condition),
            1 => Just(Input::Acknowledge),
            1 => (0..200u64).prop_map(|tick| Input::Shelve(Tick(tick))),
            1 => Just(Input::Unshelve),
            2 => Just(Input::Time),
        ]
    }

    proptest! {
        /// Whatever happens: a refusal changes nothing by definition, an alarm is raised only by its condition, what is
        /// not acknowledged does not become normal by itself, and it stands as long as something is wrong.
        #[test]
        fn nothing_that_happened_goes_unnoticed(
            inputs in prop::collection::vec((0..4u64, any_input()), 1..200),
            violations in 1..4u32,
            off_delay in 0..6u32,
        ) {
            let rules = Rules { violations, off_delay, momentary: false };
            let (mut alarm, mut now, mut in_a_row) = (Alarm::default(), 0, 0);
            for (passed, input) in inputs {
                now += passed;
                let Ok(next) = alarm.step(&rules, Tick(now), input) else { continue };
                match input {
                    Input::Condition(true) => in_a_row += 1,
                    Input::Condition(false) => in_a_row = 0,
                    _ => {}
                }
                prop_assert!(in_a_row < violations || next.active());
                let raised = next.sequence > alarm.sequence;
                prop_assert!(!raised || input == Input::Condition(true));
                let acknowledged = input == Input::Acknowledge;
                let waits = |it: &Alarm| matches!(it.beneath(), State::Unacknowledged | State::ReturnedUnacknowledged);
                prop_assert!(!waits(&alarm) || waits(&next) || acknowledged);
                prop_assert_ne!(next.beneath(), State::Shelved);
                alarm = next;
            }
        }
    }
}
