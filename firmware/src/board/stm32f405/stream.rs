//! One stream of a DMA controller, for bytes between a serial line or the SPI and SRAM (RM0090
//! section 10).
//!
//! `firmware::link::dma` and `firmware::link::bursts` decide about transfers. Here is only the
//! order of accesses to the registers:
//! - Configuration, address and count are written only while EN reads 0 (10.3.17). Clearing EN
//!   takes effect when the byte under way has been moved. So EN is read until it is 0, a bounded
//!   number of times (10.3.14).
//! - NDTR counts at the peripheral's side. What has left there is in memory when EN reads 0 or the
//!   transfer is complete, not before (10.3.13). So bytes are taken only after either.
//! - Stopping sets TCIF too (10.3.12, flush). With this interrupt enabled, a stop by the handler
//!   would make the handler pending again, and so for ever. So the interrupts are disabled together
//!   with EN (10.5.5 protects other bits than these) and enabled with it.
//! - Flags that are still set must be cleared before EN is set again (10.3.17). So all are cleared
//!   after EN reads 0, FEIF and DMEIF included, which direct mode may set (10.3.18) and which cause
//!   no interrupt.
//! - The peripheral keeps its request while the stream is stopped: the UART's byte waits and is
//!   moved when EN is set.
//! - The DMA cannot reach the core-coupled memory at 0x1000_0000 (section 2.3.1): [`reaches`].
//!
//! ES0182, "DMA2 data corruption when managing AHB and APB peripherals in a concurrent way": DMA2
//! serves only APB2 here. The clock of controllers and SRAM continues while the core sleeps (reset
//! value of RCC_AHB1LPENR).

use core::slice;
use core::sync::atomic::AtomicU8;

use cortex_m::asm::dmb;
use firmware::link::dma;
use firmware::link::progress::Progress;
use firmware::wire::field::copy;
use stm32f4::stm32f405::dma2::st::cr;
use stm32f4::stm32f405::dma2::{RegisterBlock, ST};

/// Channel of all serial lines on the streams used here (RM0090 tables 42 and 43).
const LINES: u8 = 4;
/// Channel of the SPI (table 43).
pub const SPI: u8 = 3;

/// Readings of EN until a byte under way has been moved, which takes some ten cycles even when all
/// streams use the bus.
const PATIENCE: u32 = 1000;

/// All five flags of a stream, at the lowest one's place (RM0090 10.5.3).
const FLAGS: u32 = 0b11_1101;

/// Number of bytes that a DMA stream has still to move, for the frame path.
#[derive(Clone, Copy, Debug)]
pub struct StreamProgress(&'static ST);

impl Progress for StreamProgress {
    #[inline(always)]
    fn left(&self) -> usize {
        self.0.ndtr().read().ndt().bits().into()
    }

    #[inline(always)]
    fn get(places: &[AtomicU8], to: &mut [u8]) {
        let Some(places) = places.get(..to.len()) else {
            return;
        };
        // SAFETY: as many bytes, there as long as `places`. Neither the controller nor an
        // interrupt writes to them before they are given free.
        let bytes = unsafe { slice::from_raw_parts(places.as_ptr().cast::<u8>(), places.len()) };
        copy(to, bytes);
    }

    #[inline(always)]
    fn put(places: &[AtomicU8], bytes: &[u8]) {
        let Some(places) = places.get(..bytes.len()) else {
            return;
        };
        // SAFETY: as many bytes, there as long as `places`, which are atomics and so may be
        // written. Neither the controller nor an interrupt touches them before they are handed
        // over.
        let to = unsafe {
            let first = places.as_ptr().cast::<u8>().cast_mut();
            slice::from_raw_parts_mut(first, places.len())
        };
        copy(to, bytes);
    }
}

/// Stream `N` with a channel; `OUT`: from memory to the line.
#[derive(Clone, Copy, Debug)]
pub struct Stream<const N: usize, const OUT: bool, const CHANNEL: u8 = LINES>(
    &'static RegisterBlock,
);

/// Whether the DMA reaches what is at `address`: not the core-coupled memory.
pub fn reaches(address: usize) -> bool {
    address >= 0x2000_0000
}

impl<const N: usize, const OUT: bool, const CHANNEL: u8> Stream<N, OUT, CHANNEL> {
    /// Of this controller.
    pub const fn of(controller: &'static RegisterBlock) -> Self {
        Self(controller)
    }

    #[inline(always)]
    fn stream(&self) -> &'static ST {
        self.0.st(N)
    }

    /// For the frame path.
    pub fn progress(&self) -> StreamProgress {
        StreamProgress(self.stream())
    }

    /// Sets everything but count, memory address and EN. `data` is the address of the line's data
    /// register. Returns whether there is a controller: one that does not exist does not keep what
    /// was written.
    pub fn set_up(&self, data: u32) -> bool {
        dma::Stream::stop(self);
        // SAFETY: the address is that of a data register. Only bytes are read and written there.
        self.stream().par().write(|w| unsafe { w.pa().bits(data) });
        self.stream().cr().write(Self::configuration);
        let retained = self.stream().cr().read();
        retained.chsel().bits() == CHANNEL && retained.minc().is_incremented()
    }

    /// Bytes on both sides, direct mode (reset value of FCR), no interrupt. Bytes that come have
    /// the higher priority: they cannot wait, bytes that leave can.
    #[inline(always)]
    fn configuration(w: &mut cr::W) -> &mut cr::W {
        w.chsel().set(CHANNEL);
        w.minc().incremented();
        if OUT {
            w.dir().memory_to_peripheral().pl().low()
        } else {
            w.dir().peripheral_to_memory().pl().very_high()
        }
    }

    #[inline(always)]
    fn clear_flags(&self) {
        let flags = FLAGS << [0, 6, 16, 22][N % 4];
        if N < 4 {
            // SAFETY: every bit written is a flag of this stream; ones clear, zeros do nothing.
            self.0.lifcr().write(|w| unsafe { w.bits(flags) });
        } else {
            // SAFETY: as above.
            self.0.hifcr().write(|w| unsafe { w.bits(flags) });
        }
    }
}

impl<const N: usize, const OUT: bool, const CHANNEL: u8> Progress for Stream<N, OUT, CHANNEL> {
    #[inline(always)]
    fn left(&self) -> usize {
        self.progress().left()
    }
}

impl<const N: usize, const OUT: bool, const CHANNEL: u8> dma::Stream<'static>
    for Stream<N, OUT, CHANNEL>
{
    #[inline(always)]
    fn arm(&self, places: &'static [AtomicU8]) {
        let stream = self.stream();
        // SAFETY: these places exist for ever. They are atomics, so the controller may write them,
        // and the ring gives them to no other user before the transfer has ended.
        stream
            .m0ar()
            .write(|w| unsafe { w.m0a().bits(places.as_ptr() as u32) });
        stream.ndtr().write(|w| w.ndt().set(places.len() as u16)); // a ring is shorter than 65 536
        dmb(); // what is to be sent is in memory before the controller looks
        stream.cr().write(|w| {
            let w = Self::configuration(w).tcie().enabled().teie().enabled();
            w.en().enabled()
        });
    }

    #[inline(always)]
    fn stop(&self) -> usize {
        let stream = self.stream();
        stream.cr().write(Self::configuration);
        let _ = (0..PATIENCE).any(|_| stream.cr().read().en().is_disabled());
        self.clear_flags();
        let left = self.left();
        dmb(); // what has come is read after this
        left
    }

    #[inline(always)]
    fn is_running(&self) -> bool {
        self.stream().cr().read().en().is_enabled()
    }
}
