//! The bytes of a receiver's line to fixes.
//!
//! **Arrival** of a fix is when the first byte of its first message came, as far as the messages
//! are read. At 9600 bit/s the messages of an epoch take half a second, and how many other messages
//! are between them changes from second to second. The first byte is not delayed by this.
//!
//! A line that was silent for [`SILENCE_US`] has ended its epoch.
//!
//! **Which protocol?** Where none is configured, all are looked for all the time. A good message
//! with values is evidence by itself: its checksum and its header are right. The first protocol is
//! used from its first message on. Another one takes its place when it gives more values of a fix
//! (NMEA has no vertical velocity), or when the one in use has left the line. What stands between
//! the messages does not matter.

use super::ReceiverFormat;
use super::epoch::{Arrival, Head, Joiner, Solution, Values};
use super::voice::{Piece, Voice};
use crate::wire::field::head as first;
use crate::wire::framer::{Kind, Unread};
use crate::wire::nmea;

/// After such a silence, nothing more of an epoch comes, microseconds.
pub const SILENCE_US: u64 = 100_000;

/// Reads a receiver's line.
#[derive(Debug)]
pub struct Receiver {
    /// The configured format; `None`: it is detected.
    configured: Option<ReceiverFormat>,
    /// The format in use.
    used: Option<ReceiverFormat>,
    /// Bytes that are not read yet, shared by all formats.
    bytes: Unread,
    voices: [Voice; ReceiverFormat::ALL.len()],
    joiner: Joiner,
    /// Arrival of the last bytes.
    last: Arrival,
    /// They were followed by a silence, which has been noted; and it still has to end the epoch.
    quiet: bool,
    ends: bool,
    /// A sentence of NMEA had a checksum, so a missing one is damage.
    has_checksums: bool,
}

impl Receiver {
    /// A receiver of this format; `None`: it is detected.
    #[inline(never)]
    pub fn new(configured: Option<ReceiverFormat>) -> Receiver {
        let usual = configured.map_or(0, ReceiverFormat::usual);
        Receiver {
            configured,
            used: configured,
            bytes: Unread::new(),
            voices: ReceiverFormat::ALL.map(Voice::new),
            joiner: Joiner::new(usual),
            last: Arrival::default(),
            quiet: true,
            ends: false,
            has_checksums: false,
        }
    }

    /// As [`Receiver::new`], in place: a new one would be built on the stack first.
    #[inline(never)]
    pub fn restart(&mut self, configured: Option<ReceiverFormat>) {
        (self.configured, self.used) = (configured, configured);
        self.bytes.clear();
        for (voice, format) in self.voices.iter_mut().zip(ReceiverFormat::ALL) {
            *voice = Voice::new(format);
        }
        self.joiner = Joiner::new(configured.map_or(0, ReceiverFormat::usual));
        self.last = Arrival::default();
        (self.quiet, self.ends, self.has_checksums) = (true, false, false);
    }

    /// The format; `None` while it is not known.
    pub fn format(&self) -> Option<ReceiverFormat> {
        self.used
    }

    /// Time of the newest epoch, ms of the GPS week; `None` while there was no date.
    pub fn time_of_week(&mut self) -> Option<u32> {
        self.joiner.time_of_week()
    }

    /// Whether the silence of the line ends an epoch or a sentence that waits for more.
    #[inline]
    pub fn is_due(&self, now_us: u64) -> bool {
        !self.quiet && now_us.saturating_sub(self.last.us) >= SILENCE_US
    }

    /// Receives at most [`crate::wire::framer::LONGEST`] bytes, or none while the line is idle.
    /// Afterwards [`Receiver::next_fix`] is to be called until there is none.
    #[inline(never)]
    pub fn push(&mut self, bytes: &[u8], now: Arrival) {
        if self.is_due(now.us) {
            self.quiet = true;
            self.ends = self.ends_sentence() && bytes.is_empty();
            if !self.ends {
                self.joiner.silent();
            }
        }
        if bytes.is_empty() {
            return;
        }
        (self.last, self.quiet) = (now, false);
        self.add(bytes);
    }

    fn add(&mut self, bytes: &[u8]) {
        let unread = self.bytes.len();
        for voice in &mut self.voices {
            voice.comes(unread, self.last);
        }
        if self.bytes.push(bytes) < bytes.len() {
            self.restart(self.configured); // only an upset of memory stops all from reading
        }
    }

    /// Completes a sentence whose line ends in CR alone, or with the silence.
    fn ends_sentence(&mut self) -> bool {
        let read = self.voice(ReceiverFormat::Nmea).map_or(0, Voice::read);
        let unread = self.bytes.from(read);
        let ends = self.hears(ReceiverFormat::Nmea) && nmea::is_ended_by_silence(unread);
        if ends {
            self.add(&nmea::AFTER);
        }
        ends
    }

    fn voice(&self, format: ReceiverFormat) -> Option<&Voice> {
        self.voices.iter().find(|voice| voice.format() == format)
    }

    fn hears(&self, format: ReceiverFormat) -> bool {
        self.configured
            .is_none_or(|configured| configured == format)
    }

    /// The next fix that the bytes complete.
    #[inline(never)]
    pub fn next_fix(&mut self) -> Option<&Solution> {
        while !self.joiner.is_ready() {
            if self.message().is_none() {
                if !core::mem::take(&mut self.ends) {
                    return None;
                }
                self.joiner.silent();
            }
        }
        self.joiner.take()
    }

    /// Takes the next message, or what is none; `None` when more bytes are needed.
    fn message(&mut self) -> Option<()> {
        let Piece {
            format,
            kind,
            at,
            len,
            arrival,
        } = self.next_piece()?;
        let message = first(self.bytes.from(at), len);
        if !is_read(format, kind, message) {
            return Some(());
        }
        self.has_checksums |= format == ReceiverFormat::Nmea && kind == Kind::Frame;
        if kind == Kind::Other && (self.configured.is_none() || self.has_checksums) {
            return Some(()); // a checksum is missing, and nothing says that there is none
        }
        let head = format.head(message);
        if self.configured.is_none() {
            let mut values = Values::NONE;
            if head.is_some() {
                format.read(message, &mut values);
            }
            self.listen(format, head, &values);
        }
        if self.used != Some(format) {
            return Some(());
        }
        let message = first(self.bytes.from(at), len);
        if let Some(head) = head {
            if let Some(values) = self.joiner.place(head, arrival) {
                format.read(message, values);
            }
        } else if let Some((day, ms)) = format.date(message) {
            self.joiner.date_is(day, ms);
        }
        Some(())
    }

    /// The next piece of the line, of any format: that which ends first, so their order does not
    /// depend on how the line was cut. Bytes that all have read leave.
    fn next_piece(&mut self) -> Option<Piece> {
        let (configured, last) = (self.configured, self.last);
        let heard = |voice: &&mut Voice| configured.is_none_or(|one| one == voice.format());
        let voices = self.voices.iter_mut().filter(heard);
        let unread = self.bytes.from(0);
        let ends = voices.filter_map(|voice| Some((voice.look(unread, last)?, voice)));
        if let Some((_, voice)) = ends.min_by_key(|(end, _)| *end) {
            return voice.take();
        }
        let heard = self
            .voices
            .iter()
            .filter(|voice| self.hears(voice.format()));
        let by_all = heard.map(Voice::read).min().unwrap_or_default();
        let by_all = self.bytes.take(by_all).len();
        for voice in &mut self.voices {
            voice.left(by_all);
        }
        None
    }

    /// A good message of this format: it may be the one to use.
    fn listen(&mut self, format: ReceiverFormat, head: Option<Head>, values: &Values) {
        let mut voices = self.voices.iter_mut();
        let begins = voices
            .find(|voice| voice.format() == format)
            .is_some_and(|voice| voice.gives(head, values));
        let better = match self.used {
            None => true,
            Some(used) => (self.voice(format).zip(self.voice(used)))
                .is_some_and(|(this, used)| this.is_better_than(used)),
        };
        if better && self.used != Some(format) {
            self.used = Some(format);
            self.joiner = Joiner::new(format.usual());
        }
        if begins {
            let others = self
                .voices
                .iter_mut()
                .filter(|voice| voice.format() != format);
            others.for_each(Voice::misses);
        }
    }
}

/// Whether it is a message with values, or a sentence without a checksum.
fn is_read(format: ReceiverFormat, kind: Kind, message: &[u8]) -> bool {
    match kind {
        Kind::Frame => true,
        Kind::Other => format == ReceiverFormat::Nmea && nmea::lacks_checksum(message),
        _ => false,
    }
}

#[cfg(test)]
mod tests;
