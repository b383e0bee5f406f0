//! A serial line between the frame path and its interrupts: what boards share, without their
//! registers.
//!
//! Either an interrupt moves single bytes and calls [`Uart::came`] and [`Uart::next`]. Or a DMA
//! controller moves them, and its interrupts call the functions of [`super::dma`]. In both cases
//! the frame path has the [`Port`]. There is no lock, since the two sides share only the
//! [`super::ring`]s and a few atomics. A frame path that states how many bytes it needs before
//! there is work ([`Port::want`]) is not woken earlier.

use super::cut::Cut;
use super::progress::{NoStream, Progress};
use super::ring::{Consumer, Producer, Ring};
use super::{Full, Line, Lost};
use core::cell::Cell;
use core::sync::atomic::{AtomicUsize, Ordering};

/// Room for received bytes: 4 ms of the fastest sensor (STIM300, 118 kB/s).
pub const RECEIVED: usize = 512;
/// Room for bytes to be sent: more than the longest message, and as much as may be received.
pub const TO_SEND: usize = 512;

/// One line, a `static` of the board. Its interrupts do not interrupt each other, and one [`Port`]
/// uses it.
#[derive(Debug, Default)]
pub struct Uart {
    pub(super) received: Ring<RECEIVED>,
    pub(super) to_send: Ring<TO_SEND>,
    /// Wake the frame path when so many bytes have come since start, modulo 2^32. Written by the
    /// frame path.
    pub(super) wanted: AtomicUsize,
    /// Bytes that it wanted last: how far a DMA transfer reaches until it wants more. 0: as far as
    /// there is room. Written by the frame path.
    pub(super) ahead: AtomicUsize,
    /// Bytes of the receiving DMA transfer; 0: there is none. Written by the interrupt.
    pub(super) arriving: AtomicUsize,
    /// Bytes of the sending DMA transfer; 0: there is none. Written by the interrupt.
    pub(super) leaving: AtomicUsize,
}

impl Uart {
    /// An idle line. All zeros, so that it costs no flash.
    pub const fn new() -> Uart {
        Uart {
            received: Ring::new(),
            to_send: Ring::new(),
            wanted: AtomicUsize::new(0),
            ahead: AtomicUsize::new(0),
            arriving: AtomicUsize::new(0),
            leaving: AtomicUsize::new(0),
        }
    }

    /// Called by the interrupt: a byte came. Returns whether to wake the frame path.
    #[inline(always)]
    pub fn came(&self, byte: u8) -> bool {
        let pushed = self.received.push(byte);
        let wanted = self.wanted.load(Ordering::Relaxed);
        pushed.wrapping_sub(wanted).cast_signed() >= 0
    }

    /// [`Self::came`] for the sensor's line, whose frames may be cut: the output goes to `out`.
    /// Returns whether to wake the frame path, and whether `out` has something to send.
    #[inline(always)]
    pub fn came_through(&self, byte: u8, cut: &mut Cut, out: &Uart) -> (bool, bool) {
        let place = self.received.pushed();
        let wake = self.came(byte);
        if !cut.is_on() {
            return (wake, false);
        }
        if self.received.pushed() == place {
            cut.end(); // there was no room, and the loop will never see it
            return (wake, false);
        }
        let leaving = cut.came(place as u32, byte, out.to_send.producer().room());
        leaving.each(|byte| {
            out.to_send.push(byte);
        });
        (wake, !leaving.is_empty())
    }

    /// Called by the interrupt: bytes were lost before they came here (overrun, framing, parity).
    /// Wake the frame path.
    pub fn lost(&self) {
        self.received.producer().mark_lost();
    }

    /// Whether everything has been handed to the line.
    pub fn has_sent(&self) -> bool {
        self.to_send.oldest().is_empty()
    }

    /// How many bytes have left since start, modulo 2^32, and whether more wait. `left`: how many
    /// the sending transfer, if there is one, has not moved.
    pub fn sent(&self, left: usize) -> (usize, bool) {
        let moved = self.leaving.load(Ordering::Relaxed).saturating_sub(left);
        (self.to_send.popped().wrapping_add(moved), !self.has_sent())
    }

    /// The line is closed, to be reopened. No interrupt and no transfer is under way any more; the
    /// receiving one had `left` bytes to move. Bytes received before stay; bytes to be sent are
    /// dropped.
    pub fn closed(&self, left: usize) {
        let arriving = self.arriving.load(Ordering::Relaxed);
        self.received.filled(arriving.saturating_sub(left));
        self.arriving.store(0, Ordering::SeqCst);
        self.leaving.store(0, Ordering::Relaxed);
        self.to_send.clear();
    }

    /// Called by the interrupt: the next byte to be sent.
    #[inline(always)]
    pub fn next(&self) -> Option<u8> {
        self.to_send.pop()
    }

    /// The frame path's end. `wake` makes the line's interrupt pending, which then sends.
    pub fn port(&self, wake: fn()) -> Port<'_> {
        self.port_over(NoStream, || (), wake)
    }

    /// The frame path's end of a line that DMA may serve. `stream` gives how far the receiving
    /// transfer is. `sync` makes the interrupt pending that calls [`Uart::received_by`], `wake` the
    /// one that sends.
    pub fn port_over<S: Progress>(&self, stream: S, sync: fn(), wake: fn()) -> Port<'_, S> {
        Port {
            uart: self,
            received: self.received.consumer(),
            to_send: self.to_send.producer(),
            stream,
            seen: Cell::new([0; 2]),
            sync,
            wake,
            cut: None,
        }
    }
}

/// Lets work have a line's [`Cut`] with interrupts masked.
pub type Masked = fn(&mut dyn FnMut(&mut Cut));

/// The frame path's end of a line.
#[derive(Debug)]
pub struct Port<'u, S = NoStream> {
    uart: &'u Uart,
    received: Consumer<'u>,
    to_send: Producer<'u>,
    stream: S,
    /// Progress of the line at the last look: bytes reported, and bytes left of the transfer.
    seen: Cell<[usize; 2]>,
    sync: fn(),
    wake: fn(),
    cut: Option<Masked>,
}

impl<S: Progress> Port<'_, S> {
    /// A port of the line on which cut frames leave. As long as frames are cut, an interrupt
    /// writes to the line, so a message ends the cutting, and has no room within a frame.
    #[must_use]
    pub fn with_cut(mut self, cut: Masked) -> Self {
        self.cut = Some(cut);
        self
    }

    /// States that there is no work before `bytes` more have come than were taken. Returns false
    /// when they are here already; else an interrupt will wake the frame path. This holds until the
    /// next [`Line::receive`], after which every byte that an interrupt reports wakes it.
    pub fn want(&self, bytes: usize) -> bool {
        let taken = self.received.popped();
        let wanted = taken.wrapping_add(bytes);
        if S::DMA && self.wants(wanted, bytes) {
            return self.uart.received.pushed().wrapping_sub(taken) < bytes;
        }
        // written first and read then, so that one side sees a byte that comes in between
        self.uart.wanted.store(wanted, Ordering::SeqCst);
        if S::DMA {
            self.uart.ahead.store(bytes, Ordering::Relaxed);
            let arriving = self.uart.arriving.load(Ordering::SeqCst);
            let end = self.uart.received.pushed().wrapping_add(arriving);
            // A transfer that ends at the wanted byte or before needs nothing: its end is an
            // interrupt, which sees `wanted`. An interrupt between the two loads has seen it as
            // well.
            if arriving == 0 || end.wrapping_sub(wanted).cast_signed() > 0 {
                (self.sync)();
            }
        }
        self.uart.received.pushed().wrapping_sub(taken) < bytes
    }

    /// Whether just this was wanted last and a transfer for it is under way.
    #[inline(always)]
    fn wants(&self, wanted: usize, ahead: usize) -> bool {
        self.uart.wanted.load(Ordering::Relaxed) == wanted
            && self.uart.ahead.load(Ordering::Relaxed) == ahead
            && self.uart.arriving.load(Ordering::Relaxed) != 0
    }

    /// Whether nothing has come since start.
    pub fn is_silent(&self) -> bool {
        self.uart.received.pushed() == 0 && !(S::DMA && self.has_unreported())
    }

    /// Whether DMA has moved bytes that no interrupt has reported.
    #[inline(always)]
    fn has_unreported(&self) -> bool {
        let arriving = self.uart.arriving.load(Ordering::Relaxed);
        // An interrupt in between makes the result wrong. It has then reported all bytes and woken
        // the loop.
        arriving != 0 && self.stream.left() != arriving
    }

    /// Whether there are bytes that are worth a pass. While the wanted bytes still come, a pass
    /// would only cost time: the interrupt with the last of them reports all. But when none has
    /// come since the last look, the message may be a shorter one.
    #[inline(always)]
    fn has_work(&self) -> bool {
        let pushed = self.uart.received.count(); // the bytes are not read here
        let unreported = S::DMA && self.has_unreported();
        if pushed == self.received.popped() && !unreported {
            return false;
        }
        let missing = self
            .uart
            .wanted
            .load(Ordering::Relaxed)
            .wrapping_sub(pushed);
        let now = [pushed, self.stream.left()];
        missing.cast_signed() <= 0 || self.seen.replace(now) == now
    }
}

impl<S: Progress> Line for Port<'_, S> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        if S::DMA && self.has_unreported() {
            (self.sync)();
        }
        let read = self.received.read_by(buffer, S::get).map_err(|_| Lost);
        let taken = self.received.popped();
        self.uart.wanted.store(taken, Ordering::Relaxed);
        if S::DMA && self.uart.arriving.load(Ordering::Relaxed) == 0 {
            (self.sync)(); // there was no room for a transfer; now there is
        }
        read
    }

    fn is_idle(&self) -> bool {
        !self.has_work() && !self.received.has_lost()
    }

    fn has_more(&self) -> bool {
        let there = self.uart.received.count() != self.received.popped();
        there || self.received.has_lost()
    }

    fn cut(&mut self, work: &mut dyn FnMut(&mut Cut)) -> bool {
        self.cut.map(|masked| masked(work)).is_some()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        let mut free = true;
        self.cut(&mut |cut| free = cut.stop());
        if !free || !self.to_send.put_all_by(message, S::put) {
            return Err(Full);
        }
        (self.wake)();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loop_is_woken_when_enough_has_come() {
        let uart = Uart::new();
        let mut port = uart.port(|| ());
        assert!(uart.came(1));
        let mut buffer = [0; 600];
        assert!(!port.is_idle());
        assert_eq!(port.receive(&mut buffer), Ok(1));
        assert!(port.is_idle());
        for round in 0..1000u32 {
            assert!(port.want(3));
            let woken = [0, 1, 2, 3].map(|_| uart.came(round as u8));
            assert_eq!(woken, [false, false, true, true]);
            assert!(!port.want(4) && port.want(5));
            assert_eq!(port.receive(&mut buffer), Ok(4));
            assert_eq!(buffer[..4], [round as u8; 4]);
            assert!(uart.came(9), "every byte after a receive");
            assert_eq!(port.receive(&mut buffer), Ok(1));
        }
        for _ in 0..RECEIVED {
            uart.came(7);
        }
        assert!(uart.came(8), "no room");
        assert_eq!(port.receive(&mut buffer), Err(Lost));
        assert_eq!(port.receive(&mut buffer), Ok(RECEIVED));
        assert!(port.is_idle());
        uart.lost();
        assert!(!port.is_idle());
        assert_eq!(port.receive(&mut buffer), Err(Lost));
    }

    #[test]
    fn messages_are_sent_whole_and_in_order() {
        let uart = Uart::new();
        let mut port = uart.port(|| ());
        for round in 0..50u8 {
            let message = [round; 300];
            for _ in 0..TO_SEND / 300 {
                assert_eq!(port.send(&message), Ok(()));
            }
            assert_eq!(port.send(&message), Err(Full));
            let sent: std::vec::Vec<u8> = core::iter::from_fn(|| uart.next()).collect();
            assert_eq!(sent, [round; TO_SEND / 300 * 300]);
        }
    }
}
