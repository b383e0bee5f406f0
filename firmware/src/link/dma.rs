//! A serial line whose bytes a DMA controller moves: the decisions about its transfers, without
//! registers.
//!
//! **Receiving.** The frame path says how many bytes it needs before there is work
//! ([`Port::want`](super::uart::Port::want)). A transfer writes straight into the ring and ends
//! with the byte that is wanted, or at the ring's end, where the next one continues. So the
//! interrupt comes with the last byte of a frame, neither earlier nor after a silence of the line,
//! and once a frame. It begins the next transfer at once, of the length that was wanted last.
//! Meanwhile the line's receiver holds one byte. The frame path finds bytes that came without an
//! interrupt by reading how far the transfer is.
//!
//! **Sending.** One transfer sends what is in one piece in the ring. Its end begins the next.
//!
//! **Who touches what.** Only interrupts begin and stop transfers, and they do not interrupt each
//! other. When the frame path wants something else, it makes the interrupt pending (`sync`), which
//! is served before the loop continues. By itself it only reads how much is left. So between the
//! stop of a transfer and the begin of the next only bytes can come, and these wait in the
//! receiver.

use super::progress::Progress;
use super::uart::Uart;
use core::sync::atomic::{AtomicU8, Ordering};

/// One stream of a controller, between one direction of a line and memory.
pub trait Stream<'m>: Progress {
    /// Begins to move bytes between these places and the line, at most 65 535. No transfer is under
    /// way.
    fn arm(&self, places: &'m [AtomicU8]);

    /// Ends the transfer, wherever it is, and its interrupt. Returns how many bytes were not moved.
    /// All others are in memory then.
    fn stop(&self) -> usize;

    /// Whether a transfer is under way.
    fn is_running(&self) -> bool;
}

impl Uart {
    /// Called by the interrupt of the receiving stream, whether a transfer ended or the frame path
    /// made it pending. It reports the bytes that have come and begins the next transfer, as long
    /// as the frame path wants. Returns whether to wake the frame path.
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

    /// Called by the interrupt of the sending stream, whether a transfer ended or the frame path
    /// made it pending. When a transfer has ended, it begins the next. A transfer that failed is
    /// not repeated: it would fail again.
    #[inline(always)]
    pub fn sent_by<'u>(&'u self, stream: &impl Stream<'u>) {
        if stream.is_running() {
            return;
        }
        let left = self.leaving.load(Ordering::Relaxed);
        if left != 0 {
            stream.stop();
            self.to_send.emptied(left);
        }
        let places = self.to_send.oldest();
        self.leaving.store(places.len(), Ordering::Relaxed);
        if !places.is_empty() {
            stream.arm(places);
        }
    }
}

#[cfg(test)]
mod tests;
