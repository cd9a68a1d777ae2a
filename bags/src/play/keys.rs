//! Keys pressed in the terminal, without waiting for Enter.

use std::io::{IsTerminal, Read};
use std::sync::mpsc::{Receiver, channel};

use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};

/// A key with a meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    /// Pauses and resumes.
    Space,
    /// Plays the next message while paused.
    Right,
    /// Faster.
    Up,
    /// Slower.
    Down,
}

/// The terminal in a state that gives each key at once; dropping it puts it back.
pub(super) struct Keys {
    before: Termios,
    keys: Receiver<Key>,
}

impl Keys {
    /// Listens to the terminal, if there is one.
    pub(super) fn listen() -> Option<Self> {
        let stdin = std::io::stdin();
        if !stdin.is_terminal() {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut direct = before.clone();
        direct.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        tcsetattr(&stdin, OptionalActions::Now, &direct).ok()?;
        let (sender, keys) = channel();
        std::thread::Builder::new()
            .name("keys".to_owned())
            .spawn(move || {
                let mut decoder = Decoder::default();
                for byte in std::io::stdin().lock().bytes().map_while(Result::ok) {
                    if let Some(key) = decoder.key(byte)
                        && sender.send(key).is_err()
                    {
                        return;
                    }
                }
            })
            .ok()?;
        Some(Self { before, keys })
    }

    /// The next key that was pressed.
    pub(super) fn next(&self) -> Option<Key> {
        self.keys.try_recv().ok()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        // A terminal that has gone needs no restoring.
        let _ = tcsetattr(std::io::stdin(), OptionalActions::Now, &self.before);
    }
}

/// Recognises keys in bytes: arrows are `ESC [ A` and on.
#[derive(Default)]
struct Decoder {
    last: [u8; 2],
}

impl Decoder {
    fn key(&mut self, byte: u8) -> Option<Key> {
        let before = self.last;
        self.last = [before[1], byte];
        match (before, byte) {
            ([0x1b, b'['], b'A') => Some(Key::Up),
            ([0x1b, b'['], b'B') => Some(Key::Down),
            ([0x1b, b'['], b'C') => Some(Key::Right),
            (_, b' ') => Some(Key::Space),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_are_three_bytes() {
        let mut decoder = Decoder::default();
        let keys: Vec<Key> = b"A \x1b[A[B\x1b[C\x1b[B".iter().filter_map(|b| decoder.key(*b)).collect();
        assert_eq!(keys, [Key::Space, Key::Up, Key::Right, Key::Down]);
    }
}
