//! Bytes between an interrupt and the loop.
//!
//! There is one ring for each direction. For received bytes the interrupt calls [`Producer::push`]
//! and the frame path reads the [`Consumer`]. For sent bytes the frame path writes the [`Producer`]
//! and the interrupt calls [`Consumer::pop`]. A ring has one producer and one consumer, and no
//! lock.
//!
//! It is written with atomics. The ends of `heapless::spsc` divide by a length that they only know
//! at run time, and the check for a division by zero would be a panic in the image.
//!
//! **Why no byte is read early or overwritten.** `pushed` is written by the producer alone,
//! `popped` by the consumer alone, and each only grows (modulo 2^32).
//!
//! 1. The producer stores a byte and then the higher `pushed` (release). The consumer loads
//!    `pushed` (acquire) and then the byte. So it finds the byte, or a count from before the byte.
//! 2. The consumer loads a byte and then stores the higher `popped` (release). The producer loads
//!    `popped` (acquire) before it stores into the same position again. So it overwrites no byte
//!    that has not been read.
//! 3. A count that is out of date is too low. The producer then sees less room than there is, and
//!    the consumer fewer bytes: never more than `N` bytes lie between the counts.
//! 4. An end that is interrupted by the other one between its load and its store is the case of 3:
//!    what it stores is a count of its own.
//!
//! **Upset memory.** A flipped bit of a count moves it by up to 2^31, and the ring would give its
//! old bytes again and again. Counts that are further apart than the ring is long are not possible
//! otherwise, so the end where bytes come out then drops what is in it, which is a loss.
//!
//! All places are atomics, so a mistake here would be a wrong byte and no undefined behaviour.
//! `tests/orders` builds this file with loom's atomics and runs its ends in every order.

use super::atomics::{AtomicU8, AtomicU32, AtomicUsize, Ordering};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

/// Storage of a ring for `N` bytes, a power of two.
#[derive(Debug)]
pub struct Ring<const N: usize> {
    bytes: [AtomicU8; N],
    counts: Counts,
}

/// Counts since start, modulo 2^32. Each has one writer.
#[derive(Debug)]
struct Counts {
    /// Bytes put in. Written by the producer.
    pushed: AtomicUsize,
    /// Bytes taken out. Written by the consumer.
    popped: AtomicUsize,
    /// Times that bytes were lost. Written by the producer.
    lost: AtomicU32,
}

impl<const N: usize> Default for Ring<N> {
    fn default() -> Ring<N> {
        Ring::new()
    }
}

impl<const N: usize> Ring<N> {
    /// An empty ring.
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

    /// The end where bytes go in. Use one at a time: bytes of two would replace each other.
    #[inline(always)]
    pub const fn producer(&self) -> Producer<'_> {
        Producer {
            bytes: &self.bytes,
            counts: &self.counts,
        }
    }

    /// The end where bytes come out. Use one at a time. It reports losses from now on.
    #[inline(always)]
    pub fn consumer(&self) -> Consumer<'_> {
        Consumer {
            bytes: &self.bytes,
            counts: &self.counts,
            seen: self.counts.lost.load(Ordering::Relaxed),
        }
    }

    /// Bytes that have gone in since start, wrapping.
    #[inline(always)]
    pub fn pushed(&self) -> usize {
        self.counts.pushed.load(Ordering::Acquire)
    }

    /// Number of bytes, for a caller that does not look at them then.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.counts.pushed.load(Ordering::Relaxed)
    }

    /// [`Producer::push`] for the shortest of interrupts. Returns the count of bytes after it.
    #[inline(always)]
    pub fn push(&self, byte: u8) -> usize {
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        let popped = self.counts.popped.load(Ordering::Acquire);
        match self.bytes.get(pushed % N) {
            Some(place) if pushed.wrapping_sub(popped) < N => {
                place.store(byte, Ordering::Relaxed);
                let pushed = pushed.wrapping_add(1);
                self.counts.pushed.store(pushed, Ordering::Release);
                pushed
            }
            _ => {
                self.producer().mark_lost();
                pushed
            }
        }
    }

    /// [`Consumer::pop`] for the shortest of interrupts.
    #[inline(always)]
    pub fn pop(&self) -> Option<u8> {
        let popped = self.counts.popped.load(Ordering::Relaxed);
        match self.pushed().wrapping_sub(popped) {
            0 => return None,
            there if there > N => {
                self.clear();
                return None;
            }
            _ => {}
        }
        let byte = self.bytes.get(popped % N)?.load(Ordering::Relaxed);
        let popped = popped.wrapping_add(1);
        self.counts.popped.store(popped, Ordering::Release);
        Some(byte)
    }
}

/// For a controller that moves bytes by itself (module `dma`), instead of producer or consumer.
impl<const N: usize> Ring<N> {
    /// The places where the next bytes go in, as far as they are free and in one piece.
    #[inline(always)]
    pub fn free(&self) -> &[AtomicU8] {
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        let popped = self.counts.popped.load(Ordering::Acquire);
        piece(
            &self.bytes,
            pushed,
            N.saturating_sub(pushed.wrapping_sub(popped)),
        )
    }

    /// Notes that so many bytes have gone into [`Ring::free`]. Returns the count of bytes after
    /// them.
    #[inline(always)]
    pub fn filled(&self, bytes: usize) -> usize {
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        let pushed = pushed.wrapping_add(bytes);
        self.counts.pushed.store(pushed, Ordering::Release);
        pushed
    }

    /// The oldest bytes, as far as they are in one piece.
    #[inline(always)]
    pub fn oldest(&self) -> &[AtomicU8] {
        let popped = self.counts.popped.load(Ordering::Relaxed);
        match self.pushed().wrapping_sub(popped) {
            there if there <= N => piece(&self.bytes, popped, there),
            _ => {
                self.clear();
                &[]
            }
        }
    }

    /// Bytes that have been taken out since start, modulo 2^32.
    pub fn popped(&self) -> usize {
        self.counts.popped.load(Ordering::Relaxed)
    }

    /// Takes out all that is there.
    pub fn clear(&self) {
        self.counts.popped.store(self.pushed(), Ordering::Release);
    }

    /// Notes that so many of the oldest bytes have been taken out.
    #[inline(always)]
    pub fn emptied(&self, bytes: usize) {
        let popped = self.counts.popped.load(Ordering::Relaxed);
        let popped = popped.wrapping_add(bytes);
        self.counts.popped.store(popped, Ordering::Release);
    }
}

/// At most `len` bytes from a count on, not beyond the ring's end.
#[inline(always)]
fn piece(bytes: &[AtomicU8], count: usize, len: usize) -> &[AtomicU8] {
    let (to_end, _) = from(bytes, count);
    to_end.get(..len).unwrap_or(to_end)
}

/// The end at which bytes go in.
#[derive(Debug)]
pub struct Producer<'a> {
    bytes: &'a [AtomicU8],
    counts: &'a Counts,
}

impl Producer<'_> {
    /// Puts a byte in. A byte without room is lost, and the consumer reports it.
    #[inline(always)]
    pub fn push(&mut self, byte: u8) {
        if !self.put(byte) {
            self.mark_lost();
        }
    }

    #[inline(always)]
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

    /// Puts all bytes in, or none. False: there is no room for all.
    pub fn put_all(&mut self, bytes: &[u8]) -> bool {
        self.put_all_by(bytes, put)
    }

    /// [`Self::put_all`] with this function instead of [`put`].
    #[inline(always)]
    pub fn put_all_by(&mut self, bytes: &[u8], put: fn(&[AtomicU8], &[u8])) -> bool {
        let popped = self.counts.popped.load(Ordering::Acquire);
        let pushed = self.counts.pushed.load(Ordering::Relaxed);
        let there = pushed.wrapping_sub(popped);
        if self.bytes.len().saturating_sub(there) < bytes.len() {
            return false;
        }
        let (to, wrapped) = from(self.bytes, pushed);
        if bytes.len() <= to.len() {
            put(to, bytes);
        } else {
            let (first, rest) = bytes.split_at_checked(to.len()).unwrap_or_default();
            put(to, first);
            put(wrapped, rest);
        }
        let pushed = pushed.wrapping_add(bytes.len());
        self.counts.pushed.store(pushed, Ordering::Release);
        true
    }

    /// Notes that bytes were lost before they came here: a UART's overrun, framing or parity error.
    /// The consumer reports it.
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

/// The end at which bytes come out.
#[derive(Debug)]
pub struct Consumer<'a> {
    bytes: &'a [AtomicU8],
    counts: &'a Counts,
    /// Losses reported already.
    seen: u32,
}

impl Consumer<'_> {
    /// Bytes that have come out since start, wrapping.
    pub fn popped(&self) -> usize {
        self.counts.popped.load(Ordering::Relaxed)
    }

    /// Takes the oldest byte.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<u8> {
        let popped = self.counts.popped.load(Ordering::Relaxed);
        let pushed = self.counts.pushed.load(Ordering::Acquire);
        match pushed.wrapping_sub(popped) {
            0 => return None,
            there if there > self.bytes.len() => {
                self.counts.popped.store(pushed, Ordering::Release);
                return None;
            }
            _ => {}
        }
        let byte = place(self.bytes, popped)?.load(Ordering::Relaxed);
        let popped = popped.wrapping_add(1);
        self.counts.popped.store(popped, Ordering::Release);
        Some(byte)
    }

    /// Whether the ring is empty.
    pub fn is_empty(&self) -> bool {
        let pushed = self.counts.pushed.load(Ordering::Acquire);
        pushed == self.counts.popped.load(Ordering::Relaxed)
    }

    /// [`Read::read`] with this function instead of [`get`].
    ///
    /// # Errors
    /// [`Overrun`], once for all losses since the last call.
    #[inline(always)]
    pub fn read_by(
        &mut self,
        buffer: &mut [u8],
        get: fn(&[AtomicU8], &mut [u8]),
    ) -> Result<usize, Overrun> {
        let lost = self.lost();
        if core::mem::replace(&mut self.seen, lost) != lost {
            return Err(Overrun);
        }
        let popped = self.popped();
        let pushed = self.counts.pushed.load(Ordering::Acquire);
        let there = pushed.wrapping_sub(popped);
        if there > self.bytes.len() {
            self.counts.popped.store(pushed, Ordering::Release);
            return Err(Overrun);
        }
        let read = there.min(buffer.len());
        let (bytes, wrapped) = from(self.bytes, popped);
        let places = buffer.get_mut(..read).unwrap_or_default();
        if places.len() <= bytes.len() {
            get(bytes, places);
        } else {
            let (first, rest) = places.split_at_mut_checked(bytes.len()).unwrap_or_default();
            get(bytes, first);
            get(wrapped, rest);
        }
        let popped = popped.wrapping_add(read);
        self.counts.popped.store(popped, Ordering::Release);
        Ok(read)
    }

    /// Whether there are losses to report.
    pub fn has_lost(&self) -> bool {
        self.seen != self.lost()
    }

    fn lost(&self) -> u32 {
        self.counts.lost.load(Ordering::Relaxed)
    }
}

/// The position of a count; the length is a power of two.
fn place(bytes: &[AtomicU8], count: usize) -> Option<&AtomicU8> {
    bytes.get(count & bytes.len().wrapping_sub(1))
}

/// The places from a count to the end, and all that follow when the ring goes round.
fn from(bytes: &[AtomicU8], count: usize) -> (&[AtomicU8], &[AtomicU8]) {
    let first = count & bytes.len().wrapping_sub(1);
    (bytes.get(first..).unwrap_or_default(), bytes)
}

/// Copies `bytes` to `to`, which is at least as long: four at a time, since the loop costs more
/// than a byte.
#[inline(never)]
pub fn put(to: &[AtomicU8], bytes: &[u8]) {
    let to = to.get(..bytes.len()).unwrap_or_default();
    let ((to, to_rest), (bytes, rest)) = (to.as_chunks::<4>(), bytes.as_chunks::<4>());
    for (to, bytes) in to.iter().zip(bytes) {
        for (place, byte) in to.iter().zip(bytes) {
            place.store(*byte, Ordering::Relaxed);
        }
    }
    for (place, byte) in to_rest.iter().zip(rest) {
        place.store(*byte, Ordering::Relaxed);
    }
}

/// Fills `to` from `bytes`, which are at least as many.
#[inline(never)]
pub fn get(bytes: &[AtomicU8], to: &mut [u8]) {
    let bytes = bytes.get(..to.len()).unwrap_or_default();
    let ((bytes, bytes_rest), (to, rest)) = (bytes.as_chunks::<4>(), to.as_chunks_mut::<4>());
    for (bytes, to) in bytes.iter().zip(to) {
        for (byte, place) in bytes.iter().zip(to) {
            *place = byte.load(Ordering::Relaxed);
        }
    }
    for (byte, place) in bytes_rest.iter().zip(rest) {
        *place = byte.load(Ordering::Relaxed);
    }
}

/// Bytes were lost for lack of room or on the line.
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

impl ErrorType for Producer<'_> {
    type Error = core::convert::Infallible;
}

impl Write for Producer<'_> {
    /// Writes as many as fit. It does not wait and may return 0.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        let taken = bytes.len().min(self.room());
        self.put_all(bytes.get(..taken).unwrap_or_default());
        Ok(taken)
    }

    /// Does not wait: the interrupt empties the ring.
    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl WriteReady for Producer<'_> {
    fn write_ready(&mut self) -> Result<bool, Self::Error> {
        Ok(self.room() > 0)
    }
}

impl ErrorType for Consumer<'_> {
    type Error = Overrun;
}

impl Read for Consumer<'_> {
    /// Reads what is there. It does not wait and may return 0.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        self.read_by(buffer, get)
    }
}

impl ReadReady for Consumer<'_> {
    fn read_ready(&mut self) -> Result<bool, Overrun> {
        Ok(!self.is_empty() || self.seen != self.lost())
    }
}
