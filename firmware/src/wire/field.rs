//! Fields at fixed offsets, as total functions.
//!
//! The length of a frame is checked once, by its scan. The functions here are total all the same:
//! outside the buffer they read zeros and write nothing. So nothing in this layer can panic,
//! whatever a line delivers.

pub use crate::remainder::{I24_MAX, I24_MIN, saturate_i24};
use core::sync::atomic::{Ordering, compiler_fence};

/// `N` bytes at `at`; zeros where the buffer is too short.
#[inline]
pub fn take<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    match bytes.get(at..).and_then(|rest| rest.first_chunk::<N>()) {
        Some(field) => *field,
        None => [0; N],
    }
}

/// Write `N` bytes at `at`; nothing where the buffer is too short.
#[inline]
pub fn put<const N: usize>(bytes: &mut [u8], at: usize, field: [u8; N]) {
    if let Some(place) = bytes
        .get_mut(at..)
        .and_then(|rest| rest.first_chunk_mut::<N>())
    {
        *place = field;
    }
}

/// Lets `work` write to the `N` bytes from `at` and returns which bits it changed. `None`, and
/// nothing is done, where the buffer is too short. Four bytes are compared at a time, so `N` is a
/// multiple of four.
#[inline(always)]
pub(super) fn changed<const N: usize, R>(
    bytes: &mut [u8],
    at: usize,
    work: impl FnOnce(&mut [u8; N]) -> R,
) -> Option<(R, [u8; N])> {
    const {
        assert!(N.is_multiple_of(4), "four bytes at a time");
    }
    let place = bytes.get_mut(at..)?.first_chunk_mut::<N>()?;
    let mut bits = *place;
    let result = work(place);
    for (bits, place) in bits
        .as_chunks_mut::<4>()
        .0
        .iter_mut()
        .zip(place.as_chunks::<4>().0)
    {
        *bits = (u32::from_ne_bytes(*bits) ^ u32::from_ne_bytes(*place)).to_ne_bytes();
    }
    Some((result, bits))
}

/// Does `work` on the `N` bytes at `at`, and changes the four bytes of the CRC at the frame's end
/// with them. `crc` gives the change, from the changed bits and the number of bytes between them
/// and the CRC. `None`, and nothing is done, where the `N` bytes are not before the CRC.
#[inline(always)]
pub fn resealed<const N: usize, R>(
    frame: &mut [u8],
    at: usize,
    crc: impl FnOnce(&[u8], usize) -> [u8; 4],
    work: impl FnOnce(&mut [u8; N]) -> R,
) -> Option<R> {
    let end = frame.len().checked_sub(4)?;
    let after = end.checked_sub(at + N)?;
    let (result, bits) = changed(frame, at, work)?;
    let sum = u32::from_ne_bytes(take(frame, end)) ^ u32::from_ne_bytes(crc(&bits, after));
    put(frame, end, sum.to_ne_bytes());
    Some(result)
}

/// Copies `bytes` to `to`, which is as long, a word at a time: neither is aligned, and the
/// library's copy takes up to three times as many instructions then. The fence, which is no
/// instruction, keeps the compiler from calling that all the same.
#[inline(always)]
pub fn copy(mut to: &mut [u8], mut bytes: &[u8]) {
    while copied::<32>(&mut to, &mut bytes) {}
    copied::<16>(&mut to, &mut bytes);
    copied::<8>(&mut to, &mut bytes);
    copied::<4>(&mut to, &mut bytes);
    for (place, byte) in to.iter_mut().zip(bytes) {
        *place = *byte;
    }
}

/// Copies the first `N` bytes, if there are so many, and leaves the others.
#[inline(always)]
fn copied<const N: usize>(to: &mut &mut [u8], bytes: &mut &[u8]) -> bool {
    let Some((from, rest)) = bytes.split_first_chunk::<N>() else {
        return false;
    };
    let Some((place, to_rest)) = core::mem::take(to).split_first_chunk_mut::<N>() else {
        return false;
    };
    for (place, word) in place
        .as_chunks_mut::<4>()
        .0
        .iter_mut()
        .zip(from.as_chunks::<4>().0)
    {
        *place = *word;
        compiler_fence(Ordering::AcqRel);
    }
    (*to, *bytes) = (to_rest, rest);
    true
}

/// The first `len` bytes; all of them where there are fewer.
#[inline]
pub fn head(bytes: &[u8], len: usize) -> &[u8] {
    bytes.get(..len).unwrap_or(bytes)
}

/// The axes of finite numbers, x in bit 0.
pub(super) fn finite(triad: &[f32; 3]) -> u8 {
    let axes = triad.iter().enumerate();
    axes.fold(0, |set, (axis, value)| {
        set | u8::from(value.is_finite()) << axis
    })
}

/// 24-bit two's complement, most significant byte first.
#[inline]
pub fn be_i24(bytes: &[u8], at: usize) -> i32 {
    let [high, middle, low] = take(bytes, at);
    i32::from_be_bytes([high, middle, low, 0]) >> 8 // arithmetic shift: carries the sign
}

/// Write the low 24 bits of `value`, most significant byte first: wraps; see [`saturate_i24`].
#[inline]
pub fn put_be_i24(bytes: &mut [u8], at: usize, value: i32) {
    let [_, high, middle, low] = value.to_be_bytes();
    put(bytes, at, [high, middle, low]);
}

/// Result of comparing a start mark with the bytes at hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// All bytes of the mark are there.
    Whole,
    /// The bytes at hand agree, but more are needed.
    Part,
    /// Something disagrees.
    No,
}

/// Compare the beginning of `bytes` with `mark`.
#[inline]
pub fn mark(bytes: &[u8], mark: &[u8]) -> Mark {
    if bytes.iter().zip(mark).any(|(a, b)| a != b) {
        Mark::No
    } else if bytes.len() < mark.len() {
        Mark::Part
    } else {
        Mark::Whole
    }
}

/// Golden bytes as they are printed in their sources.
#[cfg(test)]
pub const fn hex<const N: usize>(text: &str) -> [u8; N] {
    let text = text.as_bytes();
    assert!(text.len() == 2 * N);
    let mut bytes = [0; N];
    let mut i = 0;
    while i < 2 * N {
        let digit = match text[i] {
            c @ b'0'..=b'9' => c - b'0',
            c => (c | 0x20) - b'a' + 10,
        };
        bytes[i / 2] = bytes[i / 2] << 4 | digit;
        i += 1;
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outside_the_buffer_reads_zero_and_writes_nothing() {
        let mut bytes = [1, 2, 3];
        assert_eq!(take::<2>(&bytes, 1), [2, 3]);
        assert_eq!(take::<2>(&bytes, 2), [0, 0]);
        assert_eq!(take::<2>(&bytes, usize::MAX), [0, 0]);
        put(&mut bytes, 2, [9, 9]);
        put(&mut bytes, usize::MAX, [9]);
        assert_eq!(bytes, [1, 2, 3]);
    }

    #[test]
    fn every_length_is_copied() {
        let bytes: [u8; 70] = core::array::from_fn(|at| at as u8 + 1);
        for len in 0..=bytes.len() {
            let mut to = [0; 71];
            copy(&mut to[..len], &bytes[..len]);
            assert_eq!(to[..len], bytes[..len]);
            assert!(to[len..].iter().all(|byte| *byte == 0), "{len}");
        }
    }

    #[test]
    fn i24_keeps_sign_and_holds_at_its_ends() {
        let mut bytes = [0; 3];
        for value in [0, 1, -1, I24_MAX, I24_MIN, 0x0012_3456, -0x0012_3456] {
            put_be_i24(&mut bytes, 0, value);
            assert_eq!(be_i24(&bytes, 0), value);
        }
        assert_eq!(saturate_i24(I24_MAX + 1), (I24_MAX, true));
        assert_eq!(saturate_i24(I24_MIN - 1), (I24_MIN, true));
        assert_eq!(saturate_i24(I24_MIN), (I24_MIN, false));
    }

    #[test]
    fn a_mark_may_be_incomplete() {
        assert_eq!(mark(&[], &[1, 2]), Mark::Part);
        assert_eq!(mark(&[1], &[1, 2]), Mark::Part);
        assert_eq!(mark(&[1, 2, 3], &[1, 2]), Mark::Whole);
        assert_eq!(mark(&[1, 3], &[1, 2]), Mark::No);
    }
}
