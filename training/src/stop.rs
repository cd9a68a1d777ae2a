//! The wish to stop, as it reaches into the middle of an update.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Result, TrainingError};

/// A wish that is uttered once and seen by everyone who holds a copy.
#[derive(Debug, Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Utters it.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was uttered.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Goes on only without it.
    ///
    /// # Errors
    /// [`TrainingError::Stopped`] once it was uttered.
    pub fn check(&self) -> Result<()> {
        if self.is_requested() { Err(TrainingError::Stopped) } else { Ok(()) }
    }
}
