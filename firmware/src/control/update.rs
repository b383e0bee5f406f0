//! Updates of the firmware (`crate::update`): why one is refused, and what is reported.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Why an update is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// It does not begin as an image that this firmware knows.
    Header,
    /// It is signed with another key than the device expects, or was changed afterwards.
    Signature,
    /// It is of another board.
    Board,
    /// It runs at another place of the flash than the free slot.
    Slot,
    /// It is longer than the slot.
    Length,
    /// It is older than the firmware that runs, and that was not asked for.
    Older,
    /// The firmware that runs is itself on trial.
    Trial,
    /// No update was begun.
    NotBegun,
    /// A piece does not follow the one before it; how many bytes have been received is given.
    Order(u32),
    /// What the flash holds is not what was signed.
    Digest,
    /// The flash does not erase, or does not keep what is written.
    Flash,
}

/// The image that runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Running {
    /// A probe has flashed it.
    #[default]
    Flashed,
    /// An update on trial: until it is confirmed, the next start goes back to the one before.
    Trial,
    /// An update that has proved itself.
    Confirmed,
}

/// Progress of an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Step {
    /// None was begun since start.
    #[default]
    Idle,
    /// Pieces are awaited.
    Receives,
    /// It is whole and checked; the next start tries it.
    Ready,
}

/// State of the updates, as reported.
///
/// It is encoded as [`Report::to_bytes`]: field by field it would take 4 kB of flash on every
/// board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Report {
    /// The image that runs.
    pub running: Running,
    /// Address of the free slot.
    pub slot: u32,
    /// Length of the longest image for the free slot, bytes.
    pub room: u32,
    /// The first bytes of the public key (ed25519) that images must be signed for.
    pub signer: u64,
    /// Progress of an update.
    pub step: Step,
    /// The first bytes of the signed digest of the update in progress.
    pub digest: u64,
    /// Bytes of it received.
    pub received: u32,
    /// Version of an update that was tried and has not been confirmed; it is in the free slot.
    pub failed: Option<[u16; 3]>,
}

/// Bytes of a report.
const REPORT_LEN: usize = 36;

impl Report {
    /// Its bytes, all numbers little-endian but for the two of 64 bits.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; REPORT_LEN] {
        let [major, minor, patch] = self.failed.unwrap_or_default();
        let patch = patch.to_le_bytes();
        let states = [self.running as u8, self.step as u8];
        let fields: [&[u8]; 9] = [
            &states,
            &[self.failed.is_some().into(), 0],
            &self.slot.to_le_bytes(),
            &self.room.to_le_bytes(),
            &self.received.to_le_bytes(),
            &self.signer.to_be_bytes(),
            &self.digest.to_be_bytes(),
            &[major as u8, minor as u8],
            &patch,
        ];
        let mut bytes = [0; REPORT_LEN];
        for (place, byte) in bytes.iter_mut().zip(fields.into_iter().flatten()) {
            *place = *byte;
        }
        bytes
    }

    /// Decodes them. What is missing at the end is 0.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Report {
        let word = |at| u32::from_le_bytes(take(bytes, at));
        let [running, step, failed] = take(bytes, 0);
        let [major, minor] = take(bytes, 32);
        let patch = u16::from_le_bytes(take(bytes, 34));
        Report {
            running: match running {
                1 => Running::Trial,
                2 => Running::Confirmed,
                _ => Running::Flashed,
            },
            step: match step {
                1 => Step::Receives,
                2 => Step::Ready,
                _ => Step::Idle,
            },
            failed: (failed != 0).then(|| [u16::from(major), u16::from(minor), patch]),
            slot: word(4),
            room: word(8),
            received: word(12),
            signer: u64::from_be_bytes(take(bytes, 16)),
            digest: u64::from_be_bytes(take(bytes, 24)),
        }
    }
}

/// `N` bytes at `at`; zeros where there are fewer.
fn take<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let field = bytes.get(at..).and_then(|rest| rest.first_chunk());
    field.copied().unwrap_or([0; N])
}

impl Serialize for Report {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.to_bytes())
    }
}

impl<'de> Deserialize<'de> for Report {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Report, D::Error> {
        <&[u8]>::deserialize(deserializer).map(Report::from_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_comes_back_from_its_bytes() {
        let of = |running, step, failed| Report {
            running,
            step,
            failed,
            slot: 0x0810_0000,
            room: 785_920,
            received: 77,
            signer: 0x0123_4567_89AB_CDEF,
            digest: u64::MAX - 1,
        };
        for report in [
            of(Running::Trial, Step::Ready, Some([1, 2, 300])),
            of(Running::Confirmed, Step::Receives, None),
            Report::default(),
        ] {
            assert_eq!(Report::from_bytes(&report.to_bytes()), report);
        }
        assert_eq!(Report::from_bytes(&[]), Report::default());
    }
}
