//! Finds out which format an IMU sends.

use super::field::head;
use super::framer::{Finder, Kind, Unread};
use super::{ImuFormat, Settings};

/// Consecutive good frames of one format that decide. In a stream of another format one accidental
/// 16-bit sum (HG4930) is possible, where the two header bytes agree as well; three in an unbroken
/// row are not.
pub const ENOUGH: u8 = 3;

/// Tries all formats of inertial sensors on the same bytes. A good message between frames (CR LF, a
/// control message) does not interrupt a row; garbage or a wrong checksum does.
///
/// Meanwhile the caller passes the bytes on unchanged.
#[derive(Debug)]
pub struct Detector {
    /// Bytes that are not read yet, shared by all candidates.
    bytes: Unread,
    candidates: [Candidate; ImuFormat::ALL.len()],
}

#[derive(Debug)]
struct Candidate {
    finder: Finder,
    /// Bytes it has read of the unread ones.
    read: usize,
    /// Good frames in a row.
    row: u8,
}

impl Candidate {
    fn new(format: ImuFormat) -> Candidate {
        Candidate {
            finder: Finder::new(format),
            read: 0,
            row: 0,
        }
    }
}

impl Default for Detector {
    fn default() -> Detector {
        Detector::new()
    }
}

impl Detector {
    /// A fresh one.
    pub fn new() -> Detector {
        Detector {
            bytes: Unread::new(),
            candidates: ImuFormat::ALL.map(Candidate::new),
        }
    }

    /// Restarts in place: a new one would be built on the stack first. Frames that do not state
    /// their content are searched for in the layout of the settings.
    pub fn restart(&mut self, settings: &Settings) {
        self.bytes.clear();
        for candidate in &mut self.candidates {
            *candidate = Candidate::new(candidate.finder.format().configured(settings));
        }
    }

    /// Receives some bytes. Returns the format as soon as it is clear. Hands all other good
    /// messages to `other` (the special datagrams of a STIM300 above all, which state its units
    /// before the first frame). Formats with weak checksums may take a few bytes of another format
    /// for theirs.
    pub fn push(
        &mut self,
        bytes: &[u8],
        mut other: impl FnMut(ImuFormat, &[u8]),
    ) -> Option<ImuFormat> {
        for piece in bytes.chunks(super::framer::LONGEST) {
            self.bytes.push(piece);
            for candidate in &mut self.candidates {
                let format = candidate.finder.format();
                while let Some((kind, len)) = candidate.finder.find(self.bytes.from(candidate.read))
                {
                    if kind == Kind::Other {
                        other(format, head(self.bytes.from(candidate.read), len));
                    }
                    candidate.read += len;
                    candidate.row = match kind {
                        Kind::Frame => candidate.row.saturating_add(1),
                        Kind::Other | Kind::Long => candidate.row,
                        Kind::BadChecksum | Kind::Garbage | Kind::Unknown => 0,
                    };
                    if candidate.row >= ENOUGH {
                        return Some(format);
                    }
                }
            }
            let by_all = self.candidates.iter().map(|candidate| candidate.read).min();
            let by_all = self.bytes.take(by_all.unwrap_or_default()).len();
            for candidate in &mut self.candidates {
                candidate.read -= by_all;
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::ReceiverFormat;
    use crate::wire::examples::Examples;

    fn push(detector: &mut Detector, bytes: &[u8]) -> Option<ImuFormat> {
        detector.push(bytes, |_, _| {})
    }

    #[test]
    fn three_frames_in_a_row_decide() {
        for format in ImuFormat::ALL {
            let mut detector = Detector::new();
            // joined in the middle of a frame; its rest may hold a false start that has to be
            // waited out
            assert_eq!(push(&mut detector, &format.example(0)[5..]), None);
            let decided = (1..10).find(|&n| {
                let found = push(&mut detector, &format.example(n));
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
            assert_eq!(push(&mut detector, &ImuFormat::Kvh.example(n)), None);
            assert_eq!(push(&mut detector, &ImuFormat::Kvh.example(n)), None);
            assert_eq!(push(&mut detector, &[n]), None);
        }
        for n in 0..100 {
            assert_eq!(push(&mut detector, &ReceiverFormat::Ubx.example(n)), None);
        }
    }

    #[test]
    fn terminated_frames_are_one_row() {
        let mut detector = Detector::default();
        let mut line = std::vec::Vec::new();
        for n in 0..3 {
            line.extend(ImuFormat::Stim300.example(n));
            line.extend(b"\r\n");
        }
        assert_eq!(push(&mut detector, &line), Some(ImuFormat::Stim300));
    }

    /// Datagrams that a STIM300 sends at power-on, in front of its first frame.
    #[test]
    fn special_datagrams_are_handed_over() {
        use crate::wire::stim300::config::Config;
        let datagram = Config::DEFAULT.with_unit_codes(0, 0).emit();
        let mut detector = Detector::new();
        let mut heard = std::vec::Vec::new();
        for &byte in &datagram {
            detector.push(&[byte], |format, message| {
                heard.push((format, message.to_vec()));
            });
        }
        assert_eq!(heard, [(ImuFormat::Stim300, datagram.to_vec())]);
    }
}
