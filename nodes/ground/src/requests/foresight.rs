//! The ground's mirror beside the request manager, in a thread of its own: nothing waits for what it says.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use anyhow::{Context, Result};
use rustix::process::setpriority_process;
use swath_mission::approval::{Gate, GatedPlanner};
use swath_mission::fallback::{GuardedPlanner, Policies};
use swath_mission::file::Mission;
use swath_mission::link::told::Told;
use swath_mission::mirror::{Mirror, MirrorError, Prediction, Score};
use swath_mission::origin::Origin;
use swath_sim::time::{Tick, TickPeriod};

/// What is going to be, and how far what was predicted before came true.
#[derive(Clone, Debug)]
pub struct Foreseen {
    /// What the satellite is going to do.
    pub prediction: Prediction,
    /// What came down compared with what was predicted.
    pub score: Score,
}

/// What the mirror is told.
enum Feed {
    Told(Told),
    Predict(Tick),
}

/// The mirror's thread.
pub struct Foresight {
    feed: Sender<Feed>,
    foreseen: Receiver<Result<Foreseen, MirrorError>>,
    newest: Option<Arc<Foreseen>>,
}

impl Foresight {
    /// Starts the mirror of a mission with `[link]`; none where nothing is to be predicted.
    ///
    /// # Errors
    /// When the planner cannot be made, or the thread cannot be started.
    pub fn start(mission: &Mission, period: TickPeriod, policies: &Policies) -> Result<Option<Self>> {
        let hours = mission.link.as_ref().map_or(0.0, |link| link.predicts_h(mission.pace));
        // What another program's planner decides, nobody here knows.
        if hours <= 0.0 || mission.nodes.planner == Origin::External {
            return Ok(None);
        }
        let planner = GuardedPlanner::new((policies.make)(&mission.planner, mission.seed)?);
        let planner = GatedPlanner { gate: Gate::new(&mission.approval, period), planner };
        let (feed, fed) = channel();
        let (told, foreseen) = channel();
        let (mission, ticks) = (mission.clone(), u64::from(period.ticks_ceil(hours * 3600.0)));
        let run = move || {
            // Nobody waits for it: on Linux this is the priority of this thread alone.
            if let Err(error) = setpriority_process(None, 19) {
                tracing::debug!("the mirror's thread has the priority of its process: {error}");
            }
            let said = Mirror::new(&mission, Box::new(planner)).and_then(|mirror| look(mirror, ticks, &fed, &told));
            if let Err(error) = said {
                _ = told.send(Err(error));
            }
        };
        thread::Builder::new().name("mirror".to_owned()).spawn(run).context("cannot start the mirror's thread")?;
        Ok(Some(Self { feed, foreseen, newest: None }))
    }

    /// The ground is told something.
    pub fn tell(&self, told: &Told) {
        // One that has ended has said why.
        _ = self.feed.send(Feed::Told(told.clone()));
    }

    /// A prediction is wanted from a tick on; it comes when it is made, or a later one in its place.
    pub fn want(&self, now: Tick) {
        _ = self.feed.send(Feed::Predict(now));
    }

    /// What came since the last call.
    ///
    /// # Errors
    /// Why there is no prediction any more.
    pub fn take(&mut self) -> Result<Option<Arc<Foreseen>>, MirrorError> {
        let mut news = None;
        while let Ok(foreseen) = self.foreseen.try_recv() {
            news = Some(Arc::new(foreseen?));
        }
        self.newest = news.clone().or(self.newest.take());
        Ok(news)
    }

    /// What is going to be, as far as that is known.
    #[must_use]
    pub fn newest(&self) -> Option<&Arc<Foreseen>> {
        self.newest.as_ref()
    }
}

/// Tells the mirror all that there is, then lets it predict, until nobody feeds it any more.
fn look(
    mut mirror: Mirror,
    ticks: u64,
    fed: &Receiver<Feed>,
    told: &Sender<Result<Foreseen, MirrorError>>,
) -> Result<(), MirrorError> {
    while let Ok(first) = fed.recv() {
        let mut wanted = None;
        for feed in std::iter::once(first).chain(fed.try_iter()) {
            match feed {
                Feed::Told(it) => mirror.tell(&it)?,
                Feed::Predict(now) => wanted = wanted.max(Some(now)),
            }
        }
        if let Some(now) = wanted {
            let prediction = mirror.predict(now, ticks)?;
            if told.send(Ok(Foreseen { prediction, score: mirror.score().clone() })).is_err() {
                break;
            }
        }
    }
    Ok(())
}
