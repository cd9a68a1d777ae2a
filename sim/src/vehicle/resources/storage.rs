//! On-board storage: files of images in whole bits, and which of them is sent next.

use crate::config::resources::DownlinkOrder;
use crate::world::strip::StripId;

/// An image on its way to the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageFile {
    /// The strip.
    pub strip: StripId,
    /// Bits recorded.
    pub recorded: u64,
    /// Bits sent; they are no longer stored.
    pub sent: u64,
    /// What it is worth on the ground.
    pub worth: f64,
}

impl ImageFile {
    /// Bits that are stored.
    #[must_use]
    pub fn stored(&self) -> u64 {
        self.recorded - self.sent
    }
}

/// Bits that came, went and stayed since the epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DataBooks {
    /// What the imager made.
    pub imaged: u64,
    /// What came to the ground.
    pub sent: u64,
    /// What found no room.
    pub dropped: u64,
    /// What was thrown away: images that failed or have a gap.
    pub discarded: u64,
}

/// Files up to a capacity.
#[derive(Clone, Debug)]
pub struct Storage {
    capacity: u64,
    stored: u64,
    /// The image that is being recorded, and whether some of it found no room.
    recording: Option<(ImageFile, bool)>,
    /// Images that wait, by their age.
    waiting: Vec<ImageFile>,
    /// The image that is being sent.
    sending: Option<ImageFile>,
    books: DataBooks,
}

impl Storage {
    /// An empty storage of a capacity [bit].
    #[must_use]
    pub fn new(capacity: u64) -> Self {
        Self { capacity, stored: 0, recording: None, waiting: Vec::new(), sending: None, books: DataBooks::default() }
    }

    /// Takes what the imager made of a strip in a tick, all of it or nothing. Says whether there was room.
    pub fn record(&mut self, strip: StripId, bits: u64) -> bool {
        if self.recording.is_none_or(|(file, _)| file.strip != strip) {
            self.discard();
            self.recording = Some((ImageFile { strip, recorded: 0, sent: 0, worth: 0.0 }, false));
        }
        self.books.imaged += bits;
        let room = self.stored.checked_add(bits).is_some_and(|sum| sum <= self.capacity);
        if let Some((file, gap)) = &mut self.recording {
            if room {
                file.recorded += bits;
                self.stored += bits;
            } else {
                self.books.dropped += bits;
                *gap = true;
            }
        }
        room
    }

    /// Ends the recording: an image that is worth something and has no gap waits to be sent, others are thrown away.
    /// Says whether it is kept.
    pub fn keep(&mut self, worth: f64) -> bool {
        match self.recording {
            Some((file, false)) if worth > 0.0 => {
                self.recording = None;
                self.waiting.push(ImageFile { worth, ..file });
                true
            }
            _ => {
                self.discard();
                false
            }
        }
    }

    /// Throws the recording away.
    pub fn discard(&mut self) {
        if let Some((file, _)) = self.recording.take() {
            self.stored -= file.recorded;
            self.books.discarded += file.recorded;
        }
    }

    /// Sends up to so many bits, file after file; each one whose last bit is sent goes to `delivered`. Says how many
    /// bits were sent.
    pub fn send(&mut self, bits: u64, order: DownlinkOrder, mut delivered: impl FnMut(ImageFile)) -> u64 {
        let mut left = bits;
        while left > 0 {
            let Some(mut file) = self.sending.take().or_else(|| self.choose(order)) else { break };
            let now = file.stored().min(left);
            file.sent += now;
            left -= now;
            if file.stored() == 0 {
                delivered(file);
            } else {
                self.sending = Some(file);
            }
        }
        let sent = bits - left;
        self.stored -= sent;
        self.books.sent += sent;
        sent
    }

    fn choose(&mut self, order: DownlinkOrder) -> Option<ImageFile> {
        let worth_a_bit = |file: &ImageFile| file.worth / file.recorded.max(1) as f64;
        let index = match order {
            DownlinkOrder::Oldest => 0,
            // The older one of equals.
            DownlinkOrder::Worth => {
                let mut best = 0;
                for (index, file) in self.waiting.iter().enumerate().skip(1) {
                    let best_file = self.waiting.get(best)?;
                    if worth_a_bit(file) > worth_a_bit(best_file) {
                        best = index;
                    }
                }
                best
            }
        };
        (index < self.waiting.len()).then(|| self.waiting.remove(index))
    }

    /// Bits stored.
    #[must_use]
    pub fn stored(&self) -> u64 {
        self.stored
    }

    /// Bits that wait to be sent.
    #[must_use]
    pub fn to_send(&self) -> u64 {
        self.stored - self.recording.map_or(0, |(file, _)| file.recorded)
    }

    /// Bits that there is room for in all.
    #[must_use]
    pub fn capacity(&self) -> u64 {
        self.capacity
    }

    /// What came, went and stayed.
    #[must_use]
    pub fn books(&self) -> &DataBooks {
        &self.books
    }

    /// Whether the books close: what was imaged was sent, dropped, discarded, or is stored in some file.
    #[must_use]
    pub fn books_close(&self) -> bool {
        let recording = self.recording.map(|(file, _)| file);
        let files = self.waiting.iter().chain(&self.sending).chain(&recording);
        let in_files: u64 = files.map(ImageFile::stored).sum();
        let books = &self.books;
        in_files == self.stored && books.imaged == books.sent + books.dropped + books.discarded + self.stored
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_file_is_delivered_with_its_last_bit_and_the_worthiest_goes_first() {
        let mut storage = Storage::new(100);
        for (strip, bits, worth) in [(1, 20, 0.2), (2, 30, 0.9), (3, 10, 0.1)] {
            assert!(storage.record(StripId(strip), bits));
            assert!(storage.keep(worth));
        }
        let mut delivered = Vec::new();
        assert_eq!(storage.send(29, DownlinkOrder::Worth, |file| delivered.push(file.strip.0)), 29);
        assert!(delivered.is_empty());
        assert_eq!(storage.send(21, DownlinkOrder::Worth, |file| delivered.push(file.strip.0)), 21);
        assert_eq!(delivered, [2, 1], "two at 0.03 a bit, one at 0.01; the third ties with the first and is younger");
        assert_eq!(storage.send(50, DownlinkOrder::Worth, |file| delivered.push(file.strip.0)), 10);
        assert_eq!((delivered.as_slice(), storage.stored()), ([2, 1, 3].as_slice(), 0));
        assert!(storage.books_close());
    }

    #[test]
    fn an_image_with_a_gap_or_without_worth_is_thrown_away() {
        let mut storage = Storage::new(10);
        assert!(storage.record(StripId(1), 8));
        assert!(!storage.record(StripId(1), 8), "dropped whole, not filled up");
        assert!(storage.record(StripId(1), 2));
        assert!(!storage.keep(1.0));
        assert!(storage.record(StripId(2), 5));
        assert!(!storage.keep(0.0));
        let wanted = DataBooks { imaged: 23, sent: 0, dropped: 8, discarded: 15 };
        assert_eq!((storage.books(), storage.stored()), (&wanted, 0));
        assert!(!storage.keep(1.0), "nothing was recorded");
        assert!(storage.books_close());
    }

    proptest! {
        #[test]
        fn the_books_close_whatever_happens(steps in prop::collection::vec((0u8..5, 0u64..50), 1..300)) {
            let mut storage = Storage::new(200);
            let mut delivered = 0;
            for (step, number) in steps {
                match step {
                    0 | 1 => _ = storage.record(StripId(number / 10), number),
                    2 => _ = storage.keep(number as f64 / 50.0),
                    3 => storage.discard(),
                    _ => _ = storage.send(number, DownlinkOrder::Worth, |file| delivered += file.recorded),
                }
                prop_assert!(storage.books_close());
                prop_assert!(storage.stored() <= 200 && delivered <= storage.books().sent);
            }
        }
    }
}
