//! The ledger as many threads use it: one writes, and each reader is woken when there is more.

use std::sync::{Arc, PoisonError, RwLock};

use tokio::sync::watch;

use crate::ledger::Ledger;

/// The ledger, and how many facts it has. Clones are the same one.
#[derive(Clone)]
pub struct Shared {
    ledger: Arc<RwLock<Ledger>>,
    count: Arc<watch::Sender<usize>>,
}

impl Default for Shared {
    fn default() -> Self {
        Self { ledger: Arc::default(), count: Arc::new(watch::Sender::new(0)) }
    }
}

impl Shared {
    /// Lets the ledger be changed, and wakes readers when there are more facts.
    pub fn update<T>(&self, change: impl FnOnce(&mut Ledger) -> T) -> T {
        let mut ledger = self.ledger.write().unwrap_or_else(PoisonError::into_inner);
        let done = change(&mut ledger);
        let count = ledger.last();
        drop(ledger);
        self.count.send_if_modified(|known| std::mem::replace(known, count) != count);
        done
    }

    /// Lets the ledger be read.
    pub fn read<T>(&self, look: impl FnOnce(&Ledger) -> T) -> T {
        look(&self.ledger.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Up to `limit` facts with greater numbers than `after`, as a JSON array, and the number of the last of them.
    #[must_use]
    pub fn batch(&self, after: usize, limit: usize) -> (usize, String) {
        self.read(|ledger| {
            let lines = ledger.after(after, limit);
            let mut text = String::with_capacity(2 + lines.iter().map(|line| line.len() + 1).sum::<usize>());
            text.push('[');
            for (i, line) in lines.iter().enumerate() {
                if i > 0 {
                    text.push(',');
                }
                text.push_str(line);
            }
            text.push(']');
            (after + lines.len(), text)
        })
    }

    /// Tells how many facts there are, whenever that changes.
    #[must_use]
    pub fn watch(&self) -> watch::Receiver<usize> {
        self.count.subscribe()
    }
}
