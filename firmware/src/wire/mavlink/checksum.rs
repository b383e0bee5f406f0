//! The CRC-16 of MAVLink. A byte that belongs to the kind of message (`CRC_EXTRA`) is summed behind
//! the payload and never sent, see [`super::extra`].

use super::Header;
#[cfg(test)]
use crate::wire::checksum::count;
use crate::wire::checksum::{KERMIT, kermit_change};
use crate::wire::field::{changed, put, take};

/// CRC-16/MCRF4XX of all bytes behind the start mark up to the end of the payload, and of
/// `CRC_EXTRA`.
fn checksum(message: &[u8], header: &Header, extra: u8) -> [u8; 2] {
    let summed = message.get(1..header.crc()).unwrap_or_default();
    #[cfg(test)]
    count::one(summed.len());
    let mut digest = KERMIT.digest_with_initial(0xFFFF);
    digest.update(summed);
    digest.update(&[extra]);
    digest.finalize().to_le_bytes()
}

/// Whether the CRC of a whole message is right.
pub fn is_right(message: &[u8], header: &Header, extra: u8) -> bool {
    checksum(message, header, extra) == take(message, header.crc())
}

/// Recomputes the CRC of a `HIGHRES_IMU`.
pub fn seal(message: &mut [u8], header: &Header) {
    let sum = checksum(message, header, super::CRC_EXTRA);
    put(message, header.crc(), sum);
}

/// Does `work` on the `N` bytes at `at` and changes the CRC with them. `None`, and nothing is done,
/// where they are not before the CRC.
#[inline(always)]
pub fn resealed<const N: usize>(
    message: &mut [u8],
    header: &Header,
    at: usize,
    work: impl FnOnce(&mut [u8; N]),
) -> Option<()> {
    let crc = header.crc();
    let after = crc.checked_sub(at + N)? + 1; // and `CRC_EXTRA`
    let ((), bits) = changed(message, at, work)?;
    let sum = u16::from_le_bytes(take(message, crc)) ^ kermit_change(&bits, after);
    put(message, crc, sum.to_le_bytes());
    Some(())
}
