//! Bytes between an interrupt and the loop.
//!
//! One ring a direction. Received bytes: the interrupt [`Inlet::push`]es, the loop reads the [`Outlet`]. Sent bytes: the
//! loop writes the [`Inlet`], the interrupt [`Outlet::pop`]s. Lock-free, single producer, single consumer.
//!
//! Over atomics and not `heapless::spsc`, whose ends divide by a length they only know at run time: the division by zero
//! that cannot happen would still be a panic in the image.

use core::sync::atomic::{AtomicU8, AtomicU32, AtomicUsize, Ordering};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Storage of a ring for `N` bytes, a power of two.
#[derive(Debug)]
pub struct Ring<const N: usize> {
    bytes: [AtomicU8; N],
    counts: Counts,
}

/// Since start, wrapping; each has one writer.
#[derive(Debug)]
struct Counts {
    /// By the inlet.
    pushed: AtomicUsize,
    /// By the outlet.
    popped: AtomicUsize,
    /// By the inlet: times that bytes were lost.
    lost: AtomicU32,
}

impl<const N: usize> Default for Ring<N> {
    fn default() -> Ring<N> {
        Ring::new()
    }
}

impl<const N: usize> Ring<N> {
    /// An empty one.
    pub const fn new() -> Ring<N> {
        const {
            assert!(N.is_power_of_two(), "counts run freely and are masked");
        }
        Ring {
            bytes: [const { AtomicU8::new(0) }; N],
            counts: Counts {
                pushed: AtomicUsize::new(0),
                popped: AtomicUsize::new(0),
                lost: AtomicU32::new(0),
            },
        }
    }

    /// Its two ends, of which each may be in another context.
    pub fn split(&mut self) -> (Inlet<'_>, Outlet<'_>) {
        let counts = &self.counts;
        let bytes = &self.bytes;
        let seen = counts.lost.load(Ordering::Relaxed);
        let inlet = Inlet { bytes, counts };
        let outlet = Outlet {
            bytes,
            counts,
            seen,
        };
        (inlet, outlet)
    }
}

/// Where bytes go in.
#[derive(Debug)]
pub struct Inlet<'a> {
    bytes: &'a [AtomicU8],
    counts: &'a Counts,
}

impl Inlet<'_> {
    /// Put a byte in; one that finds no room is lost, and the outlet's reader is told.
    pub fn push(&mut self, byte: u8) {
        if !self.put(byte) {
            self.mark_lost();
        }
    }

    fn put(&mut self, byte: u8) -> bool {
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        match place(self.bytes, pushed) {
            Some(place) if self.room() > 0 => {
                place.store(byte, Ordering::Relaxed);
                let pushed = pushed.wrapping_add(1);
                self.counts.pushed.store(pushed, Ordering::Release);
                true
            }
            _ => false,
        }
    }

    /// Tell the outlet's reader that bytes were lost before they came here: a UART's overrun, framing or parity error.
    pub fn mark_lost(&mut self) {
        // a single writer: no read-modify-write is needed
        let lost = self.counts.lost.load(Ordering::Relaxed);
        let lost = lost.wrapping_add(1);
        self.counts.lost.store(lost, Ordering::Relaxed);
    }

    /// Bytes that find room now.
    pub fn room(&self) -> usize {
        let popped = self.counts.popped.load(Ordering::Acquire);
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        self.bytes.len().saturating_sub(pushed.wrapping_sub(popped))
    }
}

/// Where bytes come out.
#[derive(Debug)]
pub struct Outlet<'a> {
    bytes: &'a [AtomicU8],
    counts: &'a Counts,
    /// Losses told already.
    seen: u32,
}

impl Outlet<'_> {
    /// Take the oldest byte.
    pub fn pop(&mut self) -> Option<u8> {
        if self.is_empty() {
            return None;
        }
        let popped = self.counts.popped.load(Ordering::Relaxed);
        let byte = place(self.bytes, popped)?.load(Ordering::Relaxed);
        let popped = popped.wrapping_add(1);
        self.counts.popped.store(popped, Ordering::Release);
        Some(byte)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        let pushed = self.counts.pushed.load(Ordering::Acquire);
        pushed == self.counts.popped.load(Ordering::Relaxed)
    }

    fn lost(&self) -> u32 {
        self.counts.lost.load(Ordering::Relaxed)
    }
}

/// The place of a count; the length is a power of two.
fn place(bytes: &[AtomicU8], count: usize) -> Option<&AtomicU8> {
    bytes.get(count & bytes.len().wrapping_sub(1))
}

/// Bytes were lost for want of room or on the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overrun;

impl core::fmt::Display for Overrun {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("received bytes were lost")
    }
}

impl core::error::Error for Overrun {}

impl embedded_io::Error for Overrun {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Inlet<'_> {
    type Error = core::convert::Infallible;
}

impl Write for Inlet<'_> {
    /// As many as fit; it does not wait and may return 0.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        let mut taken = 0;
        for &byte in bytes {
            if !self.put(byte) {
                break;
            }
            taken += 1;
        }
        Ok(taken)
    }

    /// Does not wait: the interrupt empties the ring.
    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl WriteReady for Inlet<'_> {
    fn write_ready(&mut self) -> Result<bool, Self::Error> {
        Ok(self.room() > 0)
    }
}

impl ErrorType for Outlet<'_> {
    type Error = Overrun;
}

impl Read for Outlet<'_> {
    /// What is there; it does not wait and may return 0.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        let lost = self.lost();
        if core::mem::replace(&mut self.seen, lost) != lost {
            return Err(Overrun);
        }
        let mut read = 0;
        for place in buffer {
            let Some(byte) = self.pop() else {
                break;
            };
            *place = byte;
            read += 1;
        }
        Ok(read)
    }
}

impl ReadReady for Outlet<'_> {
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        Ok(!self.is_empty() || self.seen != self.lost())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::{Line, Lost, Serial};

    #[test]
    fn losses_are_told_once() {
        let (mut receive, mut transmit) = (Ring::<4>::new(), Ring::<4>::new());
        let (mut interrupt, reader) = receive.split();
        let (writer, mut wire) = transmit.split();
        let mut line = Serial::new(reader, writer);
        for byte in 1..=6 {
            interrupt.push(byte);
        }
        let mut buffer = [0; 8];
        assert_eq!(line.receive(&mut buffer), Err(Lost));
        assert_eq!(line.receive(&mut buffer), Ok(4));
        assert_eq!(buffer[..4], [1, 2, 3, 4]);
        assert_eq!(line.receive(&mut buffer), Ok(0));
        interrupt.mark_lost();
        assert_eq!(line.receive(&mut buffer), Err(Lost));
        assert_eq!((line.receive(&mut buffer), interrupt.room()), (Ok(0), 4));

        assert_eq!(line.send(b"abcdef"), Ok(()));
        let mut sent = std::vec::Vec::new();
        while let Some(byte) = wire.pop() {
            sent.push(byte);
            line.poll();
        }
        assert_eq!(sent, b"abcdef");
    }

    #[test]
    fn two_threads() {
        let mut ring = Ring::<16>::new();
        let (mut inlet, mut outlet) = ring.split();
        let mut wrong = 0;
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for n in 0..100_000u32 {
                    while inlet.room() == 0 {
                        std::thread::yield_now();
                    }
                    inlet.push(n as u8);
                }
            });
            let mut buffer = [0; 7];
            let mut n = 0u32;
            while n < 100_000 {
                let read = outlet.read(&mut buffer).expect("nothing is lost");
                for &byte in &buffer[..read] {
                    wrong += u32::from(byte != n as u8); // no panic: the other thread would wait for ever
                    n += 1;
                }
                std::thread::yield_now();
            }
        });
        assert_eq!(wrong, 0);
    }
}
