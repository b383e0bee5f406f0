//! Reads a stream and compares the result with what was sent.

use crate::figures::Figures;
use crate::protocol::Protocol;
use crate::stream::{Stream, rng};
use firmware::wire::command::{Packets, Request, decode};
use firmware::wire::framer::{Framer, Kind};
use firmware::wire::{Framing, Scan};
use rand::RngExt;
use std::cell::Cell;
use std::ops::Range;

/// A format that counts wrong checksums.
#[derive(Clone, Copy, PartialEq)]
struct Counting<'c, F> {
    format: F,
    wrong: &'c Cell<u64>,
}

impl<F: Framing> Framing for Counting<'_, F> {
    fn scan(self, bytes: &[u8]) -> Scan {
        let scan = self.format.scan(bytes);
        if scan == Scan::BadChecksum {
            self.wrong.set(self.wrong.get() + 1);
        }
        scan
    }

    fn has_start_mark(self) -> bool {
        self.format.has_start_mark()
    }
}

/// The messages accepted so far.
struct Judge<'s> {
    stream: &'s Stream,
    figures: Figures,
    /// Index of the piece at which the search for the next accepted message begins.
    next: usize,
    /// For each piece: whether it was accepted at its position.
    found: Vec<bool>,
    /// Messages accepted at other positions.
    elsewhere: Vec<Range<usize>>,
}

/// Makes a chunk of a protocol and reads it.
///
/// # Errors
/// The rule that is broken, and where.
pub fn chunk(protocol: Protocol, number: u64, len: usize) -> Result<Figures, String> {
    let stream = Stream::new(protocol, number, len);
    let figures = read(&stream, number);
    figures.map_err(|what| format!("{}, chunk {number}: {what}", protocol.name()))
}

/// Reads a stream in pieces that depend on `number`.
///
/// # Errors
/// As [`chunk`].
pub fn read(stream: &Stream, number: u64) -> Result<Figures, String> {
    match stream.speaker.protocol {
        Protocol::Imu(format) => framed(stream, format, number),
        Protocol::Receiver(format) => framed(stream, format, number),
        Protocol::Command => packets(stream),
    }
}

fn framed(stream: &Stream, format: impl Framing, number: u64) -> Result<Figures, String> {
    let wrong = Cell::new(0);
    let wrong = &wrong;
    let mut judge = Judge::new(stream);
    let mut framer = Framer::new(Counting { format, wrong });
    let mut rng = rng(stream.speaker.protocol, number, 1);
    let (mut came, mut left) = (0, 0);
    while came < stream.bytes.len() {
        let longest = [1, 16, 64, 256][rng.random_range(0..4)];
        let end = (came + rng.random_range(1..=longest)).min(stream.bytes.len());
        framer.push(&stream.bytes[came..end]);
        while let Some(event) = framer.next_event() {
            let at = left..left + event.bytes().len();
            if stream.bytes.get(at.clone()) != Some(event.bytes()) {
                return Err(format!("other bytes came out than went in at {at:?}"));
            }
            left = at.end;
            match event.kind() {
                Kind::Frame => judge.frame(at, came)?,
                Kind::Other => judge.other(at),
                _ => {}
            }
        }
        came = end;
    }
    let rest = framer.flush().map_or(0, |event| event.bytes().len());
    if left + rest != came {
        return Err(format!("{} bytes did not come out", came - left - rest));
    }
    judge.figures.trials = wrong.get() + judge.figures.accidents();
    judge.close(|judge, piece| {
        let at = &stream.pieces[piece].at;
        let reaches = |other: &Range<usize>| other.start < at.end && at.start < other.end;
        judge.elsewhere.iter().any(reaches)
    })
}

fn packets(stream: &Stream) -> Result<Figures, String> {
    let mut judge = Judge::new(stream);
    let mut packets = Packets::new();
    for (end, &byte) in (1..).zip(&stream.bytes) {
        let Some(packet) = packets.push(byte) else {
            continue;
        };
        let at = end - 1 - packet.len()..end;
        if decode::<Request>(packet).is_ok() {
            judge.frame(at, end)?;
        } else {
            judge.figures.trials += 1;
        }
    }
    // a packet is joined to damage that does not end in a zero
    judge.close(|_, piece| piece > 0 && stream.pieces[piece - 1].damage.is_some())
}

impl<'s> Judge<'s> {
    fn new(stream: &'s Stream) -> Judge<'s> {
        let mut figures = Figures {
            bytes: stream.bytes.len() as u64,
            ..Figures::default()
        };
        for piece in &stream.pieces {
            match piece.damage {
                None => figures.good += 1,
                Some(_) => figures.damaged += 1,
            }
        }
        Judge {
            stream,
            figures,
            next: 0,
            found: vec![false; stream.pieces.len()],
            elsewhere: Vec::new(),
        }
    }

    /// Index of the undamaged piece at exactly these bytes.
    fn piece_at(&mut self, at: &Range<usize>) -> Option<usize> {
        let pieces = &self.stream.pieces;
        while pieces.get(self.next)?.at.end < at.end {
            self.next += 1;
        }
        let piece = pieces.get(self.next)?;
        (piece.at == *at && piece.damage.is_none()).then_some(self.next)
    }

    /// Notes an accepted frame. `came`: number of bytes received before the last push.
    fn frame(&mut self, at: Range<usize>, came: usize) -> Result<(), String> {
        if let Some(index) = self.piece_at(&at) {
            self.found[index] = true;
            self.figures.found += 1;
            if let Some(late) = came.checked_sub(at.end) {
                self.figures.late_bytes = self.figures.late_bytes.max(late as u64);
                let since = self.stream.pieces[index + 1..].iter();
                let frames = since
                    .take_while(|piece| piece.at.end <= came)
                    .filter(|piece| piece.damage.is_none());
                self.figures.late_frames = self.figures.late_frames.max(frames.count() as u64);
            }
            return Ok(());
        }
        let bytes = &self.stream.bytes[at.clone()];
        let around = self.stream.around(&at);
        // of a sentence the end of the line may be damaged
        let is_whole = |frame: &[u8]| frame == bytes || frame.strip_suffix(b"\r\n") == Some(bytes);
        if around.iter().any(|piece| is_whole(&piece.frame)) {
            self.figures.whole += 1;
        } else if self.stream.speaker.protocol.is_right(bytes) {
            let touched = around.iter().find(|piece| {
                piece.at.start < at.end && at.start < piece.at.end && piece.damage.is_some()
            });
            let kind = touched.and_then(|piece| piece.damage);
            let kind = kind.ok_or_else(|| format!("a frame without damage at {at:?}"))?;
            if kind == crate::kind::Kind::Bit && touched.is_some_and(|piece| piece.at == at) {
                return Err(format!("one wrong bit passes at {at:?}"));
            }
            *self.figures.accidents.entry(kind).or_default() += 1;
        } else {
            return Err(format!(
                "a frame with a wrong checksum at {at:?}: {bytes:02x?}"
            ));
        }
        self.elsewhere.push(at);
        Ok(())
    }

    fn other(&mut self, at: Range<usize>) {
        self.elsewhere.push(at);
    }

    /// Checks that every undamaged frame was accepted, unless `may_be_lost` allows its loss.
    fn close(mut self, may_be_lost: impl Fn(&Judge, usize) -> bool) -> Result<Figures, String> {
        let mut row = 0;
        for (n, piece) in self.stream.pieces.iter().enumerate() {
            if piece.damage.is_some() || self.found[n] {
                row = 0;
                continue;
            }
            if !may_be_lost(&self, n) {
                return Err(format!("an undamaged frame at {:?} is lost", piece.at));
            }
            row += 1;
            self.figures.lost += 1;
            self.figures.lost_in_a_row = self.figures.lost_in_a_row.max(row);
        }
        Ok(self.figures)
    }
}
