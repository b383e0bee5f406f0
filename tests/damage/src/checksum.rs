//! Checksums from their definitions, bit by bit, independent of those of the firmware.

/// A 16-bit CRC, most significant bit first.
pub fn crc16(polynomial: u16, start: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(start, |mut crc, &byte| {
        crc ^= u16::from(byte) << 8;
        for _ in 0..8 {
            let out = crc & 0x8000 != 0;
            crc = (crc << 1) ^ if out { polynomial } else { 0 };
        }
        crc
    })
}

/// A 16-bit CRC, least significant bit first; `polynomial` is reflected, too.
pub fn crc16_reflected(polynomial: u16, start: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(start, |mut crc, &byte| {
        crc ^= u16::from(byte);
        for _ in 0..8 {
            let out = crc & 1 != 0;
            crc = (crc >> 1) ^ if out { polynomial } else { 0 };
        }
        crc
    })
}

/// `NovAtel`'s CRC-32: zlib's polynomial, from zero, not inverted.
pub fn crc32_novatel(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0, |mut crc, &byte| {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            let out = crc & 1 != 0;
            crc = (crc >> 1) ^ if out { 0xEDB8_8320 } else { 0 };
        }
        crc
    })
}

/// Sum of 16-bit words.
pub fn sum16(bytes: &[u8], word: fn([u8; 2]) -> u16) -> u16 {
    let words = bytes.as_chunks::<2>().0.iter();
    words.fold(0, |sum: u16, pair| sum.wrapping_add(word(*pair)))
}

/// Fletcher's sum modulo 256.
pub fn fletcher(bytes: &[u8]) -> [u8; 2] {
    let (mut a, mut b) = (0u32, 0u32);
    for &byte in bytes {
        a = (a + u32::from(byte)) % 256;
        b = (b + a) % 256;
    }
    [a as u8, b as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check values of the catalogue of CRCs, for the text "123456789".
    #[test]
    fn check_values() {
        let text = b"123456789";
        assert_eq!(crc16(0x1021, 0, text), 0x31C3); // XMODEM
        assert_eq!(crc16_reflected(0x8408, 0, text), 0x2189); // KERMIT
        assert_eq!(crc16_reflected(0x8408, 0xFFFF, text), 0x6F91); // MCRF4XX
        assert_eq!(crc32_novatel(text), 0x2DFD_2D88); // CRC-32 without start and inversion
        assert_eq!(fletcher(b"\x01\x02"), [3, 4]);
        assert_eq!(sum16(&[1, 2, 3, 4], u16::from_be_bytes), 0x0406);
    }
}
