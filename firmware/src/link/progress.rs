//! How far a transfer between a serial line and memory is.

use super::ring;
use core::sync::atomic::AtomicU8;

/// Progress of a transfer.
pub trait Progress {
    /// Whether a DMA controller moves the bytes. If not, the code for it is left out.
    const DMA: bool = true;

    /// Bytes of the transfer under way that have not been moved yet. Those that have may not all be
    /// in memory before the transfer is stopped ([`super::dma::Stream::stop`]).
    fn left(&self) -> usize;

    /// Fills `to` from a ring's places, which are at least as many and which nothing writes to
    /// meanwhile. A board may do it by words.
    #[inline(always)]
    fn get(places: &[AtomicU8], to: &mut [u8]) {
        ring::get(places, to);
    }

    /// Copies `bytes` to a ring's places, which are at least as many and which nothing else uses
    /// meanwhile.
    #[inline(always)]
    fn put(places: &[AtomicU8], bytes: &[u8]) {
        ring::put(places, bytes);
    }
}

/// No controller: an interrupt moves each byte.
#[derive(Debug, Clone, Copy)]
pub struct NoStream;

impl Progress for NoStream {
    const DMA: bool = false;

    fn left(&self) -> usize {
        0
    }
}
