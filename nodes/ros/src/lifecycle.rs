//! The life cycle of a managed node as ROS 2 defines it: states, transitions, and the one function that takes a step.

/// What may be asked for has a number below this; the other transitions follow by themselves.
const ASKED_FOR: u8 = 10;

/// A state of a managed node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum State {
    /// Nobody knows.
    Unknown = 0,
    /// It is there and does nothing.
    Unconfigured = 1,
    /// It has what it needs, and does nothing with it.
    Inactive = 2,
    /// It does its work.
    Active = 3,
    /// It is about to go.
    Finalized = 4,
    /// From unconfigured to inactive.
    Configuring = 10,
    /// From inactive to unconfigured.
    CleaningUp = 11,
    /// On the way to its end.
    ShuttingDown = 12,
    /// From inactive to active.
    Activating = 13,
    /// From active to inactive.
    Deactivating = 14,
    /// Something went wrong on the way.
    ErrorProcessing = 15,
}

impl State {
    /// Every state, in the order of their numbers.
    pub const ALL: [Self; 11] = [
        Self::Unknown,
        Self::Unconfigured,
        Self::Inactive,
        Self::Active,
        Self::Finalized,
        Self::Configuring,
        Self::CleaningUp,
        Self::ShuttingDown,
        Self::Activating,
        Self::Deactivating,
        Self::ErrorProcessing,
    ];

    /// Number in messages.
    #[must_use]
    pub const fn id(self) -> u8 {
        self as u8
    }

    /// Name in messages.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
            Self::Configuring => "configuring",
            Self::CleaningUp => "cleaningup",
            Self::ShuttingDown => "shuttingdown",
            Self::Activating => "activating",
            Self::Deactivating => "deactivating",
            Self::ErrorProcessing => "errorprocessing",
        }
    }

    /// The transition that something leads to; nothing where it is not legal.
    #[must_use]
    pub fn step(self, event: Event<'_>) -> Option<&'static Transition> {
        let matches = |it: &&Transition| match event {
            Event::Asked { id, label: "" } => it.id == id && it.id < ASKED_FOR,
            Event::Asked { label, .. } => it.label == label && it.id < ASKED_FOR,
            Event::Succeeded => it.label == SUCCESS,
            Event::Failed => it.label == FAILURE,
        };
        self.leaving().find(matches)
    }

    /// What may be asked for.
    pub fn available(self) -> impl Iterator<Item = &'static Transition> {
        self.leaving().filter(|it| it.id < ASKED_FOR)
    }

    fn leaving(self) -> impl Iterator<Item = &'static Transition> {
        TRANSITIONS.iter().filter(move |it| it.start == self)
    }
}

/// What happens to a managed node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event<'a> {
    /// Somebody asks for a transition, by its label or, where that is empty, by its number.
    Asked {
        /// Its number.
        id: u8,
        /// Its label.
        label: &'a str,
    },
    /// What was asked for has been done.
    Succeeded,
    /// What was asked for could not be done.
    Failed,
}

/// From one state to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// Number in messages.
    pub id: u8,
    /// Name in messages.
    pub label: &'static str,
    /// State that it leaves.
    pub start: State,
    /// State that it leads to.
    pub goal: State,
}

const fn transition(id: u8, label: &'static str, start: State, goal: State) -> Transition {
    Transition { id, label, start, goal }
}

const SUCCESS: &str = "transition_success";
const FAILURE: &str = "transition_failure";
const ERROR: &str = "transition_error";

/// Every transition, in the order in which ROS 2 tells them.
pub const TRANSITIONS: [Transition; 25] = [
    transition(1, "configure", State::Unconfigured, State::Configuring),
    transition(10, SUCCESS, State::Configuring, State::Inactive),
    transition(11, FAILURE, State::Configuring, State::Unconfigured),
    transition(12, ERROR, State::Configuring, State::ErrorProcessing),
    transition(2, "cleanup", State::Inactive, State::CleaningUp),
    transition(20, SUCCESS, State::CleaningUp, State::Unconfigured),
    transition(21, FAILURE, State::CleaningUp, State::Inactive),
    transition(22, ERROR, State::CleaningUp, State::ErrorProcessing),
    transition(3, "activate", State::Inactive, State::Activating),
    transition(30, SUCCESS, State::Activating, State::Active),
    transition(31, FAILURE, State::Activating, State::Inactive),
    transition(32, ERROR, State::Activating, State::ErrorProcessing),
    transition(4, "deactivate", State::Active, State::Deactivating),
    transition(40, SUCCESS, State::Deactivating, State::Inactive),
    transition(41, FAILURE, State::Deactivating, State::Active),
    transition(42, ERROR, State::Deactivating, State::ErrorProcessing),
    transition(5, "shutdown", State::Unconfigured, State::ShuttingDown),
    transition(6, "shutdown", State::Inactive, State::ShuttingDown),
    transition(7, "shutdown", State::Active, State::ShuttingDown),
    transition(50, SUCCESS, State::ShuttingDown, State::Finalized),
    transition(51, FAILURE, State::ShuttingDown, State::Finalized),
    transition(52, ERROR, State::ShuttingDown, State::ErrorProcessing),
    transition(60, SUCCESS, State::ErrorProcessing, State::Unconfigured),
    transition(61, FAILURE, State::ErrorProcessing, State::Finalized),
    transition(62, ERROR, State::ErrorProcessing, State::Finalized),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(label: &str) -> Event<'_> {
        Event::Asked { id: 0, label }
    }

    #[test]
    fn each_primary_state_allows_what_ros_2_allows() {
        let available = |state: State| state.available().map(|it| (it.id, it.label)).collect::<Vec<_>>();
        assert_eq!(available(State::Unconfigured), [(1, "configure"), (5, "shutdown")]);
        assert_eq!(available(State::Inactive), [(2, "cleanup"), (3, "activate"), (6, "shutdown")]);
        assert_eq!(available(State::Active), [(4, "deactivate"), (7, "shutdown")]);
        for state in State::ALL.into_iter().filter(|state| *state == State::Finalized || state.id() >= 10) {
            assert_eq!(available(state), [], "{state:?}");
        }
    }

    #[test]
    fn a_label_counts_before_a_number_and_what_follows_by_itself_cannot_be_asked_for() {
        let by_number = |id| State::Inactive.step(Event::Asked { id, label: "" }).map(|it| it.goal);
        assert_eq!([by_number(3), by_number(4), by_number(30)], [Some(State::Activating), None, None]);
        let both = State::Inactive.step(Event::Asked { id: 3, label: "cleanup" });
        assert_eq!(both.map(|it| it.id), Some(2));
        assert_eq!(State::Configuring.step(asked(SUCCESS)), None);
        assert_eq!(State::Active.step(asked("fly")), None);
    }

    #[test]
    fn every_way_that_is_begun_ends_in_a_primary_state() {
        for begun in TRANSITIONS.iter().filter(|it| it.id < ASKED_FOR) {
            let ends = [Event::Succeeded, Event::Failed].map(|event| begun.goal.step(event).unwrap().goal);
            assert!(ends.iter().all(|state| state.id() < 10), "{begun:?}");
            assert_eq!(begun.goal.step(asked("shutdown")), None, "{begun:?} is under way");
        }
    }
}
