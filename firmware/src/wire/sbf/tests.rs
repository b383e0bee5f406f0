use super::super::field::{hex, put};
use super::*;
use crate::wire::receiver::testing::{self, DecodedMessage, NONE};
use crate::wire::{Error, ReceiverFormat};
use std::vec::Vec;

/// Recomputes the CRC of all bytes behind it.
fn seal(frame: &mut [u8]) {
    let sum = xmodem(&frame[4..]);
    put(frame, 2, sum.to_le_bytes());
}

/// An example with a start mark in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let mut frame = PVT.to_vec();
    put(&mut frame, 8, u32::from(n).to_le_bytes());
    put(&mut frame, 60, *b"$@$@");
    seal(&mut frame);
    frame
}

/// Words apart, and joined again.
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    testing::remade(ReceiverFormat::Sbf, frame, seal)
}

/// A block as the format is documented; `pysbf2` reads the same numbers (`tests/qemu`).
const PVT: [u8; 96] = hex(
    "24402202a74f600015cd5b0792090400666666666666ea3fdf4f8d976e12c33f9a999999991d8140666640420000a03f000020c00000003e004094439a9999999999b93f0ad7233c00001400010064000300000000010000c800040006000000",
);
const POSITION_COVARIANCE: [u8; 56] = hex(
    "244068071217380015cd5b079209040017b7d139faed6b3a17b7d13a00000000000000000000000000000000000000000000000000000000",
);
const VELOCITY_COVARIANCE: [u8; 56] = hex(
    "24406e3d1417380015cd5b079209040017b7d13817b7d1390ad7233b00000000000000000000000000000000000000000000000000000000",
);
const ATTITUDE: [u8; 44] =
    hex("2440485732172c0015cd5b079209140002000000004089430000c03ff90295d0f90295d0f90295d0f90295d0");
const ATTITUDE_COVARIANCE: [u8; 40] =
    hex("244076223317280015cd5b07920900000000803d0000803ef90295d0f90295d0f90295d0f90295d0");

fn changed<const N: usize>(frame: &[u8], at: usize, bytes: [u8; N]) -> DecodedMessage {
    let mut frame = frame.to_vec();
    put(&mut frame, at, bytes);
    seal(&mut frame);
    parse(&frame).unwrap()
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-5 * b.abs()
}

fn parse(frame: &[u8]) -> Result<DecodedMessage, Error> {
    testing::parse(ReceiverFormat::Sbf, frame)
}

#[test]
fn golden_blocks() {
    let part = parse(&PVT).unwrap();
    assert_eq!(part.time, Time::Week(123_456_789));
    let (position, own) = (part.position.unwrap(), part.own);
    assert_eq!((position.latitude, position.longitude), (0.825, 0.149));
    assert_eq!((position.height, own), (547.7, [0.0; 6]));
    assert_eq!(part.velocity, Some([1.25, -2.5, -0.125]));
    // 4 cm are twice the standard deviation of the distance, 6 cm that of the height
    let assumed = part.assumed;
    for (sigma, want) in assumed
        .into_iter()
        .zip([0.014_142, 0.014_142, 0.03, 0.05, 0.05, 0.05])
    {
        assert!((sigma - want).abs() < 1e-5, "{assumed:?}");
    }
    let sigmas = parse(&POSITION_COVARIANCE).unwrap().stated;
    assert!(
        sigmas
            .into_iter()
            .zip([0.02, 0.03, 0.04])
            .all(|(a, b)| close(a, b))
    );
    let sigmas = parse(&VELOCITY_COVARIANCE).unwrap().stated[3..].to_vec();
    assert!(
        sigmas
            .into_iter()
            .zip([0.01, 0.02, 0.05])
            .all(|(a, b)| close(a, b))
    );
    let heading = parse(&ATTITUDE).unwrap().heading.unwrap();
    assert!(close(heading.angle, 274.5_f32.to_radians()));
    assert!(close(heading.sigma, 0.5_f32.to_radians()));
    let sigma = parse(&ATTITUDE_COVARIANCE).unwrap().heading_sigma.unwrap();
    assert!(close(sigma, 0.25_f32.to_radians()));
}

#[test]
fn what_is_not_measured_is_not_reported() {
    for mode in [0, 3, 9, 11, 0x84] {
        assert_eq!(changed(&PVT, 14, [mode]).position, None, "{mode}");
        assert_eq!(changed(&POSITION_COVARIANCE, 14, [mode]).stated, NONE);
    }
    assert_eq!(changed(&PVT, 15, [1]).velocity, None); // an error
    for at in [16, 24, 32] {
        assert_eq!(changed(&PVT, at, (-2e10_f64).to_le_bytes()).position, None);
        assert_eq!(changed(&PVT, at, f64::NAN.to_le_bytes()).position, None);
    }
    for at in [44, 48, 52] {
        let part = changed(&PVT, at, (-2e10_f32).to_le_bytes());
        assert_eq!(part.velocity, None);
        assert!(part.position.is_some());
    }
    let part = changed(&PVT, 90, u16::MAX.to_le_bytes());
    assert_eq!(part.assumed[..2], [NOT_MEASURED; 2]);
    for variance in [-2e10_f32, -1.0, f32::NAN, f32::INFINITY] {
        let bytes = variance.to_le_bytes();
        assert_eq!(
            changed(&POSITION_COVARIANCE, 20, bytes).stated[1],
            NOT_MEASURED
        );
        assert_eq!(
            changed(&VELOCITY_COVARIANCE, 24, bytes).stated[5],
            NOT_MEASURED
        );
        assert_eq!(changed(&ATTITUDE, 20, bytes).heading, None);
        assert_eq!(changed(&ATTITUDE_COVARIANCE, 16, bytes).heading_sigma, None);
    }
    assert_eq!(changed(&ATTITUDE, 15, [1]).heading, None);
    assert!(changed(&ATTITUDE, 15, [4]).heading.is_some()); // the other baseline
    assert_eq!(changed(&ATTITUDE, 16, [0, 0]).heading, None);
    let mut frame = PVT;
    put(&mut frame, 8, u32::MAX.to_le_bytes());
    seal(&mut frame);
    assert_eq!(parse(&frame), Err(Error::Field)); // no time
}

/// Before revision 2 there are no accuracies: the bytes at their place are filling.
#[test]
fn older_revisions_have_no_accuracy() {
    for (revision, len) in [(0_u16, 88), (1, 88)] {
        let mut frame = PVT[..len].to_vec();
        put(&mut frame, 4, (4007 | revision << 13).to_le_bytes());
        put(&mut frame, 6, (len as u16).to_le_bytes());
        seal(&mut frame);
        let part = parse(&frame).unwrap();
        assert!(part.position.is_some());
        let s = VELOCITY_MPS;
        let none = NOT_MEASURED;
        assert_eq!(part.assumed, [none, none, none, s, s, s]);
    }
}

#[test]
fn other_blocks_pass_and_damage_does_not() {
    // an end of a block of measurements (5922) and an answer in text
    let mut other = hex::<16>("24400000221710000000000092090000");
    seal(&mut other);
    assert_eq!(
        (scan(&other), parse(&other)),
        (Scan::Other(16), Err(Error::Content))
    );
    assert_eq!(scan(b"$R: lif\r\n"), Scan::Garbage);
    assert_eq!(scan(&PVT[..7]), Scan::Partial(8));
    for len in [6_u16, 95, 84, 4000] {
        let mut frame = PVT;
        put(&mut frame, 6, len.to_le_bytes());
        assert_eq!(scan(&frame[..8]), Scan::BadChecksum, "{len}");
    }
    for bit in 16..8 * PVT.len() {
        let mut frame = PVT;
        frame[bit / 8] ^= 1 << (bit % 8);
        assert!(parse(&frame).is_err(), "bit {bit}");
    }
}

/// The same solution from the Earth's centre: 47.285 and 8.5653 degrees, 547.7 m; 1.25, -2.5, 0.125
/// m/s. `pysbf2` reads the same numbers.
const CARTESIAN: [u8; 96] = hex(
    "2440c4b3a64f600015cd5b076009040043070f67055a5041df27f6afddb323410f03d18f69ca514100004042aca31ebf2fc727c0a28f413ff90295d09a9999999999b93f0000000000001400010064000300000000010000c800040006000000",
);
/// Variances north, east, down: 0.04, 0.09, 0.25 m2; 1e-4, 4e-4, 9e-4 m2/s2.
const CARTESIAN_COVARIANCE: [u8; 56] = hex(
    "244009261117380015cd5b076009040097da0a3e4370ba3d000c1d3e0000003f300de13b2ff7d33dcdcccc3d62677f3ccdcc4c3e9a99993e",
);
const CARTESIAN_VELOCITY_COVARIANCE: [u8; 56] = hex(
    "2440cb8b1317380015cd5b076009040067a4f439ed81d2393f6d0b3a0000003fa456283786b7ce39cdcccc3d5e147938cdcc4c3e9a99993e",
);

#[test]
fn cartesian_blocks() {
    let mut values = Values::NONE;
    for block in [
        &CARTESIAN[..],
        &CARTESIAN_COVARIANCE,
        &CARTESIAN_VELOCITY_COVARIANCE,
    ] {
        assert_eq!(scan(block), Scan::Frame(block.len()));
        assert_eq!(head(block).unwrap().time, Time::Week(123_456_789));
        read(block, &mut values);
    }
    let at = values.position;
    assert!((at.latitude - 47.285_f64.to_radians()).abs() < 1e-11);
    assert!((at.longitude - 8.5653_f64.to_radians()).abs() < 1e-11);
    assert!((at.height - 547.7).abs() < 1e-4);
    let moves = values.velocity.into_iter().zip([1.25, -2.5, 0.125]);
    assert!(
        moves.clone().all(|(v, want)| (v - want).abs() < 1e-6),
        "{values:?}"
    );
    let want = [0.2, 0.3, 0.5, 0.01, 0.02, 0.03];
    let sigmas = values.stated.into_iter().zip(want);
    assert!(
        sigmas.clone().all(|(sigma, want)| close(sigma, want)),
        "{values:?}"
    );
    assert!(close(values.assumed[0], 0.014_142) && close(values.assumed[2], 0.03));
    // without the position its axes are not known
    let mut alone = Values::NONE;
    read(&CARTESIAN_COVARIANCE, &mut alone);
    assert_eq!(alone, Values::NONE);
    // an error, no solution, no numbers
    for (at, byte) in [(15, 1), (14, 0)] {
        let mut bad = CARTESIAN.to_vec();
        bad[at] = byte;
        let mut values = Values::NONE;
        read(&bad, &mut values);
        assert!(values.refused && !values.has(0));
    }
    assert_eq!(
        changed(&CARTESIAN, 16, (-2e10_f64).to_le_bytes()).position,
        None
    );
    assert_eq!(
        changed(&CARTESIAN, 44, (-2e10_f32).to_le_bytes()).velocity,
        None
    );
}
