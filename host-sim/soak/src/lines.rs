//! The four lines. That of the navigation computer compares output with input.

use crate::sensor::Port;
use core::cell::RefCell;
use firmware::link::{Full, Line, Lost};
use firmware::wire::framer::CAPACITY;
use heapless::Deque;

/// Most bytes that wait at a line.
pub const ROOM: usize = 2048;

/// Bytes on their way to the application.
#[derive(Debug, Default)]
pub struct Input {
    pub bytes: Deque<u8, ROOM>,
    /// The line reports a loss before it delivers them.
    pub lost: bool,
    /// Digest of the bytes sent on this line.
    pub digest: Digest,
}

impl Input {
    /// Receives bytes; those without room are lost.
    pub fn come(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.lost |= self.bytes.push_back(*byte).is_err();
        }
    }

    fn take(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if core::mem::take(&mut self.lost) {
            return Err(Lost);
        }
        let mut len = 0;
        for slot in buffer {
            let Some(byte) = self.bytes.pop_front() else {
                break;
            };
            *slot = byte;
            len += 1;
        }
        Ok(len)
    }
}

impl Line for Input {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.take(buffer)
    }

    fn is_idle(&self) -> bool {
        self.bytes.is_empty() && !self.lost
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.digest.add(message);
        Ok(())
    }
}

/// FNV-1a, 64 bit.
#[derive(Debug, Clone, Copy)]
pub struct Digest {
    pub value: u64,
    pub bytes: u64,
}

impl Default for Digest {
    fn default() -> Digest {
        Digest {
            value: 0xcbf2_9ce4_8422_2325,
            bytes: 0,
        }
    }
}

impl Digest {
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.value = (self.value ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        self.bytes += bytes.len() as u64;
    }
}

/// Bytes received from the sensor that have not left.
#[derive(Debug, Default)]
pub struct Passing {
    bytes: Deque<u8, { 4 * CAPACITY }>,
    /// The line had no room to note all bytes: a fault of the test itself.
    pub overrun: bool,
}

impl Passing {
    /// Bytes that the application has received.
    pub fn come(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.overrun |= self.bytes.push_back(*byte).is_err();
        }
    }

    /// A burst that the application has refused, and never sends.
    pub fn refused(&mut self) {
        self.bytes.clear();
    }
}

/// The application's end of the sensor line: received bytes are noted.
#[derive(Debug)]
pub struct Noted<'p, L> {
    pub line: L,
    pub passing: &'p RefCell<Passing>,
}

impl<L: Line> Line for Noted<'_, L> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let len = self.line.receive(buffer)?;
        let received = buffer.get(..len).unwrap_or_default();
        self.passing.borrow_mut().come(received);
        Ok(len)
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.line.send(message)
    }
}

/// The longest message.
const LONGEST: usize = 256;

/// The navigation computer's line.
#[derive(Debug)]
pub struct OutputLine<'p> {
    pub input: Input,
    pub passing: &'p RefCell<Passing>,
    /// It is full.
    pub full: bool,
    /// Nothing may be changed at present.
    pub exact: bool,
    pub seen: MessageCounts,
    port: Port,
    /// Digest of the bytes sent.
    pub digest: Digest,
}

/// Counts of the messages on the line.
#[derive(Debug, Clone, Copy, Default)]
pub struct MessageCounts {
    /// Messages that left unchanged, and that were changed.
    pub same: u64,
    pub changed: u64,
    /// Changed messages that are not frames, before or after the change.
    pub wrong: u64,
    /// Frames that were changed where nothing should be.
    pub inexact: u64,
    /// Bytes that were not received.
    pub made_up: u64,
    /// Messages that found no room.
    pub full: u64,
}

impl<'p> OutputLine<'p> {
    /// A line for the frames or bursts of this port.
    pub fn new(passing: &'p RefCell<Passing>, port: Port) -> OutputLine<'p> {
        OutputLine {
            input: Input::default(),
            passing,
            full: false,
            exact: true,
            seen: MessageCounts::default(),
            port,
            digest: Digest::default(),
        }
    }

    /// Bytes received that have not left.
    pub fn inside(&self) -> usize {
        self.passing.borrow().bytes.len()
    }

    fn compare(&mut self, message: &[u8]) {
        let mut came = [0; LONGEST];
        let mut passing = self.passing.borrow_mut();
        let mut differ = 0;
        for (slot, byte) in came.iter_mut().zip(message) {
            match passing.bytes.pop_front() {
                Some(was) => {
                    *slot = was;
                    differ += u64::from(was != *byte);
                }
                None => self.seen.made_up += 1,
            }
        }
        if differ == 0 {
            self.seen.same += 1;
            return;
        }
        let mut left = [0; LONGEST];
        for (slot, byte) in left.iter_mut().zip(message) {
            *slot = *byte;
        }
        let len = message.len().min(LONGEST);
        let port = self.port;
        let is_frame = |bytes: &mut [u8; LONGEST]| {
            let frame = bytes.get_mut(..len);
            frame.is_some_and(|frame| port.is_frame(frame))
        };
        if !is_frame(&mut came) || !is_frame(&mut left) {
            self.seen.wrong += 1;
        } else if self.exact {
            self.seen.inexact += 1;
        } else {
            self.seen.changed += 1;
        }
    }
}

impl Line for OutputLine<'_> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.input.take(buffer)
    }

    fn is_idle(&self) -> bool {
        self.input.is_idle()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.compare(message);
        if self.full {
            self.seen.full += 1;
            return Err(Full);
        }
        self.digest.add(message);
        Ok(())
    }
}
