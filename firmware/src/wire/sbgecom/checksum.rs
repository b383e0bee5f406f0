//! The CRC-16 of sbgECom, its two bytes before the end mark.

use super::{END, TRAILER};
#[cfg(test)]
use crate::wire::checksum::count;
use crate::wire::checksum::{KERMIT, kermit_change};
use crate::wire::field::{changed, put, take};

fn checksum(frame: &[u8]) -> [u8; 2] {
    let crc = frame.len().saturating_sub(TRAILER);
    let summed = frame.get(2..crc).unwrap_or_default();
    #[cfg(test)]
    count::one(summed.len());
    KERMIT.checksum(summed).to_le_bytes()
}

/// Whether CRC and end mark are right.
pub fn is_right(frame: &[u8]) -> bool {
    let [low, high, end] = take(frame, frame.len().saturating_sub(TRAILER));
    end == END && checksum(frame) == [low, high]
}

/// Recomputes CRC and end mark.
pub fn seal(frame: &mut [u8]) {
    let [low, high] = checksum(frame);
    put(frame, frame.len().saturating_sub(TRAILER), [low, high, END]);
}

/// Does `work` on the `N` bytes at `at`, and changes the CRC with them: CRCs are linear. `None`,
/// and nothing is done, where the `N` bytes are not before the CRC.
#[inline(always)]
pub fn resealed<const N: usize>(
    frame: &mut [u8],
    at: usize,
    work: impl FnOnce(&mut [u8; N]),
) -> Option<()> {
    let crc = frame.len().checked_sub(TRAILER)?;
    let after = crc.checked_sub(at + N)?;
    let ((), bits) = changed(frame, at, work)?;
    let sum = u16::from_le_bytes(take(frame, crc)) ^ kermit_change(&bits, after);
    put(frame, crc, sum.to_le_bytes());
    Some(())
}
