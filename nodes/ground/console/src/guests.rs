//! Connections that are open: those that only wait make room for new ones, the longest waiting first.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::task::AbortHandle;

/// Everybody who is connected.
#[derive(Clone)]
pub struct Guests {
    places: Arc<Semaphore>,
    present: Arc<Mutex<Present>>,
}

#[derive(Default)]
struct Present {
    /// Counts what happens.
    turn: u64,
    /// How to send each away, and since which turn they wait; not those whose request is at work.
    guests: HashMap<u64, (AbortHandle, Option<u64>)>,
}

/// One who is connected; gone when it is dropped.
pub struct Guest {
    all: Guests,
    number: u64,
    _place: OwnedSemaphorePermit,
}

impl Guests {
    /// Room for so many at a time.
    #[must_use]
    pub fn new(places: usize) -> Self {
        Self { places: Arc::new(Semaphore::new(places)), present: Arc::default() }
    }

    /// Runs a conversation on a task of its own; where there is no room, whoever has waited longest is sent away first.
    pub async fn welcome<F>(&self, converse: impl FnOnce(Arc<Guest>) -> F)
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let place = match Arc::clone(&self.places).try_acquire_owned() {
            Ok(place) => place,
            Err(_) => {
                self.make_room();
                // The semaphore is never closed.
                let Ok(place) = Arc::clone(&self.places).acquire_owned().await else { return };
                place
            }
        };
        let number = self.turn();
        let task = tokio::spawn(converse(Arc::new(Guest { all: self.clone(), number, _place: place })));
        let present = &mut *self.lock();
        // Who is gone already has dropped its guest, and is not entered again.
        if !task.is_finished() {
            present.guests.insert(number, (task.abort_handle(), Some(number)));
        }
    }

    fn make_room(&self) {
        let longest = {
            let present = &mut *self.lock();
            let waiting = present.guests.iter().filter_map(|(number, (_, since))| Some((since.as_ref()?, number)));
            let number = waiting.min().map(|(_, number)| *number);
            number.and_then(|number| present.guests.remove(&number))
        };
        if let Some((task, _)) = longest {
            task.abort();
        }
    }

    fn turn(&self) -> u64 {
        let present = &mut *self.lock();
        present.turn += 1;
        present.turn
    }

    fn lock(&self) -> MutexGuard<'_, Present> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Guest {
    /// Its request is at work: it stays.
    pub fn busy(&self) {
        self.set(None);
    }

    /// It waits again.
    pub fn waits(&self) {
        let turn = self.all.turn();
        self.set(Some(turn));
    }

    fn set(&self, since: Option<u64>) {
        if let Some((_, waits)) = self.all.lock().guests.get_mut(&self.number) {
            *waits = since;
        }
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        self.all.lock().guests.remove(&self.number);
    }
}
