//! Finds out which format a line speaks.

use super::Format;
use super::framer::{Framer, Kind};

/// Consecutive good frames of one format that decide. One accidental 16-bit sum (HG4930) in a foreign stream is thinkable
/// (its two header bytes must agree as well), three in an unbroken row are not.
pub const ENOUGH: u8 = 3;

/// Tries all formats of inertial sensors on the same bytes. A good message between frames (CR LF, a control message)
/// does not interrupt a row; garbage or a wrong checksum does.
///
/// The bytes meanwhile are the caller's, to be passed on unchanged.
#[derive(Debug)]
pub struct Detector {
    candidates: [(Framer, u8); 4],
}

impl Default for Detector {
    fn default() -> Detector {
        Detector::new()
    }
}

impl Detector {
    /// A fresh one, about 2 KiB.
    pub const fn new() -> Detector {
        Detector {
            candidates: [
                (Framer::new(Format::Stim300), 0),
                (Framer::new(Format::Kvh), 0),
                (Framer::new(Format::Novatel), 0),
                (Framer::new(Format::Hg4930), 0),
            ],
        }
    }

    /// Look at some bytes; the format as soon as it is clear.
    pub fn push(&mut self, bytes: &[u8]) -> Option<Format> {
        for piece in bytes.chunks(super::framer::LONGEST) {
            for (framer, row) in &mut self.candidates {
                framer.push(piece);
                while let Some(event) = framer.next_event() {
                    *row = match event.kind() {
                        Kind::Frame => *row + 1,
                        Kind::Other => *row,
                        Kind::BadChecksum | Kind::Garbage | Kind::Unknown => 0,
                    };
                    if *row >= ENOUGH {
                        return Some(framer.format());
                    }
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::framer::tests::{ALL, frame};
    use super::*;

    #[test]
    fn three_frames_in_a_row_decide() {
        for format in ALL.into_iter().filter(|format| *format != Format::Ubx) {
            let mut detector = Detector::new();
            // joined in the middle of a frame; its rest may hold a false start that has to be waited out
            assert_eq!(detector.push(&frame(format, 0)[5..]), None);
            let decided = (1..10).find(|&n| {
                let found = detector.push(&frame(format, n));
                assert!(found.is_none_or(|found| found == format));
                found.is_some()
            });
            assert!(decided.is_some_and(|n| n >= 3), "{format:?} {decided:?}");
        }
    }

    #[test]
    fn a_row_must_be_unbroken() {
        let mut detector = Detector::new();
        for n in 0..100 {
            assert_eq!(detector.push(&frame(Format::Kvh, n)), None);
            assert_eq!(detector.push(&frame(Format::Kvh, n)), None);
            assert_eq!(detector.push(&[n]), None);
        }
        for n in 0..100 {
            assert_eq!(detector.push(&frame(Format::Ubx, n)), None);
        }
    }

    #[test]
    fn terminated_frames_are_one_row() {
        let mut detector = Detector::default();
        let mut line = std::vec::Vec::new();
        for n in 0..3 {
            line.extend(frame(Format::Stim300, n));
            line.extend(b"\r\n");
        }
        assert_eq!(detector.push(&line), Some(Format::Stim300));
    }
}
