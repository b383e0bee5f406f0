//! The ring that a stream fills, read without an interrupt.
//!
//! A stream reports how many bytes are left until the end of its ring (NDTR), and in a flag that it
//! has wrapped (TCIF, RM0090 10.3.8). The flag is looked at, it does not interrupt. So the ring
//! must be looked at once in a round of it, which is 5.6 ms at 921 600 bit/s; the loop looks each
//! millisecond. Bytes that were overwritten are reported as lost, but not always after a longer
//! stop.

use core::ptr::copy_nonoverlapping;
use core::sync::atomic::{Ordering, fence};

use embassy_stm32::interrupt::Interrupt;
use embassy_stm32::pac::common::{R, Reg, W};
use embassy_stm32::pac::dma::regs::Ixr;
use embassy_stm32::pac::dma::{Dma, St};
use embassy_stm32::pac::{DMA1, DMA2};
use firmware::link::Lost;

use crate::line::RING;

/// The streams' interrupts, by controller and number.
const STREAMS: [Interrupt; 16] = [
    Interrupt::DMA1_STREAM0,
    Interrupt::DMA1_STREAM1,
    Interrupt::DMA1_STREAM2,
    Interrupt::DMA1_STREAM3,
    Interrupt::DMA1_STREAM4,
    Interrupt::DMA1_STREAM5,
    Interrupt::DMA1_STREAM6,
    Interrupt::DMA1_STREAM7,
    Interrupt::DMA2_STREAM0,
    Interrupt::DMA2_STREAM1,
    Interrupt::DMA2_STREAM2,
    Interrupt::DMA2_STREAM3,
    Interrupt::DMA2_STREAM4,
    Interrupt::DMA2_STREAM5,
    Interrupt::DMA2_STREAM6,
    Interrupt::DMA2_STREAM7,
];

/// A ring that a DMA stream fills, and how far it has been read.
pub struct Received {
    ring: *const u8,
    stream: St,
    /// The flags of its controller, where they are cleared, and its own that it has wrapped.
    flags: Reg<Ixr, R>,
    clear: Reg<Ixr, W>,
    wrapped: Ixr,
    /// Bytes that have come and that were taken, modulo 2^32.
    came: u32,
    taken: u32,
}

impl Received {
    /// Of the stream with this interrupt, which has just begun to fill a ring that exists for ever.
    pub fn new(ring: *const [u8; RING], interrupt: Interrupt) -> Self {
        const { assert!(RING.is_power_of_two(), "counts turn over") };
        let number = STREAMS.iter().position(|of| *of == interrupt);
        let number = number.expect("a stream of DMA1 or DMA2");
        let controller: Dma = if number < 8 { DMA1 } else { DMA2 };
        let mut wrapped = Ixr(0);
        wrapped.set_tcif(number % 4, true);
        Self {
            ring: ring.cast(),
            stream: controller.st(number % 8),
            flags: controller.isr(number % 8 / 4),
            clear: controller.ifcr(number % 8 / 4),
            wrapped,
            came: 0,
            taken: 0,
        }
    }

    /// Where the stream writes next.
    fn at(&self) -> u32 {
        (RING as u32).wrapping_sub(self.stream.ndtr().read().0) % RING as u32
    }

    /// Whether nothing waits. A whole round of the ring is found by [`Received::take`].
    pub fn is_empty(&self) -> bool {
        self.came == self.taken && self.at() == self.came % RING as u32
    }

    /// Counts what has come.
    fn look(&mut self) -> Result<u32, Lost> {
        let wrapped = self.flags.read().0 & self.wrapped.0 != 0;
        let (before, mut at, mut round) = (self.came % RING as u32, self.at(), 0);
        if wrapped {
            self.clear.write_value(self.wrapped);
            round = RING as u32;
        } else if at < before {
            // the ring's end was between, and the flag is there in a moment
            at = RING as u32 - 1;
        }
        self.came = (self.came - before).wrapping_add(round).wrapping_add(at);
        let waits = self.came.wrapping_sub(self.taken);
        if waits > RING as u32 {
            self.taken = self.came;
            return Err(Lost);
        }
        Ok(waits)
    }

    /// Takes the oldest bytes, as many as there is room for.
    #[allow(unsafe_code, reason = "memory that a stream writes to")]
    pub fn take(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let waits = self.look()? as usize;
        fence(Ordering::Acquire);
        let (len, from) = (waits.min(buffer.len()), self.taken as usize % RING);
        let first = len.min(RING - from);
        // SAFETY: both pieces are within the ring, and as long as the buffer together. The stream
        // does not write to them, for else the look below reports them as lost.
        unsafe {
            copy_nonoverlapping(self.ring.add(from), buffer.as_mut_ptr(), first);
            copy_nonoverlapping(self.ring, buffer.as_mut_ptr().add(first), len - first);
        }
        fence(Ordering::Acquire);
        self.look()?;
        self.taken = self.taken.wrapping_add(len as u32);
        Ok(len)
    }
}
