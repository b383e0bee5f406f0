//! Lines and time: everything the application sees of a board.
//!
//! A [`Line`] is a serial line in both directions. Neither direction ever waits. A board has a
//! [`uart::Uart`], at whose other end an interrupt moves each byte or a DMA controller moves many
//! ([`dma`]). Anything that implements the traits of `embedded-io`, such as the ends of a [`ring`],
//! fits into a [`Serial`].
//!
//! Messages leave whole or not at all, so a receiver never sees half a frame because a buffer was
//! full.
//!
//! [`spsc`] is the queue between two priorities.

/// The processor's; `tests/orders` has others in their place.
mod atomics {
    pub use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};
}
pub mod bursts;
pub mod cut;
pub mod dma;
pub mod faulty;
pub mod progress;
pub mod rates;
pub mod ring;
mod serial;
mod slot;
pub mod spi;
pub mod spsc;
#[cfg(test)]
mod spsc_tests;
pub mod uart;

pub use serial::Serial;

use core::cell::Cell;

/// Monotonic time.
pub trait Clock {
    /// Microseconds since any fixed moment before power-on was complete. Never goes back.
    fn now_us(&self) -> u64;

    /// Part of these microseconds for which the processor has slept; `None` where that is not
    /// known.
    fn asleep_us(&self) -> Option<u64> {
        None
    }
}

/// Time that its owner sets, for tests and recordings.
impl Clock for Cell<u64> {
    fn now_us(&self) -> u64 {
        self.get()
    }
}

/// Bytes were lost before they could be read (overrun, framing, parity). How many is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lost;

/// There is no room for the whole message now. Nothing of it was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full;

/// A serial line in both directions.
pub trait Line {
    /// Takes bytes that have arrived, at most as many as fit. 0 when there are none.
    ///
    /// # Errors
    /// [`Lost`], once for each time bytes were lost. The next call reads what came after them.
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost>;

    /// Whether a call of [`Line::receive`] can be spared: no loss to report, and no bytes or only
    /// the beginning of what is wanted.
    fn is_idle(&self) -> bool {
        false
    }

    /// After a [`Line::receive`]: whether another call at once may find more. Bytes that an
    /// interrupt will report need not count.
    fn has_more(&self) -> bool {
        !self.is_idle()
    }

    /// Starts to send the whole message, or nothing of it. The first byte leaves at once, without
    /// another call.
    ///
    /// # Errors
    /// [`Full`]. The caller drops the message and counts it.
    fn send(&mut self, message: &[u8]) -> Result<(), Full>;

    /// Lets `work` have what cuts through the frames that leave here, with interrupts masked.
    /// False: there is nothing that does.
    fn cut(&mut self, work: &mut dyn FnMut(&mut cut::Cut)) -> bool {
        let _ = work;
        false
    }

    /// Called in every pass. Where no interrupt does, it moves on what [`Line::send`] has accepted.
    fn poll(&mut self) {}
}

impl<L: Line> Line for &mut L {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        (**self).receive(buffer)
    }

    fn is_idle(&self) -> bool {
        (**self).is_idle()
    }

    fn has_more(&self) -> bool {
        (**self).has_more()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        (**self).send(message)
    }

    fn cut(&mut self, work: &mut dyn FnMut(&mut cut::Cut)) -> bool {
        (**self).cut(work)
    }

    fn poll(&mut self) {
        (**self).poll();
    }
}

/// A line that does not exist. Nothing arrives, and what is sent goes nowhere.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoLine;

impl Line for NoLine {
    fn receive(&mut self, _: &mut [u8]) -> Result<usize, Lost> {
        Ok(0)
    }

    fn is_idle(&self) -> bool {
        true
    }

    fn send(&mut self, _: &[u8]) -> Result<(), Full> {
        Ok(())
    }
}

#[cfg(test)]
mod tests;
