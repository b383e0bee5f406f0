//! The checksums of the protocols, by name.
//!
//! Each CRC-32 uses a table of 1 KiB. The linker drops those of unused
//! formats. At 2 kHz and 63 bytes a frame, the form without a table would cost about 5 % of a 168
//! MHz Cortex-M4.

use super::field::head;
use crc::{Algorithm, CRC_16_KERMIT, CRC_16_XMODEM, CRC_32_ISO_HDLC, CRC_32_MPEG_2, Crc};

static MPEG_2: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);
static ISO_HDLC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// `NovAtel`: the reflected polynomial of zlib, but starting from 0 and without the final
/// inversion.
const CRC_32_NOVATEL: Algorithm<u32> = Algorithm {
    width: 32,
    poly: 0x04C1_1DB7,
    init: 0,
    refin: true,
    refout: true,
    xorout: 0,
    check: 0x2DFD_2D88,
    residue: 0,
};
static NOVATEL: Crc<u32> = Crc::<u32>::new(&CRC_32_NOVATEL);

/// CRC-32/MPEG-2 (STIM300, KVH): polynomial 0x04C11DB7, from all ones, not reflected, not inverted.
pub fn crc32_mpeg2(bytes: &[u8]) -> u32 {
    #[cfg(test)]
    count::one(bytes.len());
    mpeg2(!0, bytes)
}

/// [`crc32_mpeg2`] over a number of words that is known beforehand.
#[inline(always)]
pub fn crc32_mpeg2_words<const N: usize>(words: &[[u8; 4]; N]) -> u32 {
    #[cfg(test)]
    count::one(4 * N);
    mpeg2(!0, words.as_flattened())
}

/// CRC-32/MPEG-2 over `bytes` filled up with zeros to a multiple of four bytes (STIM300's dummy
/// bytes, never sent).
pub fn crc32_mpeg2_padded(bytes: &[u8]) -> u32 {
    #[cfg(test)]
    count::one(bytes.len());
    mpeg2(mpeg2(!0, bytes), dummies(bytes.len()))
}

/// The zeros that fill `len` bytes up to a multiple of four.
fn dummies(len: usize) -> &'static [u8] {
    match len % 4 {
        0 => &[],
        1 => &[0; 3],
        2 => &[0; 2],
        _ => &[0; 1],
    }
}

/// How [`crc32_mpeg2`] changes when `difference` is exclusive-ored to bytes that `after` others
/// follow. CRCs are linear, so this is the CRC from zero of the difference. Bytes before it do not
/// matter.
pub fn crc32_mpeg2_change(difference: &[u8], after: usize) -> u32 {
    mpeg2(mpeg2(0, difference), head(&[0; LONGEST], after))
}

/// [`crc32_mpeg2_padded_change`] of words most significant byte first, which begin a frame, for a
/// CRC before which `after` other bytes stand. Twelve instructions a word.
#[inline(always)]
pub fn crc32_mpeg2_padded_change_of<const N: usize>(differences: [u32; N], after: usize) -> u32 {
    let [table] = MPEG_2.table();
    let word = |crc: u32, word: u32| {
        let next = |crc: u32| crc << 8 ^ table[(crc >> 24) as usize];
        next(next(next(next(crc ^ word))))
    };
    let mut crc = 0;
    for difference in differences {
        crc = word(crc, difference);
    }
    if after == 4 {
        return word(crc, 0); // most frames
    }
    let mut left = after.min(LONGEST);
    while left > 0 {
        crc = word(crc, 0);
        left = left.saturating_sub(4);
    }
    crc
}

/// CRC-32/MPEG-2 from `crc` on. A word goes in at once: three instructions a byte then, where one
/// byte after the other takes six.
#[inline(always)]
fn mpeg2(mut crc: u32, bytes: &[u8]) -> u32 {
    let [table] = MPEG_2.table();
    let next = |crc: u32| crc << 8 ^ table[(crc >> 24) as usize];
    let (words, rest) = bytes.as_chunks::<4>();
    for word in words {
        crc = next(next(next(next(crc ^ u32::from_be_bytes(*word)))));
    }
    for byte in rest {
        crc = next(crc ^ u32::from(*byte) << 24);
    }
    crc
}

/// A reflected CRC continued over `bytes`.
#[inline(always)]
fn reflected(table: &[u32; 256], mut crc: u32, bytes: &[u8]) -> u32 {
    let next = |crc: u32| crc >> 8 ^ table[(crc & 0xFF) as usize];
    let (words, rest) = bytes.as_chunks::<4>();
    for word in words {
        crc = next(next(next(next(crc ^ u32::from_le_bytes(*word)))));
    }
    for byte in rest {
        crc = next(crc ^ u32::from(*byte));
    }
    crc
}

/// [`crc32_mpeg2_change`] for [`crc32_mpeg2_padded`], of bytes that begin with the difference.
pub fn crc32_mpeg2_padded_change(difference: &[u8], after: usize) -> u32 {
    let after = after + dummies(difference.len() + after).len();
    crc32_mpeg2_change(difference, after)
}

/// More bytes than follow the values in any frame.
const LONGEST: usize = 64;

/// [`crc32_zlib`] of bytes that come in pieces.
#[derive(Clone)]
pub struct Zlib(crc::Digest<'static, u32>);

impl Zlib {
    /// The CRC of no bytes.
    pub fn new() -> Zlib {
        Zlib(ISO_HDLC.digest())
    }

    /// The next bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The CRC of all bytes so far.
    pub fn value(self) -> u32 {
        self.0.finalize()
    }
}

impl Default for Zlib {
    fn default() -> Zlib {
        Zlib::new()
    }
}

impl core::fmt::Debug for Zlib {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Zlib")
    }
}

/// The ordinary reflected CRC-32 of zlib (our frames around ADIS bursts, our command link).
pub fn crc32_zlib(bytes: &[u8]) -> u32 {
    #[cfg(test)]
    count::one(bytes.len());
    let [table] = ISO_HDLC.table();
    !reflected(table, !0, bytes)
}

/// zlib's CRC-32 over 16-bit words sent most significant byte first but summed low byte first
/// (ADIS1649x).
pub fn crc32_zlib_swapped(words: &[u8]) -> u32 {
    let mut digest = ISO_HDLC.digest();
    for word in words.chunks_exact(2) {
        digest.update(&u16::from_be_bytes(super::field::take(word, 0)).to_le_bytes());
    }
    digest.finalize()
}

/// CRC-16/KERMIT (sbgECom): reflected polynomial 0x8408, from 0, not inverted. From all ones it is
/// MAVLink's CRC-16/MCRF4XX.
pub(super) static KERMIT: Crc<u16> = Crc::<u16>::new(&CRC_16_KERMIT);

/// CRC-16/XMODEM (VectorNav, SBF): polynomial 0x1021, from 0, not reflected, not inverted.
pub(super) static XMODEM: Crc<u16> = Crc::<u16>::new(&CRC_16_XMODEM);

/// CRC-16/XMODEM of these bytes.
#[inline(never)]
pub fn xmodem(bytes: &[u8]) -> u16 {
    #[cfg(test)]
    count::one(bytes.len());
    XMODEM.checksum(bytes)
}

/// Change of either Kermit CRC: as [`crc32_mpeg2_change`].
#[inline(never)] // four callers
pub fn kermit_change(difference: &[u8], after: usize) -> u16 {
    let mut digest = KERMIT.digest(); // from zero and without inversion
    digest.update(difference);
    digest.update(head(&[0; LONGEST], after));
    digest.finalize()
}

/// `NovAtel` OEM logs.
pub fn crc32_novatel(bytes: &[u8]) -> u32 {
    #[cfg(test)]
    count::one(bytes.len());
    let [table] = NOVATEL.table();
    reflected(table, 0, bytes)
}

/// Change of [`crc32_novatel`]: as [`crc32_mpeg2_change`].
pub fn crc32_novatel_change(difference: &[u8], after: usize) -> u32 {
    let [table] = NOVATEL.table();
    let crc = reflected(table, 0, difference);
    reflected(table, crc, head(&[0; LONGEST], after))
}

/// Sum of little-endian 16-bit words, modulo 2^16 (HG4930). It is weak: exchanged words and errors
/// that cancel pass.
pub fn sum16_le(bytes: &[u8]) -> u16 {
    #[cfg(test)]
    count::one(bytes.len());
    bytes.chunks_exact(2).fold(0, |sum: u16, word| {
        sum.wrapping_add(u16::from_le_bytes(super::field::take(word, 0)))
    })
}

/// Sum of big-endian words (Epson). As weak as [`sum16_le`].
pub fn sum16_be(bytes: &[u8]) -> u16 {
    #[cfg(test)]
    count::one(bytes.len());
    bytes.chunks_exact(2).fold(0, |sum: u16, word| {
        sum.wrapping_add(u16::from_be_bytes(super::field::take(word, 0)))
    })
}

/// Sum of bytes, modulo 2^16 (ADIS1646x/1647x/1650x). Weak in the same way.
pub fn sum_bytes(bytes: &[u8]) -> u16 {
    #[cfg(test)]
    count::one(bytes.len());
    bytes
        .iter()
        .fold(0, |sum, &byte| sum.wrapping_add(u16::from(byte)))
}

/// Fletcher's sum modulo 256 (UBX): the two bytes as they are sent.
pub fn fletcher8(bytes: &[u8]) -> [u8; 2] {
    #[cfg(test)]
    count::one(bytes.len());
    bytes.iter().fold([0u8; 2], |[a, b], &byte| {
        let a = a.wrapping_add(byte);
        [a, b.wrapping_add(a)]
    })
}

/// Number of bytes over which each checksum was computed, for the test that it happens once.
#[cfg(test)]
pub(super) mod count {
    use std::cell::RefCell;
    use std::vec::Vec;

    std::thread_local! {
        static PASSES: RefCell<Vec<usize>> = const { RefCell::new(Vec::new()) };
    }

    pub(in crate::wire) fn one(len: usize) {
        PASSES.with_borrow_mut(|passes| passes.push(len));
    }

    pub(in crate::wire) fn clear() {
        PASSES.with_borrow_mut(Vec::clear);
    }

    /// Number of checksums over at least `len` bytes.
    pub(in crate::wire) fn passes(len: usize) -> usize {
        PASSES.with_borrow(|passes| passes.iter().filter(|&&pass| pass >= len).count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The catalogue's check string.
    const CHECK: &[u8] = b"123456789";

    #[test]
    fn catalogue_check_values() {
        assert_eq!(crc32_mpeg2(CHECK), 0x0376_E6E7);
        assert_eq!(crc32_zlib(CHECK), 0xCBF4_3926);
        assert_eq!(KERMIT.checksum(CHECK), 0x2189);
        assert_eq!(xmodem(CHECK), 0x31C3);
        let mut mcrf4xx = KERMIT.digest_with_initial(0xFFFF);
        mcrf4xx.update(CHECK);
        assert_eq!(mcrf4xx.finalize(), 0x6F91);
        assert_eq!(crc32_novatel(CHECK), CRC_32_NOVATEL.check);
    }

    #[test]
    fn padding_is_to_whole_words() {
        for len in 0..9 {
            let mut padded = [0u8; 12];
            padded[..len].copy_from_slice(&CHECK[..len]);
            assert_eq!(
                crc32_mpeg2_padded(&CHECK[..len]),
                crc32_mpeg2(&padded[..len.next_multiple_of(4)])
            );
        }
    }

    /// The library's own loop takes a byte after the other.
    #[test]
    fn words_at_once_are_bytes_in_turn() {
        let bytes: [u8; 70] = core::array::from_fn(|i| (i * 37 + 11) as u8);
        for len in 0..bytes.len() {
            let bytes = &bytes[..len];
            assert_eq!(crc32_mpeg2(bytes), MPEG_2.checksum(bytes), "{len}");
            assert_eq!(crc32_zlib(bytes), ISO_HDLC.checksum(bytes), "{len}");
            assert_eq!(crc32_novatel(bytes), NOVATEL.checksum(bytes), "{len}");
            let mut zeros_follow = bytes.to_vec();
            zeros_follow.extend([0; 9]);
            let mut from_zero = MPEG_2.digest_with_initial(0);
            from_zero.update(&zeros_follow);
            assert_eq!(crc32_mpeg2_change(bytes, 9), from_zero.finalize(), "{len}");
            let novatel = NOVATEL.checksum(&zeros_follow);
            assert_eq!(crc32_novatel_change(bytes, 9), novatel, "{len}");
        }
    }

    /// ASCII logs of NovAtel's documentation and of `novatel_edie`.
    #[test]
    fn novatel_ascii_logs() {
        for (text, crc) in [
            (
                "RAWIMUSXA,1692,484620.664;00,11,1692,484620.664389000,00801503,43110635,-817242,-202184,-215194,-41188,-9895",
                0xA5DB_8C7B,
            ),
            (
                "RAWIMUSXA,2209,491674.014;04,41,2209,491674.013699,ea59fe00,329308016,-2706935,4508389,196192,417138,-1000837",
                0x0384_22A7,
            ),
            (
                "RAWIMUSA,2209,491612.254;2209,491612.253588,ea5afe00,329303960,-2512321,4410363,309705,607017,-1009773",
                0x1FB7_6C28,
            ),
            (
                "RAWIMUXA,USB1,0,64.5,FINESTEERING,2209,491740.110,02000020,0dc5,16809;04,41,2209,491740.109817,ea57fe00,329394068,-2396829,4481425,321199,257329,-936077",
                0xCF9C_035D,
            ),
        ] {
            assert_eq!(crc32_novatel(text.as_bytes()), crc);
        }
    }

    #[test]
    fn sums() {
        assert_eq!(sum16_le(&[1, 2, 0xFF, 0xFF]), 0x0200);
        assert_eq!(sum16_be(&[1, 2, 0xFF, 0xFF]), 0x0101);
        assert_eq!(sum_bytes(&[0xFF; 300]), 0x2AD4); // 76500 - 65536
        assert_eq!(fletcher8(&[1, 2, 3]), [6, 10]);
    }
}
