//! A node through its life: it comes up active by itself, and rests, goes on or ends when it is asked to.

use std::rc::Rc;
use std::time::Duration;

use anyhow::{Error, Result, bail};
use swath_ros::lifecycle::{State, Transition};

use crate::node::MissionNode;
use crate::out;

/// Nothing happens by itself: a node that is not configured only looks whether something is asked of it.
const IDLE: Duration = Duration::from_millis(500);

/// A node that is configured.
pub trait LifecycleNode: Sized {
    /// It works from now on.
    ///
    /// # Errors
    /// When it cannot: it stays inactive.
    fn activate(&mut self) -> Result<()> {
        Ok(())
    }

    /// It does not work from now on.
    ///
    /// # Errors
    /// When it cannot stop: it stays active.
    fn deactivate(&mut self) -> Result<()> {
        Ok(())
    }

    /// Once round its main loop while it is active; it waits for news.
    ///
    /// # Errors
    /// When it has to end.
    fn turn(&mut self) -> Result<()>;

    /// Once round its main loop while it is inactive; it waits for news.
    ///
    /// # Errors
    /// When it has to end.
    fn rest(&mut self) -> Result<()>;

    /// It leaves what it has.
    ///
    /// # Errors
    /// When something may be lost.
    fn end(self) -> Result<()> {
        Ok(())
    }
}

/// Runs a node until it is asked to end, by a signal or by the transition `shutdown`.
///
/// With its parameter `autostart` it is configured and activated at once.
///
/// # Errors
/// When it cannot be configured or activated at its start, or has to end.
pub fn run<N: LifecycleNode>(base: MissionNode, configure: impl Fn(&Rc<MissionNode>) -> Result<N>) -> Result<()> {
    let mut life = Life { base: Rc::new(base), configure, own: None, fault: None };
    let outcome = life.live();
    // What it has is left in order whatever it ends of.
    outcome.and(life.own.take().map_or(Ok(()), N::end))
}

struct Life<N, C> {
    base: Rc<MissionNode>,
    configure: C,
    own: Option<N>,
    /// Why the last transition failed.
    fault: Option<Error>,
}

impl<N: LifecycleNode, C: Fn(&Rc<MissionNode>) -> Result<N>> Life<N, C> {
    fn live(&mut self) -> Result<()> {
        let base = Rc::clone(&self.base);
        for label in ["configure", "activate"].into_iter().filter(|_| base.autostart) {
            if !base.lifecycle.take(label, |transition| self.act(transition))? {
                return self.fault.take().map_or(Ok(()), Err);
            }
        }
        while !base.shutdown.asked() {
            base.lifecycle.serve(|transition| {
                tracing::info!("told to {}", transition.label);
                let done = self.act(transition);
                if let Some(fault) = self.fault.take() {
                    tracing::error!("{} is refused: {}", transition.label, out::chain(&fault));
                }
                done
            })?;
            match (base.lifecycle.state(), &mut self.own) {
                (State::Finalized, _) => break,
                (State::Active, Some(own)) => own.turn()?,
                (_, Some(own)) => own.rest()?,
                (_, None) => _ = base.wait(IDLE)?,
            }
        }
        Ok(())
    }

    /// Does a node's part of a transition, and tells whether it was done.
    fn act(&mut self, transition: &Transition) -> bool {
        let done = match (transition.goal, &mut self.own) {
            (State::Configuring, _) => (self.configure)(&self.base).map(|own| self.own = Some(own)),
            (State::Activating, Some(own)) => own.activate(),
            (State::Deactivating, Some(own)) => own.deactivate(),
            (State::CleaningUp, _) => self.clean_up(),
            (State::ShuttingDown, _) => self.own.take().map_or(Ok(()), N::end),
            _ => Ok(()),
        };
        self.fault = done.err();
        self.fault.is_none()
    }

    fn clean_up(&mut self) -> Result<()> {
        if !self.base.keeps_something() {
            bail!("parameter `keep` is not set: what this node knows of the flight would be lost");
        }
        self.base.goes_on_from_here();
        self.own.take().map_or(Ok(()), N::end)
    }
}
