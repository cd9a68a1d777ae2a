//! A node under management: the standard services and events of its life cycle, and what is asked of its main loop.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use swath_msgs::lifecycle_msgs::{
    self as msg, ChangeState, ChangeStateResponse, GetAvailableStates, GetAvailableStatesResponse,
    GetAvailableTransitions, GetAvailableTransitionsResponse, GetState, GetStateResponse, TransitionDescription,
    TransitionEvent,
};

use crate::clock::SimClock;
use crate::error::RosError;
use crate::lifecycle::{Event, State, TRANSITIONS, Transition};
use crate::service::{RequestId, Server};
use crate::signal::{Signal, lock};
use crate::topic::Publisher;

/// Questions that may wait for the main loop; more are refused.
const ROOM: usize = 64;

/// The life cycle of a node, as its main loop sees it.
pub struct Managed {
    shared: Arc<Shared>,
    events: Publisher<TransitionEvent>,
    clock: SimClock,
}

struct Shared {
    state: Mutex<State>,
    change: Server<ChangeState>,
    asked: Mutex<VecDeque<(RequestId, msg::Transition)>>,
    /// Whether something was asked for: all that a main loop looks at when nothing was.
    news: AtomicBool,
    node_signal: Signal,
}

/// What the node's background thread answers.
pub(crate) struct LifecycleServices {
    shared: Arc<Shared>,
    state: Server<GetState>,
    states: Server<GetAvailableStates>,
    transitions: Server<GetAvailableTransitions>,
    graph: Server<GetAvailableTransitions>,
}

/// The servers of the four services that ask without changing anything.
pub(crate) struct Questions {
    pub(crate) state: Server<GetState>,
    pub(crate) states: Server<GetAvailableStates>,
    pub(crate) transitions: Server<GetAvailableTransitions>,
    pub(crate) graph: Server<GetAvailableTransitions>,
}

impl Managed {
    /// A node that is unconfigured; `signal` is raised when something is asked of its main loop, `background` is that of
    /// the thread that answers questions.
    pub(crate) fn new(
        mut change: Server<ChangeState>,
        mut questions: Questions,
        events: Publisher<TransitionEvent>,
        clock: SimClock,
        [signal, background]: [&Signal; 2],
    ) -> (Self, LifecycleServices) {
        change.set_signal(background);
        questions.state.set_signal(background);
        questions.states.set_signal(background);
        questions.transitions.set_signal(background);
        questions.graph.set_signal(background);
        let shared = Arc::new(Shared {
            state: Mutex::new(State::Unconfigured),
            change,
            asked: Mutex::default(),
            news: AtomicBool::new(false),
            node_signal: signal.clone(),
        });
        let Questions { state, states, transitions, graph } = questions;
        let services = LifecycleServices { shared: Arc::clone(&shared), state, states, transitions, graph };
        (Self { shared, events, clock }, services)
    }

    /// Where the node stands.
    #[must_use]
    pub fn state(&self) -> State {
        *lock(&self.shared.state)
    }

    /// Does what was asked for by service since the last call: `act` is told of each transition that is legal, and tells
    /// whether it was done.
    ///
    /// # Errors
    /// When an answer or an event cannot be sent.
    pub fn serve(&self, mut act: impl FnMut(&Transition) -> bool) -> Result<(), RosError> {
        if !self.shared.news.load(Ordering::Acquire) {
            return Ok(());
        }
        self.shared.news.store(false, Ordering::Release);
        let asked = std::mem::take(&mut *lock(&self.shared.asked));
        for (id, wish) in asked {
            let success = self.go(Event::Asked { id: wish.id, label: &wish.label }, &mut act)?;
            self.shared.change.respond(id, ChangeStateResponse { success })?;
        }
        Ok(())
    }

    /// Takes a transition that the node itself wants, such as `configure` when it starts; tells whether it was done.
    ///
    /// # Errors
    /// When an event cannot be sent.
    pub fn take(&self, label: &str, act: impl FnMut(&Transition) -> bool) -> Result<bool, RosError> {
        self.go(Event::Asked { id: 0, label }, act)
    }

    fn go(&self, event: Event<'_>, mut act: impl FnMut(&Transition) -> bool) -> Result<bool, RosError> {
        let before = self.state();
        let Some(begun) = before.step(event) else {
            tracing::warn!("a transition is refused: {event:?} of a node that is {}", before.label());
            return Ok(false);
        };
        self.enter(begun)?;
        let done = act(begun);
        if let Some(ended) = begun.goal.step(if done { Event::Succeeded } else { Event::Failed }) {
            self.enter(ended)?;
        }
        tracing::debug!("{}: the node is {}", begun.label, self.state().label());
        Ok(done)
    }

    fn enter(&self, transition: &Transition) -> Result<(), RosError> {
        *lock(&self.shared.state) = transition.goal;
        let TransitionDescription { transition, start_state, goal_state } = description(transition);
        self.events.publish(&TransitionEvent { timestamp: self.clock.now_ns(), transition, start_state, goal_state })
    }
}

impl LifecycleServices {
    /// Answers what can be answered at once, and hands the rest to the main loop.
    pub(crate) fn serve(&self) -> Result<(), RosError> {
        let now = || *lock(&self.shared.state);
        self.state.answer_all(|_| GetStateResponse { current_state: state(now()) })?;
        self.states.answer_all(|_| GetAvailableStatesResponse {
            available_states: State::ALL.into_iter().map(state).collect(),
        })?;
        let all = |which: Vec<&Transition>| GetAvailableTransitionsResponse {
            available_transitions: which.into_iter().map(description).collect(),
        };
        self.transitions.answer_all(|_| all(now().available().collect()))?;
        self.graph.answer_all(|_| all(TRANSITIONS.iter().collect()))?;
        let mut news = false;
        while let Some((id, request)) = self.shared.change.take()? {
            let mut asked = lock(&self.shared.asked);
            if asked.len() < ROOM {
                asked.push_back((id, request.transition));
                news = true;
            } else {
                drop(asked);
                self.shared.change.respond(id, ChangeStateResponse { success: false })?;
            }
        }
        if news {
            self.shared.news.store(true, Ordering::Release);
            self.shared.node_signal.raise();
        }
        Ok(())
    }
}

fn state(state: State) -> msg::State {
    msg::State { id: state.id(), label: state.label().to_owned() }
}

fn description(transition: &Transition) -> TransitionDescription {
    TransitionDescription {
        transition: msg::Transition { id: transition.id, label: transition.label.to_owned() },
        start_state: state(transition.start),
        goal_state: state(transition.goal),
    }
}
