//! The serial lines of the replayed application, and its clock.

use firmware::link::progress::{NoStream, Progress};
use firmware::link::uart::{Port, Uart};
use firmware::link::{Full, Line, Lost};
use heapless::Vec;

use super::LONGEST;

/// An input line: it delivers the bytes of the recording and discards what the application sends.
/// It is as cheap as a board's line, because its cost is counted with the application's.
#[derive(Debug, Default)]
pub struct Feed {
    bytes: Vec<u8, LONGEST>,
    taken: usize,
}

impl Feed {
    /// Provides `bytes`; the previous ones have been taken.
    pub(super) fn provide(&mut self, bytes: &[u8]) {
        self.bytes.clear();
        self.taken = 0;
        let _ = self.bytes.extend_from_slice(bytes); // fits: a record is no longer
    }
}

impl Line for Feed {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let left = self.bytes.get(self.taken..).unwrap_or_default();
        let taken = left.len().min(buffer.len());
        for (slot, byte) in buffer.iter_mut().zip(left) {
            *slot = *byte;
        }
        self.taken += taken;
        Ok(taken)
    }

    fn is_idle(&self) -> bool {
        self.taken == self.bytes.len()
    }

    fn send(&mut self, _: &[u8]) -> Result<(), Full> {
        Ok(())
    }
}

/// The navigation line: notes when the first and the last message began to leave.
#[derive(Debug)]
pub(super) struct Tap<'u, S> {
    pub(super) port: Port<'u, S>,
    pub(super) first: Option<u32>,
    pub(super) last: u32,
    pub(super) ticks: fn() -> u32,
}

impl<S: Progress> Line for Tap<'_, S> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        self.port.receive(buffer)
    }

    fn is_idle(&self) -> bool {
        self.port.is_idle()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        self.last = (self.ticks)();
        if self.first.is_none() {
            self.first = Some(self.last);
        }
        self.port.send(message)
    }
}

/// The two lines' memory, and the interrupts at their other ends.
#[derive(Clone, Copy, Debug)]
pub struct Wires<'u, S = NoStream> {
    /// Sensor.
    pub sensor: &'u Uart,
    /// Navigation computer.
    pub navigation: &'u Uart,
    /// Receiving DMA streams of both.
    pub streams: [S; 2],
    /// Functions that make the interrupts of these streams pending, and that of the stream that
    /// sends to the navigation computer.
    pub pend: [fn(); 3],
    /// Interrupt of the sensor line: a byte has arrived. Returns whether the main loop is woken.
    pub came: fn(&Uart, u8) -> bool,
    /// Interrupt of the navigation line. Returns the next byte to send.
    pub left: fn(&Uart) -> Option<u8>,
    /// A counter of 24 bits that counts up.
    pub ticks: fn() -> u32,
    /// Enables the interrupts, which are masked until then; `None` if there are none.
    pub let_through: Option<fn()>,
}

/// Number of bytes in the calibration that finds the cost of making interrupts.
pub(super) const CALIBRATION: usize = 256;

impl<'u> Wires<'u> {
    /// Without interrupts and counter.
    #[must_use]
    pub fn plain(lines: &'u [Uart; 2]) -> Self {
        let [sensor, navigation] = lines;
        Self {
            sensor,
            navigation,
            streams: [NoStream; 2],
            pend: [|| (); 3],
            came: Uart::came,
            left: Uart::next,
            ticks: || 0,
            let_through: None,
        }
    }
}
