//! INSPVAS (508): the receiver's own inertial solution, as reference in replay. The target does not
//! need it.
//!
//! Source: docs.novatel.com, OEM7, INSPVA. The golden log is its ASCII example in the binary form
//! of `NovAtel`'s encoder.

use super::{crc_is_right, seal};
use crate::wire::Error;
use crate::wire::field::{put, take};

/// Bytes of the log.
pub const LEN: usize = HEADER + PAYLOAD as usize + 4;
const HEADER: usize = 12;
const PAYLOAD: u8 = 88;

/// Position, velocity and attitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inspvas {
    /// Week and millisecond of the header.
    pub header_time: (u16, u32),
    /// GPS week.
    pub week: u32,
    /// Second of the week.
    pub second_of_week: f64,
    /// Latitude and longitude, degrees (WGS 84), and height above the ellipsoid, m.
    pub position: [f64; 3],
    /// North, east, **up**, m/s.
    pub velocity: [f64; 3],
    /// Roll, pitch, azimuth (clockwise from north), degrees; body axes x right, y forward, z up.
    pub attitude: [f64; 3],
    /// 0 inactive, 1 aligning, 2 high variance, 3 good, 6 solution free, 7 alignment complete.
    pub status: u32,
}

impl Inspvas {
    /// Reads a log.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Header`] or [`Error::Checksum`].
    pub fn parse(frame: &[u8]) -> Result<Inspvas, Error> {
        let frame: &[u8; LEN] = frame.try_into().map_err(|_| Error::Length)?;
        if !frame.starts_with(&[0xAA, 0x44, 0x13, PAYLOAD, 0xFC, 0x01]) {
            return Err(Error::Header);
        }
        if !crc_is_right(frame) {
            return Err(Error::Checksum);
        }
        let number = |n: usize| f64::from_le_bytes(take(frame, HEADER + 4 + 8 * n));
        let three = |n| [number(n), number(n + 1), number(n + 2)];
        Ok(Inspvas {
            header_time: (
                u16::from_le_bytes(take(frame, 6)),
                u32::from_le_bytes(take(frame, 8)),
            ),
            week: u32::from_le_bytes(take(frame, HEADER)),
            second_of_week: number(0),
            position: three(1),
            velocity: three(4),
            attitude: three(7),
            status: u32::from_le_bytes(take(frame, HEADER + 84)),
        })
    }

    /// The whole log.
    pub fn emit(&self) -> [u8; LEN] {
        let mut frame = [0; LEN];
        put(&mut frame, 0, [0xAA, 0x44, 0x13, PAYLOAD, 0xFC, 0x01]);
        put(&mut frame, 6, self.header_time.0.to_le_bytes());
        put(&mut frame, 8, self.header_time.1.to_le_bytes());
        put(&mut frame, HEADER, self.week.to_le_bytes());
        let numbers = [self.position, self.velocity, self.attitude];
        let numbers = [self.second_of_week]
            .into_iter()
            .chain(numbers.into_iter().flatten());
        for (n, number) in numbers.enumerate() {
            put(&mut frame, HEADER + 4 + 8 * n, number.to_le_bytes());
        }
        put(&mut frame, HEADER + 84, self.status.to_le_bytes());
        seal(&mut frame);
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Scan;
    use crate::wire::checksum::crc32_novatel;
    use crate::wire::field::hex;
    use crate::wire::novatel::scan;

    const ASCII: &str = "INSPVASA,1264,144059.000;1264,144059.002135700,51.116680071,-114.037929194,515.286704183,277.896368884,84.915188605,-8.488207941,0.759619515,-2.892414901,6.179554750,INS_ALIGNMENT_COMPLETE";
    const GOLDEN: [u8; LEN] = hex(
        "aa441358fc01f004782a9608f0040000cdb85f04d89501411d85605fef8e4940cbf2916e6d825cc0e40c902b4b1a8040ea1ee686575e714066093a73923a5540297c2864f6f920c01a82ca95cd4ee83f8b10726caa2307c0a75d4c33ddb718400700000083e99334",
    );

    #[test]
    fn golden_log_reads_and_is_made_again() {
        assert_eq!(crc32_novatel(ASCII.as_bytes()), 0x855D_6F76);
        assert_eq!(scan(&GOLDEN), Scan::Other(LEN));
        let log = Inspvas::parse(&GOLDEN).unwrap();
        assert_eq!(log.header_time, (1264, 144_059_000));
        let numbers = [
            &[log.second_of_week][..],
            &log.position,
            &log.velocity,
            &log.attitude,
        ];
        let printed = ASCII.split([',', ';']).skip(4);
        for (number, text) in numbers.concat().into_iter().zip(printed) {
            assert_eq!(number, text.parse::<f64>().unwrap());
        }
        assert_eq!((log.week, log.status), (1264, 7));
        assert_eq!(log.emit(), GOLDEN);
    }

    #[test]
    fn damage_is_refused() {
        for bit in 0..8 * LEN {
            let mut frame = GOLDEN;
            frame[bit / 8] ^= 1 << (bit % 8);
            assert!(Inspvas::parse(&frame).is_err(), "bit {bit}");
        }
        assert_eq!(Inspvas::parse(&GOLDEN[1..]), Err(Error::Length));
    }
}
