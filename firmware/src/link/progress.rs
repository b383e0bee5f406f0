//! How far a transfer between a serial line and memory is.

/// How far a transfer is.
pub trait Progress {
    /// Whether a DMA controller moves the bytes. If not, the code for it is left out.
    const DMA: bool = true;

    /// Bytes of the transfer under way that have not been moved yet. Those that have may not all be
    /// in memory before the transfer is stopped ([`super::dma::Stream::stop`]).
    fn left(&self) -> usize;
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
