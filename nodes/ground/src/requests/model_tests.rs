//! Random sequences of operations, with restarts in between, against a model that is simple enough to be right by
//! reading.

use proptest::prelude::*;
use swath_sim::config::SimConfig;
use swath_sim::rng;
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model as Constants;
use swath_sim::world::strip::{StripId, StripRequest};

use super::store::{Durability, Store};
use swath_mission::orders::action::Review;
use swath_mission::orders::order::Order;
use swath_mission::requests::journal::InFlight;
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{RequestLogic, Rules};

const MAX_ATTEMPTS: u32 = 2;

#[derive(Clone, Debug)]
enum Operation {
    Submit { reference: u8, place: u8, hold: bool },
    Cancel(u8),
    Replace { id: u8, reference: u8, place: u8 },
    Review(u8, u8),
    Choose(u8),
    Image,
    End(Option<FailureReason>),
    Repeat,
    Restart,
}

fn operations() -> impl Strategy<Value = Vec<Operation>> {
    let failure = prop_oneof![
        Just(None),
        Just(Some(FailureReason::Attitude)),
        Just(Some(FailureReason::Elevation)),
        Just(Some(FailureReason::Interrupted))
    ];
    let id = 0..12_u8;
    prop::collection::vec(
        prop_oneof![
            4 => (0..8_u8, 0..6_u8, any::<bool>())
                .prop_map(|(reference, place, hold)| Operation::Submit { reference, place, hold }),
            2 => id.clone().prop_map(Operation::Cancel),
            1 => (id.clone(), 0..8_u8, 0..6_u8)
                .prop_map(|(id, reference, place)| Operation::Replace { id, reference, place }),
            2 => (id.clone(), 0..3_u8).prop_map(|(id, action)| Operation::Review(id, action)),
            4 => id.prop_map(Operation::Choose),
            3 => Just(Operation::Image),
            4 => failure.prop_map(Operation::End),
            1 => Just(Operation::Repeat),
            1 => Just(Operation::Restart),
        ],
        1..60,
    )
}

fn order(reference: u8, place: u8, hold: bool) -> Order {
    let longitude_deg = f64::from(place) * 7.0;
    let request = StripRequest {
        start_latitude_deg: 5.0,
        start_longitude_deg: longitude_deg,
        end_latitude_deg: 6.0,
        end_longitude_deg: longitude_deg + 2.0,
        priority: 0.5,
        acquisition_speed_m_s: 3000.0,
        bidirectional: false,
    };
    let text = format!("r{reference}");
    Order { hold_for_approval: hold, ..Order::new(text.clone(), text, request) }
}

/// One request of the model.
struct Simple {
    reference: u8,
    place: u8,
    hold: bool,
    state: State,
    counted: u32,
    imaged: u32,
    replaced_by: Option<usize>,
}

/// The model: a list, looked through from end to end.
#[derive(Default)]
struct Simpler {
    requests: Vec<Simple>,
    /// Strip under way, and whether its imaging has begun.
    flown: Option<(usize, bool)>,
    task: u64,
}

impl Simpler {
    fn open(&self, i: usize) -> bool {
        !self.requests[i].state.is_final()
    }

    fn newest(&self, reference: u8) -> Option<usize> {
        self.requests.iter().rposition(|it| it.reference == reference)
    }

    /// The number of a request under a reference, or a new one, or a refusal.
    fn submit(&mut self, reference: u8, place: u8, hold: bool, instead: Option<usize>) -> Option<usize> {
        // What was not imaged and is over may be asked for again.
        let counts = |i: usize| self.open(i) || self.requests[i].state == State::Completed;
        if let Some(known) = self.newest(reference).filter(|&i| Some(i) != instead && counts(i)) {
            let it = &self.requests[known];
            return ((it.place, it.hold) == (place, hold)).then_some(known);
        }
        let taken =
            (0..self.requests.len()).any(|i| Some(i) != instead && self.open(i) && self.requests[i].place == place);
        if taken {
            return None;
        }
        let state = if hold { State::Held } else { State::Accepted };
        self.requests.push(Simple { reference, place, hold, state, counted: 0, imaged: 0, replaced_by: None });
        Some(self.requests.len() - 1)
    }

    /// What replaced a request, when it is the newest of this reference and asks for the same.
    fn replaced_by(&self, old: usize, reference: u8, place: u8) -> Option<usize> {
        let new = self.requests.get(old)?.replaced_by.filter(|&new| self.newest(reference) == Some(new))?;
        let it = &self.requests[new];
        ((it.place, it.hold) == (place, false)).then_some(new)
    }

    fn may_leave(&self, i: usize) -> bool {
        i < self.requests.len() && self.open(i) && self.requests[i].state != State::Executing
    }

    fn end(&mut self, failure: Option<FailureReason>) {
        let Some((i, _)) = self.flown.take() else { return };
        self.task += 1;
        let it = &mut self.requests[i];
        if it.state.is_final() {
            return;
        }
        let counts = matches!(failure, Some(FailureReason::Attitude | FailureReason::Elevation));
        match failure {
            None => {
                it.imaged += 1;
                it.state = State::Completed;
            }
            Some(_) if it.state == State::Held => {}
            Some(_) => {
                it.counted += u32::from(counts);
                it.state = if counts && it.counted >= MAX_ATTEMPTS { State::Failed } else { State::Accepted };
            }
        }
    }
}

struct Trial {
    logic: RequestLogic,
    store: Store,
    simple: Simpler,
    last: Option<TaskRecord>,
    folder: tempfile::TempDir,
}

fn empty() -> RequestLogic {
    let model = Constants::new(SimConfig::default()).unwrap();
    let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
    RequestLogic::new(model, &initial, Tick(172_800), Rules { epoch_ns: 0, max_attempts: MAX_ATTEMPTS })
}

impl Trial {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("store.sqlite"), "trial").unwrap();
        Self { logic: empty(), store, simple: Simpler::default(), last: None, folder }
    }

    fn apply(&mut self, operation: &Operation) {
        let id = |i: u8| StripId(u64::from(i) + 1);
        match *operation {
            Operation::Submit { reference, place, hold } => {
                let expected = self.simple.submit(reference, place, hold, None);
                let given = self.logic.submit(order(reference, place, hold), self.logic.now());
                assert_eq!(given.ok().map(|id| id.0 as usize - 1), expected);
            }
            Operation::Cancel(i) => {
                let may = self.simple.may_leave(i.into());
                assert_eq!(self.logic.cancel(id(i), "ops", "").is_ok(), may);
                if may {
                    self.simple.requests[usize::from(i)].state = State::CancelledByUser;
                }
            }
            Operation::Replace { id: i, reference, place } => {
                let old = usize::from(i);
                let again = self.simple.replaced_by(old, reference, place);
                let expected = if again.is_some() {
                    again
                } else if self.simple.may_leave(old) {
                    // Under a reference of its own a request is known, and stands in for the old one.
                    self.simple.submit(reference, place, false, Some(old))
                } else {
                    None
                };
                let given = self.logic.replace(id(i), order(reference, place, false), self.logic.now());
                assert_eq!(given.ok().map(|id| id.0 as usize - 1), expected);
                if let Some(new) = expected.filter(|_| again.is_none()) {
                    self.simple.requests[old].state = State::Superseded;
                    self.simple.requests[old].replaced_by = Some(new);
                }
            }
            Operation::Review(i, action) => self.review(i, action),
            Operation::Choose(i) => {
                let (task, start) = (self.simple.task, Tick(self.simple.task * 300));
                let idle = self.simple.flown.is_none();
                let i = usize::from(i);
                if idle && i < self.simple.requests.len() {
                    self.logic.on_task(InFlight { task, id: id(i as u8), start, t_pre: 100, t_acq: 200 });
                    if self.simple.requests[i].state == State::Accepted {
                        self.simple.requests[i].state = State::Scheduled;
                        self.simple.flown = Some((i, false));
                    }
                }
            }
            Operation::Image => {
                if let Some((i, false)) = self.simple.flown {
                    self.logic.on_imaging(self.simple.task, Tick(self.simple.task * 300 + 100));
                    self.simple.flown = Some((i, true));
                    let it = &mut self.simple.requests[i];
                    it.state = if it.state == State::Scheduled { State::Executing } else { it.state };
                }
            }
            Operation::End(failure) => self.end(failure),
            Operation::Repeat => {
                let now = self.logic.now();
                self.logic.on_decision_point(self.simple.task, now, self.last.as_slice());
            }
            Operation::Restart => self.restart(),
        }
        self.store.write(self.logic.take_journal().iter(), &self.logic.progress(), Durability::Process).unwrap();
    }

    fn review(&mut self, i: u8, action: u8) {
        let (review, from, to) = match action {
            0 => (Review::Release, [State::Held, State::Held], State::Accepted),
            1 => (Review::Reject, [State::Held, State::Held], State::Rejected),
            _ => (Review::Hold, [State::Accepted, State::Scheduled], State::Held),
        };
        let request = self.simple.requests.get_mut(usize::from(i));
        let may = request.as_ref().is_some_and(|it| from.contains(&it.state));
        assert_eq!(self.logic.review(StripId(u64::from(i) + 1), review, "ops", "").is_ok(), may);
        if let Some(request) = request.filter(|_| may) {
            request.state = to;
        }
    }

    fn end(&mut self, failure: Option<FailureReason>) {
        let Some((i, _)) = self.simple.flown else { return };
        let task = self.simple.task;
        let outcome = TaskOutcome { failure, max_attitude_error: 0.05, min_elevation: 0.5 };
        let (start, end) = (Tick(task * 300), Tick(task * 300 + 300));
        let strip = Some(StripId(i as u64 + 1));
        let record = TaskRecord { task, start, end, strip, duty: None, t_pre: 100, t_acq: 200, outcome };
        self.simple.end(failure);
        self.logic.on_decision_point(task + 1, end, std::slice::from_ref(&record));
        self.last = Some(record);
    }

    fn restart(&mut self) {
        self.store = Store::open(&self.folder.path().join("store.sqlite"), "trial").unwrap();
        let snapshot = self.store.snapshot().unwrap();
        let mut logic = empty();
        logic.restore(snapshot.requests, snapshot.rejected, snapshot.progress, snapshot.last_settled).unwrap();
        self.logic = logic;
    }

    fn compare(&self) {
        let expected: Vec<_> = self.simple.requests.iter().map(|it| it.state).collect();
        let given: Vec<_> = (1..=self.logic.len() as u64).filter_map(|id| self.logic.state(StripId(id))).collect();
        assert_eq!(given, expected);
        let imaged: u32 = self.simple.requests.iter().map(|it| it.imaged).sum();
        assert_eq!(self.logic.reward(), f64::from(imaged) * 0.5);
        assert!(self.simple.requests.iter().all(|it| it.imaged <= 1), "imaged twice");
        for state in State::ALL.into_iter().filter(|&state| state != State::Rejected) {
            assert_eq!(self.logic.count(state), expected.iter().filter(|&&it| it == state).count());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn the_request_manager_does_what_the_simple_model_does(operations in operations()) {
        let mut trial = Trial::new();
        for operation in &operations {
            trial.apply(operation);
            trial.compare();
        }
        trial.restart();
        trial.compare();
    }
}
