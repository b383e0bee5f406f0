//! Lines and time: everything the application sees of a board.
//!
//! A [`Line`] is a serial line in both directions; neither ever waits. A board has a [`uart::Uart`] with
//! an interrupt a byte at its other end, or streams of a DMA controller ([`dma`]). Anything that speaks `embedded-io`, the ends of
//! a [`ring`] too, fits into a [`Serial`].
//!
//! Messages leave whole or not at all, so that a receiver never sees half a frame of ours because a buffer was full.

pub mod dma;
pub mod faulty;
pub mod ring;
mod serial;
pub mod spi;
pub mod uart;

pub use serial::Serial;

/// Monotonic time.
pub trait Clock {
    /// Microseconds since any fixed moment before power-on was complete. Never goes back.
    fn now_us(&self) -> u64;

    /// Microseconds of these that the processor has slept; `None` where that is not known.
    fn asleep_us(&self) -> Option<u64> {
        None
    }
}

/// Bytes that arrived were lost before they could be read (overrun, framing, parity): how many is not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lost;

/// No room for the whole message now; nothing of it was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full;

/// A serial line in both directions.
pub trait Line {
    /// Take bytes that have arrived, at most as many as fit; 0 when there are none.
    ///
    /// # Errors
    /// [`Lost`], once for each time bytes were lost; what came after them is read by the next call.
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost>;

    /// Whether [`Line::receive`] has nothing to tell, and nothing to give or only the beginning of what is wanted; spares the call.
    fn is_idle(&self) -> bool {
        false
    }

    /// Put the whole message on its way, or nothing of it. The first byte leaves at once, without another call.
    ///
    /// # Errors
    /// [`Full`]; the caller drops the message and counts it.
    fn send(&mut self, message: &[u8]) -> Result<(), Full>;

    /// Called in every pass: move on what an earlier [`Line::send`] accepted, where no interrupt does.
    fn poll(&mut self) {}
}

impl<L: Line> Line for &mut L {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        (**self).receive(buffer)
    }

    fn is_idle(&self) -> bool {
        (**self).is_idle()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        (**self).send(message)
    }

    fn poll(&mut self) {
        (**self).poll();
    }
}

/// A line that is not there: nothing arrives, and what is sent goes nowhere.
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
