//! The bytes of a receiver's line to fixes.
//!
//! **Arrival** of a fix is when the first byte of its first message came, as far as the messages
//! are read. At 9600 bit/s the messages of an epoch take half a second, and how many other messages
//! are between them changes from second to second. The first byte is not delayed by this.
//!
//! A line that was silent for [`SILENCE_US`] has ended its epoch.

use super::ReceiverFormat;
use super::epoch::{Arrival, Joiner, Solution};
use crate::wire::detect::Detector;
use crate::wire::framer::{Framer, Kind};

/// After such a silence, nothing more of an epoch comes, microseconds.
pub const SILENCE_US: u64 = 100_000;

/// Reads a receiver's line.
#[derive(Debug)]
pub struct Receiver {
    /// The configured format; `None`: it is detected.
    configured: Option<ReceiverFormat>,
    /// The format is not known.
    detects: bool,
    detector: Detector<ReceiverFormat, { ReceiverFormat::ALL.len() }>,
    framer: Framer<ReceiverFormat>,
    joiner: Joiner,
    /// Arrival of the byte at the framer's head, and of the last ones.
    head: Arrival,
    last: Arrival,
    /// Bytes in the framer that came before the last ones.
    before: usize,
}

impl Receiver {
    /// A receiver of this format; `None`: it is detected.
    #[inline(never)]
    pub fn new(configured: Option<ReceiverFormat>) -> Receiver {
        let format = configured.unwrap_or(ReceiverFormat::Ubx);
        Receiver {
            configured,
            detects: configured.is_none(),
            detector: Detector::of(ReceiverFormat::ALL),
            framer: Framer::new(format),
            joiner: Joiner::new(format.usual()),
            head: Arrival::default(),
            last: Arrival::default(),
            before: 0,
        }
    }

    /// As [`Receiver::new`], in place: a new one would be built on the stack first.
    #[inline(never)]
    pub fn begin_anew(&mut self, configured: Option<ReceiverFormat>) {
        self.configured = configured;
        self.begin(configured.unwrap_or(ReceiverFormat::Ubx));
        if configured.is_none() {
            self.detect();
        }
        (self.head, self.last) = (Arrival::default(), Arrival::default());
    }

    /// The format; `None` while it is not known.
    pub fn format(&self) -> Option<ReceiverFormat> {
        (!self.detects).then(|| self.framer.format())
    }

    /// Whether the silence of the line ends an epoch that waits for more messages.
    #[inline]
    pub fn is_due(&self, now_us: u64) -> bool {
        self.joiner.waits() && now_us.saturating_sub(self.last.us) >= SILENCE_US
    }

    /// Receives at most [`crate::wire::framer::LONGEST`] bytes, or none while the line is idle.
    /// Afterwards [`Receiver::next_fix`] is to be called until there is none.
    #[inline(never)]
    pub fn push(&mut self, bytes: &[u8], now: Arrival) {
        if now.us.saturating_sub(self.last.us) >= SILENCE_US {
            self.joiner.silent();
        }
        if bytes.is_empty() {
            return;
        }
        self.last = now;
        if self.detects {
            if let Some(format) = self.detector.push(bytes, |_, _| {}) {
                self.begin(format);
            }
            return;
        }
        self.before = self.framer.pending();
        if self.before == 0 {
            self.head = now;
        }
        self.framer.push(bytes);
    }

    /// Detects the format.
    fn detect(&mut self) {
        self.detector.begin_anew(|format| format);
        self.detects = true;
    }

    /// Begins with this format.
    fn begin(&mut self, format: ReceiverFormat) {
        self.detects = false;
        self.framer.restart(format);
        self.joiner = Joiner::new(format.usual());
        self.before = 0;
    }

    /// The next fix that the bytes complete.
    #[inline(never)]
    pub fn next_fix(&mut self) -> Option<&Solution> {
        while !self.joiner.is_ready() {
            let format = self.framer.format();
            let event = self.framer.next_event()?;
            let (kind, len) = (event.kind(), event.bytes().len());
            if kind == Kind::Frame
                && let Some(head) = format.head(event.bytes())
                && let Some(values) = self.joiner.place(head, self.head)
            {
                format.read(event.bytes(), values);
            }
            if self.before <= len {
                self.head = self.last;
            }
            self.before = self.before.saturating_sub(len);
            if kind == Kind::Unknown && self.configured.is_none() {
                self.detect();
            }
        }
        self.joiner.take()
    }
}

#[cfg(test)]
mod tests;
