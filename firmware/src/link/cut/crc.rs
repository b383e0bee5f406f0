//! The CRCs of frames that are cut, byte by byte, from a table of sixteen words each.

use super::Word;

/// CRC-32/MPEG-2, or `NovAtel`'s: the same polynomial reflected, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crc {
    /// Most significant bit first, from all ones; sent most significant byte first.
    Mpeg2,
    /// Least significant bit first, from 0; sent least significant byte first.
    Novatel,
}

const POLYNOMIAL: u32 = 0x04C1_1DB7;

static MPEG_2: [u32; 16] = table(false);
static NOVATEL: [u32; 16] = table(true);

const fn table(reflected: bool) -> [u32; 16] {
    let mut table = [0; 16];
    let mut n = 0;
    while n < 16 {
        let mut crc = if reflected {
            n as u32
        } else {
            (n as u32) << 28
        };
        let mut bit = 0;
        while bit < 4 {
            crc = if reflected {
                crc >> 1
                    ^ if crc & 1 != 0 {
                        POLYNOMIAL.reverse_bits()
                    } else {
                        0
                    }
            } else {
                crc << 1 ^ if crc >> 31 != 0 { POLYNOMIAL } else { 0 }
            };
            bit += 1;
        }
        table[n] = crc;
        n += 1;
    }
    table
}

impl Crc {
    /// The CRC of frames with these values.
    #[inline(always)]
    pub const fn of(word: Word) -> Crc {
        match word {
            Word::I24 | Word::F32 => Crc::Mpeg2,
            Word::I32 => Crc::Novatel,
        }
    }

    /// The CRC of no bytes.
    #[inline(always)]
    pub const fn start(self) -> u32 {
        match self {
            Crc::Mpeg2 => u32::MAX,
            Crc::Novatel => 0,
        }
    }

    /// The CRC with one byte more.
    #[inline(always)]
    pub fn next(self, crc: u32, byte: u8) -> u32 {
        match self {
            Crc::Mpeg2 => {
                let crc = crc ^ u32::from(byte) << 24;
                let crc = crc << 4 ^ MPEG_2[(crc >> 28) as usize % 16];
                crc << 4 ^ MPEG_2[(crc >> 28) as usize % 16]
            }
            Crc::Novatel => {
                let crc = crc ^ u32::from(byte);
                let crc = crc >> 4 ^ NOVATEL[crc as usize % 16];
                crc >> 4 ^ NOVATEL[crc as usize % 16]
            }
        }
    }

    /// The `n`th byte that is sent.
    #[inline(always)]
    pub fn byte(self, crc: u32, n: u8) -> u8 {
        let bytes = match self {
            Crc::Mpeg2 => crc.to_be_bytes(),
            Crc::Novatel => crc.to_le_bytes(),
        };
        bytes[usize::from(n) % 4]
    }
}
