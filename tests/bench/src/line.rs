//! A serial line in memory.

use firmware::link::{Full, Line, Lost};
use std::collections::VecDeque;

/// A line that retains what is sent over it. With [`Default`] it is always idle or has bytes, takes
/// all messages, and loses nothing.
#[derive(Debug)]
pub struct MockLine {
    /// Bytes that the application has not received yet.
    pub input: VecDeque<u8>,
    /// Most bytes a call of `receive` gives.
    pub piece: usize,
    /// Every message sent, one by one.
    pub sent: Vec<Vec<u8>>,
    /// Room left, bytes.
    pub room: usize,
    /// The line reports a loss before the next bytes.
    pub lost: bool,
    /// The line never says that it is idle.
    pub never_idle: bool,
}

impl Default for MockLine {
    fn default() -> MockLine {
        MockLine {
            input: VecDeque::new(),
            piece: usize::MAX,
            sent: Vec::new(),
            room: usize::MAX,
            lost: false,
            never_idle: false,
        }
    }
}

impl MockLine {
    /// All bytes sent.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.sent.concat()
    }
}

impl Line for MockLine {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if std::mem::take(&mut self.lost) {
            return Err(Lost);
        }
        let len = buffer.len().min(self.input.len()).min(self.piece);
        for (slot, byte) in buffer.iter_mut().zip(self.input.drain(..len)) {
            *slot = byte;
        }
        Ok(len)
    }

    fn is_idle(&self) -> bool {
        self.input.is_empty() && !self.lost && !self.never_idle
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if message.len() > self.room {
            return Err(Full);
        }
        self.room -= message.len();
        if !message.is_empty() {
            self.sent.push(message.to_vec());
        }
        Ok(())
    }
}
