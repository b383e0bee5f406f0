//! A serial line whose bytes a DMA controller moves: what decides about its transfers, without registers.
//!
//! **Receiving.** The main loop says how many bytes it needs before there is work ([`Port::want`](super::uart::Port::want)). So a transfer goes straight into
//! the ring and ends with the byte that is wanted (or at the ring's end, from where the next one goes on): its interrupt comes with the last
//! byte of a frame, neither earlier nor after a silence of the line, and there is one a frame. It begins the next transfer at once, of the
//! length asked for last; meanwhile the line's receiver holds one byte. Bytes that came without an interrupt are found by looking how far the transfer is.
//!
//! **Sending.** One transfer for what is in one piece in the ring; its end begins the next.
//!
//! **Who touches what.** Only interrupts, which do not interrupt each other, begin and stop transfers. A main loop that wants something
//! else makes the interrupt pending (`sync`), which is served before it goes on; by itself it only reads how much is left. So nothing
//! can come between stopping a transfer and beginning the next but bytes, and these wait in the receiver.

use super::uart::Uart;
use core::sync::atomic::{AtomicU8, Ordering};

/// How far a transfer is.
pub trait Progress {
    /// Whether there is any such thing; without, its code is left out.
    const DMA: bool = true;

    /// Bytes of the transfer under way that have not been moved yet. Those that have may not all be in memory before [`Stream::stop`].
    fn left(&self) -> usize;
}

/// One stream of a controller, between one direction of a line and memory.
pub trait Stream<'m>: Progress {
    /// Begin to move bytes between these places and the line; no transfer is under way. Not more than 65 535.
    fn arm(&self, places: &'m [AtomicU8]);

    /// End the transfer, wherever it is, and its interrupt: the bytes that were not moved. All others are in memory then.
    fn stop(&self) -> usize;

    /// Whether a transfer is under way.
    fn is_running(&self) -> bool;
}

/// No controller.
#[derive(Debug, Clone, Copy)]
pub struct NoStream;

impl Progress for NoStream {
    const DMA: bool = false;

    fn left(&self) -> usize {
        0
    }
}

impl Uart {
    /// Interrupt of the stream that receives, or made pending: what has come is told, and the next transfer goes as far as the main loop
    /// wants. Whether it wants to be woken.
    #[inline(always)]
    pub fn received_by<'u>(&'u self, stream: &impl Stream<'u>) -> bool {
        let left = stream.stop();
        let arriving = self.arriving.load(Ordering::Relaxed);
        let pushed = self.received.filled(arriving.saturating_sub(left));
        let wanted = self.wanted.load(Ordering::SeqCst);
        let missing = wanted.wrapping_sub(pushed).cast_signed();
        let length = if missing > 0 {
            missing.cast_unsigned()
        } else {
            match self.ahead.load(Ordering::Relaxed) {
                0 => usize::MAX,
                ahead => ahead,
            }
        };
        let free = self.received.free();
        let places = free.get(..length).unwrap_or(free);
        self.arriving.store(places.len(), Ordering::SeqCst);
        if !places.is_empty() {
            stream.arm(places);
        }
        missing <= 0
    }

    /// Interrupt of the stream that sends, or made pending: when it has done its part, the next one. A transfer that failed is not
    /// repeated: it would fail again.
    #[inline(always)]
    pub fn sent_by<'u>(&'u self, stream: &impl Stream<'u>) {
        if stream.is_running() {
            return;
        }
        stream.stop();
        self.to_send.emptied(self.leaving.load(Ordering::Relaxed));
        let places = self.to_send.oldest();
        self.leaving.store(places.len(), Ordering::Relaxed);
        if !places.is_empty() {
            stream.arm(places);
        }
    }
}

#[cfg(test)]
mod tests;
