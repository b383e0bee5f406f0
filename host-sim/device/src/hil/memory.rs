//! Lines and a clock in memory, for the application on the desktop.

use firmware::link::{Clock, Full, Line, Lost};
use std::collections::VecDeque;

/// A line in memory.
#[derive(Debug, Default)]
pub struct MemoryLine {
    /// Bytes that the application has not received yet.
    pub received: VecDeque<u8>,
    /// Bytes that it has sent.
    pub sent: Vec<u8>,
}

impl Line for MemoryLine {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let len = buffer.len().min(self.received.len());
        for (slot, byte) in buffer.iter_mut().zip(self.received.drain(..len)) {
            *slot = byte;
        }
        Ok(len)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.sent.extend_from_slice(message);
        Ok(())
    }
}

/// A clock that its owner sets, microseconds.
#[derive(Debug, Default)]
pub struct SetClock(pub u64);

impl Clock for SetClock {
    fn now_us(&self) -> u64 {
        self.0
    }
}
