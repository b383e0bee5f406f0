//! A serial line between the main loop and an interrupt that moves single bytes: what boards share, without their registers.
//!
//! The interrupt calls [`Uart::came`] and [`Uart::next`], the main loop has the [`Port`]. No lock: the two only meet in the
//! [`super::ring`]s. A main loop that knows how many bytes it needs before there is work ([`Port::want`]) is not woken by the
//! bytes before.

use super::ring::{Inlet, Outlet, Ring};
use super::{Full, Line, Lost};
use core::sync::atomic::{AtomicUsize, Ordering};
use embedded_io::{Read, Write};

/// Room for received bytes: 4 ms of the fastest sensor (STIM300, 118 kB/s).
pub const RECEIVED: usize = 512;
/// Room for bytes to be sent: some messages of the longest kind.
pub const TO_SEND: usize = 1024;

/// One line; a `static` of the board. Not more than one interrupt and one [`Port`] use it.
#[derive(Debug, Default)]
pub struct Uart {
    received: Ring<RECEIVED>,
    to_send: Ring<TO_SEND>,
    /// The main loop is to be woken when so many bytes have come since start, wrapping. By the main loop.
    wanted: AtomicUsize,
}

impl Uart {
    /// Nothing came, nothing is to be sent.
    pub const fn new() -> Uart {
        Uart {
            received: Ring::new(),
            to_send: Ring::new(),
            wanted: AtomicUsize::new(1),
        }
    }

    /// Interrupt: a byte came. Whether the main loop wants to be woken.
    #[inline(always)]
    pub fn came(&self, byte: u8) -> bool {
        let pushed = self.received.push(byte);
        let wanted = self.wanted.load(Ordering::Relaxed);
        pushed.wrapping_sub(wanted).cast_signed() >= 0
    }

    /// Interrupt: bytes were lost before they came here (overrun, framing, parity). The main loop wants to be woken.
    pub fn lost(&self) {
        self.received.inlet().mark_lost();
    }

    /// Interrupt: the next byte to be sent.
    #[inline(always)]
    pub fn next(&self) -> Option<u8> {
        self.to_send.pop()
    }

    /// The main loop's end; `wake` makes the line's interrupt pending, which then finds what there is to send.
    pub fn port(&self, wake: fn()) -> Port<'_> {
        Port {
            uart: self,
            received: self.received.outlet(),
            to_send: self.to_send.inlet(),
            wake,
        }
    }
}

/// The main loop's end of a line.
#[derive(Debug)]
pub struct Port<'u> {
    uart: &'u Uart,
    received: Outlet<'u>,
    to_send: Inlet<'u>,
    wake: fn(),
}

impl Port<'_> {
    /// There is no work before `bytes` more are here than have been taken: false when they are here already, else the interrupt
    /// will say so. Holds until the next [`Line::receive`]; from then on every byte is wanted.
    pub fn want(&self, bytes: usize) -> bool {
        let taken = self.received.popped();
        let wanted = taken.wrapping_add(bytes);
        // first wanted, then looked, so that a byte that comes in between is seen by one of both
        self.uart.wanted.store(wanted, Ordering::SeqCst);
        self.uart.received.pushed().wrapping_sub(taken) < bytes
    }
}

impl Line for Port<'_> {
    fn receive(&mut self, buffer: &mut [u8]) -> Result<usize, Lost> {
        let read = self.received.read(buffer).map_err(|_| Lost);
        let wanted = self.received.popped().wrapping_add(1);
        self.uart.wanted.store(wanted, Ordering::Relaxed);
        read
    }

    fn is_idle(&self) -> bool {
        self.received.is_empty() && !self.received.has_lost()
    }

    fn send(&mut self, message: &[u8]) -> Result<(), Full> {
        if self.to_send.room() < message.len() {
            return Err(Full);
        }
        let _ = self.to_send.write(message); // there is room
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
