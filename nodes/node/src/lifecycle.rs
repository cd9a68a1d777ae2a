//! A node through its life: it comes up active by itself, and rests, goes on or ends when it is asked to.

use std::rc::Rc;
use std::time::Duration;

use anyhow::{Error, Result, bail};
use swath_ros::lifecycle::{State, Transition};
use swath_ros::{Managed, Shutdown};

use crate::node::MissionNode;
use crate::out;

/// Nothing happens by itself: a node that is not configured only looks whether something is asked of it.
const IDLE: Duration = Duration::from_millis(500);

/// A node that is configured.
pub trait LifecycleNode: Sized {
    /// What it was configured with.
    fn base(&self) -> &MissionNode;

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

    /// It leaves what it has, and gives back what it was configured with.
    ///
    /// # Errors
    /// When something may be lost.
    fn end(self) -> Result<MissionNode>;
}

/// Runs a node until it is asked to end, by a signal or by the transition `shutdown`.
///
/// With its parameter `autostart` it is configured and activated at once.
///
/// # Errors
/// When it cannot be configured, or activated at its start, or has to end.
pub fn run<N: LifecycleNode>(base: MissionNode, configure: impl Fn(MissionNode) -> Result<N>) -> Result<()> {
    let (lifecycle, shutdown, autostart) = (Rc::clone(&base.lifecycle), base.shutdown.clone(), base.autostart);
    let mut life = Life { lifecycle, shutdown, configure, held: Held::Base(Box::new(base)), fault: None };
    let outcome = life.live(autostart);
    // What it has is left in order whatever it ends of.
    outcome.and(life.end())
}

struct Life<N, C> {
    lifecycle: Rc<Managed>,
    shutdown: Shutdown,
    configure: C,
    held: Held<N>,
    /// Why the last transition failed.
    fault: Option<Error>,
}

/// What there is of a node.
enum Held<N> {
    /// It is not configured.
    Base(Box<MissionNode>),
    /// It is configured.
    Node(N),
    /// It could not be configured, or has ended.
    Nothing,
}

impl<N: LifecycleNode, C: Fn(MissionNode) -> Result<N>> Life<N, C> {
    fn live(&mut self, autostart: bool) -> Result<()> {
        let (lifecycle, shutdown) = (Rc::clone(&self.lifecycle), self.shutdown.clone());
        for label in ["configure", "activate"].into_iter().filter(|_| autostart) {
            if let Held::Node(node) = &self.held {
                node.base().wait_for_recorder()?;
            }
            if !lifecycle.take(label, |transition| self.act(transition))? {
                return self.fault.take().map_or(Ok(()), Err);
            }
        }
        while !shutdown.asked() && lifecycle.state() != State::Finalized {
            lifecycle.serve(|transition| self.follow(transition))?;
            match (lifecycle.state(), &mut self.held) {
                (State::Active, Held::Node(node)) => node.turn()?,
                (_, Held::Node(node)) => node.rest()?,
                (_, Held::Base(base)) => _ = base.wait(IDLE)?,
                (_, Held::Nothing) => return self.fault.take().map_or(Ok(()), Err),
            }
        }
        Ok(())
    }

    /// Does a transition that was asked for, and tells whether it was done; what went wrong is told unless it ends the
    /// node.
    fn follow(&mut self, transition: &Transition) -> bool {
        tracing::info!("told to {}", transition.label);
        let done = self.act(transition);
        if !matches!(self.held, Held::Nothing)
            && let Some(fault) = self.fault.take()
        {
            tracing::error!("{} is refused: {}", transition.label, out::chain(&fault));
        }
        done
    }

    /// Does a node's part of a transition, and tells whether it was done.
    fn act(&mut self, transition: &Transition) -> bool {
        let done = match (transition.goal, &mut self.held) {
            (State::Configuring, Held::Base(_)) => self.configure(),
            (State::Activating, Held::Node(node)) => node.activate(),
            (State::Deactivating, Held::Node(node)) => node.deactivate(),
            (State::CleaningUp, _) => self.clean_up(),
            (State::ShuttingDown, _) => self.end(),
            _ => Ok(()),
        };
        self.fault = done.err();
        self.fault.is_none()
    }

    fn configure(&mut self) -> Result<()> {
        if let Held::Base(base) = std::mem::replace(&mut self.held, Held::Nothing) {
            self.held = Held::Node((self.configure)(*base)?);
        }
        Ok(())
    }

    fn clean_up(&mut self) -> Result<()> {
        if let Held::Node(node) = &self.held {
            if !node.base().keeps_something() {
                bail!("parameter `keep` is not set: what this node knows of the flight would be lost");
            }
            node.base().goes_on_from_here();
        }
        self.end()
    }

    fn end(&mut self) -> Result<()> {
        self.held = match std::mem::replace(&mut self.held, Held::Nothing) {
            Held::Node(node) => Held::Base(Box::new(node.end()?)),
            held => held,
        };
        Ok(())
    }
}
