//! The facts as server-sent events: batches in order, from where the reader was, for as long as it reads.

use std::sync::Arc;
use std::time::{Duration, Instant};

use http_body_util::channel::{Channel, Sender};
use hyper::body::Bytes;
use tokio::sync::OwnedSemaphorePermit;

use crate::guests::Guest;
use crate::shared::Shared;

/// The media type of server-sent events.
pub const MEDIA_TYPE: &str = "text/event-stream";
/// Facts of one event.
const BATCH: usize = 2000;
/// Between events to a reader that has read everything: ten a second.
const PAUSE: Duration = Duration::from_millis(100);
/// Readers at a time, of the connections that there are: others find room whoever reads.
pub const READERS: usize = 192;
/// How long a reader may take to read what was sent before it is sent away; it comes back where it was.
const STUCK: Duration = Duration::from_secs(60);
/// A reader that is gone is noticed when something is written to it; as often it is looked whether it still may read.
const SIGN_OF_LIFE: Duration = Duration::from_secs(5);

/// Where a reader was: how many facts it has read in which run of the server.
#[must_use]
pub fn place(last_event_id: Option<&str>, run: &str) -> Option<usize> {
    let (of, count) = last_event_id?.rsplit_once('.')?;
    if of == run { count.parse().ok() } else { None }
}

/// One who reads, for as long as it does.
pub struct Reader {
    /// The room that it takes.
    pub room: OwnedSemaphorePermit,
    /// Its connection.
    pub guest: Option<Arc<Guest>>,
    /// Whether it may still read: tokens end, or are revoked.
    pub admitted: Box<dyn Fn() -> bool + Send + Sync>,
}

/// The body of an answer that tells the facts after `after`; a reader that was elsewhere begins anew.
pub fn body(shared: Shared, run: String, after: Option<usize>, reader: Reader) -> Channel<Bytes> {
    let (sender, body) = Channel::new(1);
    tokio::spawn(async move {
        tell(shared, run, after, sender, &reader.admitted).await;
        drop(reader.room);
        // Its connection may never take what is still to be sent.
        if let Some(guest) = reader.guest {
            guest.waits();
        }
    });
    body
}

/// Whether a reader has taken what it is sent.
async fn send(sender: &mut Sender<Bytes>, text: Bytes) -> bool {
    matches!(tokio::time::timeout(STUCK, sender.send_data(text)).await, Ok(Ok(())))
}

async fn tell(
    shared: Shared,
    run: String,
    after: Option<usize>,
    mut sender: Sender<Bytes>,
    admitted: &(dyn Fn() -> bool + Send + Sync),
) {
    let mut news = shared.watch();
    let known = after.filter(|after| *after <= *news.borrow_and_update());
    let mut at = known.unwrap_or(0);
    // Data is needed for an event to count.
    let greeting = if known.is_some() { ": here you are\n\n" } else { "event: restart\ndata: 0\n\n" };
    if !send(&mut sender, Bytes::from_static(greeting.as_bytes())).await {
        return;
    }
    let mut looked = Instant::now();
    loop {
        if looked.elapsed() >= SIGN_OF_LIFE {
            looked = Instant::now();
            if !admitted() {
                return;
            }
        }
        let (last, facts) = shared.batch(at, BATCH);
        if last > at {
            let event = format!("event: facts\nid: {run}.{last}\ndata: {facts}\n\n");
            if !send(&mut sender, event.into()).await {
                return;
            }
            if last - at < BATCH {
                tokio::time::sleep(PAUSE).await;
            }
            at = last;
            continue;
        }
        match tokio::time::timeout(SIGN_OF_LIFE, news.changed()).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return,
            Err(_) => {
                if !send(&mut sender, Bytes::from_static(b": still here\n\n")).await {
                    return;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::place;

    #[test]
    fn a_place_counts_in_its_own_run() {
        assert_eq!(place(Some("17.42"), "17"), Some(42));
        assert_eq!(place(Some("16.42"), "17"), None);
        for nonsense in ["", "42", "17.", "17.-1", "17.x"] {
            assert_eq!(place(Some(nonsense), "17"), None, "{nonsense}");
        }
        assert_eq!(place(None, "17"), None);
    }
}
