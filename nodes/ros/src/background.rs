//! The thread of a node that watches the domain and answers for its parameters.

use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::thread::JoinHandle;
use std::time::Duration;

use futures_core::Stream as _;
use rustdds::{DomainParticipant, DomainParticipantStatusListener, StatusEvented as _};

use crate::endpoint::RawSubscription;
use crate::error::RosError;
use crate::param_services::ParameterServices;
use crate::roster::Roster;
use crate::signal::{Signal, lock};

/// The running thread; dropping it ends it.
pub(crate) struct Background {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    signal: Signal,
    node_signal: Signal,
    stop: AtomicBool,
    must_yield: AtomicBool,
    roster: Arc<Roster>,
    services: Mutex<Option<ParameterServices>>,
}

impl Background {
    /// Starts the thread. `announcements` is the subscription to what the other processes say of
    /// their nodes; `node_signal` is raised when the node has to go.
    pub(crate) fn start(
        participant: &DomainParticipant,
        roster: Arc<Roster>,
        mut announcements: RawSubscription,
        node_signal: Signal,
    ) -> Result<Self, RosError> {
        let signal = Signal::new();
        announcements.set_signal(&signal);
        let shared = Arc::new(Shared {
            signal,
            node_signal,
            stop: AtomicBool::new(false),
            must_yield: AtomicBool::new(false),
            roster,
            services: Mutex::new(None),
        });
        let (listener, running) = (participant.status_listener(), Arc::clone(&shared));
        let thread = std::thread::Builder::new()
            .name("ros".to_owned())
            .spawn(move || running.run(&listener, &announcements))
            .map_err(|source| RosError::System { what: "no thread for the node", source })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// From now on the thread answers for the parameters.
    pub(crate) fn serve(&self, mut services: ParameterServices) {
        services.set_signal(&self.shared.signal);
        *lock(&self.shared.services) = Some(services);
        self.shared.signal.raise();
    }

    /// Whether an older node of the same name has turned up.
    pub(crate) fn must_yield(&self) -> bool {
        self.shared.must_yield.load(Ordering::Relaxed)
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.signal.raise();
        if let Some(thread) = self.thread.take() {
            // A panic over there has been printed already.
            drop(thread.join());
        }
        *lock(&self.shared.services) = None;
    }
}

impl Shared {
    fn run(&self, listener: &DomainParticipantStatusListener, announcements: &RawSubscription) {
        while !self.stop.load(Ordering::Relaxed) {
            self.take_events(listener);
            self.take_announcements(announcements);
            if self.roster.must_yield() && !self.must_yield.swap(true, Ordering::Relaxed) {
                self.node_signal.raise();
            }
            if let Some(services) = lock(&self.services).as_ref()
                && let Err(error) = services.serve()
            {
                tracing::warn!("parameters: {error}");
            }
            self.signal.wait(Duration::from_secs(1));
        }
    }

    fn take_events(&self, listener: &DomainParticipantStatusListener) {
        let waker = self.signal.waker();
        let mut context = Context::from_waker(&waker);
        let mut events = pin!(listener.as_async_status_stream());
        while let Poll::Ready(Some(event)) = events.as_mut().poll_next(&mut context) {
            self.roster.note_event(event);
        }
    }

    fn take_announcements(&self, announcements: &RawSubscription) {
        loop {
            match announcements.take() {
                Ok(Some(sample)) => self.roster.note_nodes(&sample.cdr),
                Ok(None) => return,
                Err(error) => tracing::debug!("{error}"),
            }
        }
    }
}
