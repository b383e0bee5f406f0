//! NAV-COV and NAV-RELPOSNED: what goes with a NAV-PVT of the same time.
//!
//! Source: the u-blox interface description (F9) as `pyubx2` 1.4.0 implements it, which made the
//! golden messages. Both payloads have 64 bytes:
//!
//! ```text
//! NAV-COV 01 36        time u32 | version 0 | position valid u8 @5 | velocity valid u8 | ...
//!   | position NN NE ND EE ED DD f32 @16, m^2 | velocity the same @40, m^2/s^2
//! NAV-RELPOSNED 01 3C  version 1 | ... | time u32 @4 | ... | heading i32 @24, 1e-5 degree | ...
//!   | its accuracy u32 @52 | ... | flags u32 @60
//! ```

use super::PVT_HEADER;
use crate::fix::Heading;
use crate::units::DEGREE;
use crate::wire::field::take;
use crate::wire::receiver::epoch::{Head, Time, Values};

/// Bytes of both payloads.
pub const PAYLOAD: usize = 64;

/// Least standard deviations of position (m), velocity (m/s) and heading (rad).
const LEAST: [f32; 2] = super::LEAST_SIGMA;
const LEAST_RAD: f32 = 1e-3;

/// The flags of a heading between two antennas on one vehicle: fix good, relative position valid,
/// moving base, heading valid. Without the moving base the other antenna stands somewhere else.
const FLAGS: u32 = 1 | 1 << 2 | 1 << 5 | 1 << 8;

/// Whether a message with this id has fields that are read.
pub fn is_read(id: [u8; 2], payload: usize) -> bool {
    payload == PAYLOAD && matches!(id, [0x01, 0x36] | [0x01, 0x3C])
}

/// Kind and time of such a message, of the versions that are known.
pub fn head(frame: &[u8]) -> Option<Head> {
    let [id, first, fifth] = [3, 6, 10].map(|at| take::<1>(frame, at));
    let (kind, at) = match (id, first, fifth) {
        ([0x36], _, [0]) => (1, 6),
        ([0x3C], [1], _) => (2, 10),
        _ => return None,
    };
    Some(Head {
        kind,
        time: Time::Week(u32::from_le_bytes(take(frame, at))),
    })
}

/// Writes the values of such a message.
#[inline(never)]
pub fn read(frame: &[u8], values: &mut Values) {
    let payload = frame.get(PVT_HEADER.len()..).unwrap_or_default();
    let u32_at = |at| u32::from_le_bytes(take(payload, at));
    if take(frame, 3) == [0x36] {
        let diagonal = |at| [at, at + 12, at + 20].map(|at| take(payload, at));
        let [position, velocity] = take(payload, 5);
        let [least_m, least_mps] = LEAST;
        if position == 1 {
            values.variances(0, diagonal(16), least_m);
        }
        if velocity == 1 {
            values.variances(3, diagonal(40), least_mps);
        }
    } else if u32_at(60) & FLAGS == FLAGS {
        const UNIT: f32 = (1e-5 * DEGREE) as f32;
        let angle = i32::from_le_bytes(take(payload, 24)) as f32 * UNIT;
        values.heading = Some(Heading {
            angle,
            sigma: (u32_at(52) as f32 * UNIT).max(LEAST_RAD),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::scan;
    use super::*;
    use crate::wire::ReceiverFormat;
    use crate::wire::Scan;
    use crate::wire::checksum::fletcher8;
    use crate::wire::field::{hex, put};
    use crate::wire::receiver::testing::{self, NONE, Part};

    const COVARIANCE: [u8; 72] = hex(
        "b5620136400015cd5b070001010000000000000000000000803e0ad7233c0ad7a33cec51b83e8fc2f53cec51b83f0ad7233b0000000000000000faed6b3b000000000ad7233c703b",
    );
    const BASELINE: [u8; 72] = hex(
        "b562013c40000100000015cd5b076400000014000000fdffffff660000004727ad0100000000000000000a0000000a000000140000000a0000004fc3000000000000370100003276",
    );

    fn read(frame: &[u8]) -> Option<Part> {
        testing::parse(ReceiverFormat::Ubx, frame).ok()
    }

    fn changed<const N: usize>(frame: &[u8; 72], at: usize, bytes: [u8; N]) -> Option<Part> {
        let mut frame = *frame;
        put(&mut frame, 6 + at, bytes);
        let sum = fletcher8(&frame[2..70]);
        put(&mut frame, 70, sum);
        assert_eq!(scan(&frame), Scan::Frame(72));
        read(&frame)
    }

    #[test]
    fn golden_messages() {
        for frame in [COVARIANCE, BASELINE] {
            assert_eq!(scan(&frame), Scan::Frame(72));
        }
        let part = read(&COVARIANCE).unwrap();
        assert_eq!(part.time, Time::Week(123_456_789));
        let want = [0.5, 0.6, 1.2, 0.05, 0.06, 0.1];
        let near = |(a, b): (&f32, f32)| (a - b).abs() < 1e-6;
        assert!(part.stated.iter().zip(want).all(near), "{part:?}");
        let part = read(&BASELINE).unwrap();
        assert_eq!(part.time, Time::Week(123_456_789));
        let heading = part.heading.unwrap();
        // pyubx2 has rounded 281.25 and 0.5 degrees down by one in the last digit
        assert!((heading.angle - 281.25_f32.to_radians()).abs() < 1e-6);
        assert!((heading.sigma - 0.5_f32.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_measured_is_not_reported() {
        let part = changed(&COVARIANCE, 5, [0, 1]).unwrap();
        assert!(part.stated[..3] == NONE[..3] && part.stated[5] == 0.1);
        let nan = changed(&COVARIANCE, 28, f32::NAN.to_le_bytes()).unwrap();
        assert!(nan.stated[1] == NONE[1] && nan.stated[0] == 0.5);
        // without one of the flags, such as that of the moving base
        for flag in [0, 2, 5, 8] {
            let flags = (FLAGS & !(1 << flag)).to_le_bytes();
            assert_eq!(changed(&BASELINE, 60, flags).unwrap().heading, None);
        }
        assert_eq!(changed(&BASELINE, 0, [0]), None); // another version
        assert_eq!(changed(&COVARIANCE, 4, [1]), None);
    }
}
