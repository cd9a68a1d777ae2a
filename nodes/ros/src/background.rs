//! The thread of a node that watches the domain and answers for its parameters.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll};
use std::thread::JoinHandle;
use std::time::Instant;

use futures_core::Stream as _;
use ros2_client::Gid;
use rustdds::{DomainParticipantStatusListener, RTPSEntity as _, StatusEvented as _};

use crate::dds::Dds;
use crate::endpoint::{RawSample, RawSubscription};
use crate::error::RosError;
use crate::health::{ASK_EVERY, Ailment, Health};
use crate::managed::LifecycleServices;
use crate::members::Identity;
use crate::message::decode_as;
use crate::minder::Minder;
use crate::node_services::NodeServices;
use crate::replies::AllReplies;
use crate::roster::Roster;
use crate::signal::{Signal, lock};

/// The running thread; dropping it ends it.
pub(crate) struct Background {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// Why a node has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// An older node of the same name has turned up.
    Namesake,
    /// The mission has a later start of this node: this one was taken for lost.
    Replaced,
    /// RustDDS does not answer any more.
    Deaf,
}

/// What the thread listens to.
pub(crate) struct Hearing {
    /// What DDS notices.
    pub(crate) listener: DomainParticipantStatusListener,
    /// What the other processes say of their nodes.
    pub(crate) announcements: RawSubscription,
    /// Who the other processes say that they are.
    pub(crate) identities: RawSubscription,
    /// Who this one is.
    pub(crate) own: Identity,
}

struct Shared {
    signal: Signal,
    node_signal: Signal,
    stop: AtomicBool,
    fault: Mutex<Option<Fault>>,
    dds: Arc<Dds>,
    roster: Arc<Roster>,
    minder: Arc<Minder>,
    replies: AllReplies,
    services: Mutex<Option<NodeServices>>,
    lifecycle: Mutex<Option<LifecycleServices>>,
}

impl Background {
    /// Starts the thread; `node_signal` is raised when it has become known who counts, and when the node has to go.
    pub(crate) fn start(
        mut hearing: Hearing,
        dds: Arc<Dds>,
        roster: Arc<Roster>,
        minder: Arc<Minder>,
        replies: AllReplies,
        node_signal: Signal,
    ) -> Result<Self, RosError> {
        let signal = Signal::new();
        hearing.announcements.set_signal(&signal);
        hearing.identities.set_signal(&signal);
        let shared = Arc::new(Shared {
            signal,
            node_signal,
            stop: AtomicBool::new(false),
            fault: Mutex::new(None),
            dds,
            roster,
            minder,
            replies,
            services: Mutex::new(None),
            lifecycle: Mutex::new(None),
        });
        let running = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("ros".to_owned())
            .spawn(move || running.run(hearing))
            .map_err(|source| RosError::System { what: "no thread for the node", source })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// From now on the thread answers for the parameters.
    pub(crate) fn serve(&self, mut services: NodeServices) {
        services.set_signal(&self.shared.signal);
        *lock(&self.shared.services) = Some(services);
        self.shared.signal.raise();
    }

    /// From now on the thread answers for the life cycle.
    pub(crate) fn manage(&self, services: LifecycleServices) {
        *lock(&self.shared.lifecycle) = Some(services);
        self.shared.signal.raise();
    }

    /// What wakes the thread.
    pub(crate) fn signal(&self) -> &Signal {
        &self.shared.signal
    }

    /// Why the node has to end, if it has to.
    pub(crate) fn fault(&self) -> Option<Fault> {
        *lock(&self.shared.fault)
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
        *lock(&self.shared.lifecycle) = None;
    }
}

impl Shared {
    fn run(&self, mut hearing: Hearing) {
        let (mut health, mut dropped) = (Health::new(), Dropped::default());
        while !self.stop.load(Ordering::Relaxed) {
            self.take_events(&hearing.listener);
            self.replies.release();
            let before = self.roster.revision();
            self.take_all(&hearing.announcements, |sample| self.roster.note_nodes(&sample.cdr));
            self.take_all(&hearing.identities, |sample| self.note_identity(&hearing.own, sample));
            if self.roster.revision() != before {
                // Messages may wait for their writer to become known.
                self.node_signal.raise();
            }
            if self.roster.must_yield() {
                self.fail(Fault::Namesake);
            }
            if let Some(services) = lock(&self.services).as_ref()
                && let Err(error) = services.serve()
            {
                tracing::warn!("parameters: {error}");
            }
            if let Some(lifecycle) = lock(&self.lifecycle).as_ref()
                && let Err(error) = lifecycle.serve()
            {
                tracing::warn!("life cycle: {error}");
            }
            if let Some(count) = dropped.news(|| self.dds.dropped()) {
                self.roster.note_dropped(count);
            }
            if let Some(ailment) = health.examine(&self.minder, &self.roster) {
                match self.renew(ailment) {
                    Ok(listener) => hearing.listener = listener,
                    Err(fault) => self.fail(fault),
                }
                (health, dropped) = (Health::after(health, ailment), Dropped::default());
            }
            self.signal.wait(ASK_EVERY);
        }
    }

    fn fail(&self, fault: Fault) {
        let mut known = lock(&self.fault);
        if known.is_none() {
            *known = Some(fault);
            self.node_signal.raise();
        }
    }

    /// Gives the node another participant, in whose place all its endpoints go on.
    fn renew(&self, ailment: Ailment) -> Result<DomainParticipantStatusListener, Fault> {
        if ailment == Ailment::Incurable {
            return Err(Fault::Deaf);
        }
        // What has panicked once may do so again when it is taken apart.
        let renewed = catch_unwind(AssertUnwindSafe(|| {
            self.roster.retire();
            self.dds.renew()
        }));
        let renewed = match renewed {
            Ok(Ok(renewed)) => renewed,
            Ok(Err(error)) => {
                tracing::error!("DDS cannot be started anew: {error}");
                return Err(Fault::Deaf);
            }
            Err(_) => return Err(Fault::Deaf),
        };
        let listener = renewed.participant.status_listener();
        self.roster.renew(Gid::from(renewed.participant.guid()), &renewed.gids);
        self.minder.turn_to(&renewed.participant);
        renewed.resume();
        self.roster.announce();
        self.roster.note_renewal(ailment.reason());
        self.node_signal.raise();
        Ok(listener)
    }

    fn take_events(&self, listener: &DomainParticipantStatusListener) {
        let waker = self.signal.waker();
        let mut context = Context::from_waker(&waker);
        let mut events = pin!(listener.as_async_status_stream());
        while let Poll::Ready(Some(event)) = events.as_mut().poll_next(&mut context) {
            self.roster.note_event(event);
        }
    }

    fn take_all(&self, subscription: &RawSubscription, mut note: impl FnMut(RawSample)) {
        loop {
            match subscription.take() {
                Ok(Some(sample)) => note(sample),
                Ok(None) => return,
                Err(error) => tracing::debug!("{error}"),
            }
        }
    }

    fn note_identity(&self, own: &Identity, sample: RawSample) {
        match decode_as::<Identity>("Identity", &sample.cdr) {
            Ok(identity) => {
                if identity.replaces(own) {
                    self.fail(Fault::Replaced);
                }
                self.roster.note_identity(sample.info.writer, identity);
            }
            Err(error) => tracing::debug!("another process introduces itself wrongly: {error}"),
        }
    }
}

/// How many datagrams were dropped when it was last looked.
#[derive(Default)]
struct Dropped {
    known: u64,
    looked: Option<Instant>,
}

impl Dropped {
    /// How many more there are, if it is time to look.
    fn news(&mut self, count: impl FnOnce() -> u64) -> Option<u64> {
        if self.looked.is_some_and(|looked| looked.elapsed() < ASK_EVERY) {
            return None;
        }
        self.looked = Some(Instant::now());
        let (before, now) = (self.known, count());
        self.known = now;
        Some(now.saturating_sub(before)).filter(|more| *more > 0)
    }
}
