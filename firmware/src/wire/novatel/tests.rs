//! Golden logs of `novatel_edie` (its recorded one and its own encoder's output).

use super::*;
use crate::wire::examples::made;
use crate::wire::field::hex;
use std::vec::Vec;

/// Recorded, HG1700-AG58, in ASCII:
/// `%RAWIMUSXA,1692,484620.664;00,11,1692,484620.664389000,00801503,43110635,-817242,-202184,`
/// `-215194,-41188,-9895*a5db8c7b`.
const RING_LASER: [u8; 56] = hex(
    "AA441328B6059C0678B9E21C000B9C060B9755A832941D4103158000EBD09102A687F3FF38EAFCFF66B7FCFF1C5FFFFF59D9FFFF475FAFBA",
);
/// NovAtel's own encoder, of the documentation's RAWIMUSXA, RAWIMUSA and RAWIMUXA examples.
const DOCUMENTED_SX: [u8; 56] = hex(
    "aa441328b605a1089e594e1d0429a108541c070e68021e4100fe59ea70d7a01309b2d6ffe5ca440060fe0200725d06007bbaf0ff13dc4cab",
);
const DOCUMENTED_S: [u8; 56] = hex(
    "aa4413284501a1085e684d1da10800009b92ac0371011e4100fe5aea98c7a0133faad9fffb4b4300c9b90400294309009397f0ff0c2daf3a",
);
const DOCUMENTED_X: [u8; 72] = hex(
    "aa44121cb50500a02800000081b4a108ce5b4f1d20000002c50da9410429a1081ede737070031e4100fe57ea9427a213636ddbff91614400afe6040031ed030073b7f1ffdacb8dde",
);

/// Binary form, log, and the ASCII form's six numbers in its order.
const GOLDENS: [(&[u8], Log, [i32; 6]); 4] = [
    (
        &RING_LASER,
        Log::Rawimusx,
        [43_110_635, -817_242, -202_184, -215_194, -41_188, -9_895],
    ),
    (
        &DOCUMENTED_SX,
        Log::Rawimusx,
        [
            329_308_016,
            -2_706_935,
            4_508_389,
            196_192,
            417_138,
            -1_000_837,
        ],
    ),
    (
        &DOCUMENTED_S,
        Log::Rawimus,
        [
            329_303_960,
            -2_512_321,
            4_410_363,
            309_705,
            607_017,
            -1_009_773,
        ],
    ),
    (
        &DOCUMENTED_X,
        Log::Rawimux,
        [
            329_394_068,
            -2_396_829,
            4_481_425,
            321_199,
            257_329,
            -936_077,
        ],
    ),
];

#[test]
fn golden_logs_read_and_are_made_again() {
    for (golden, log, ascii) in GOLDENS {
        assert_eq!(scan(golden), Scan::Frame(golden.len()));
        let frame = Frame::new_checked(golden).unwrap();
        assert_eq!(frame.log(), log);
        let [az, ay, ax, gz, gy, gx] = ascii;
        assert_eq!(frame.accel(), [ax, -ay, az]);
        assert_eq!(frame.gyro(), [gx, -gy, gz]);
        let mut made = [0xEE; LONG_LEN];
        let len = Repr::parse(&frame).emit(&mut made).unwrap();
        assert_eq!(made[..len], *golden);
        assert_eq!(
            Repr::parse(&frame).emit(&mut made[..len - 1]),
            Err(Error::Length)
        );
    }
}

#[test]
fn a_ring_laser_sample() {
    let frame = Frame::new_checked(RING_LASER).unwrap();
    let (info, kind) = frame.info().unwrap();
    assert_eq!((info, kind), (0, ImuType(11)));
    assert!((frame.second_of_week() - 484_620.664_389).abs() < 1e-9);
    assert_eq!(frame.status(), 0x0080_1503); // prints as a number, little-endian on the wire
    assert_eq!(frame.reading().valid, Axes::ALL);
    for (at, bit) in [(12, 0x01), (27, 0x08)] {
        let mut failed = RING_LASER; // info byte; gyro test in the status word
        failed[at] |= bit;
        seal(&mut failed);
        let frame = Frame::new_checked(failed).unwrap();
        assert_eq!(frame.reading().valid, Axes::NONE);
    }
    let units = kind.units().unwrap();
    // upright and at rest: 1 g over 10 ms
    let down = f64::from(frame.accel()[2]) * units.accel.lsb * 100.0;
    assert!((down - 9.79).abs() < 0.02, "{down}");
    assert_eq!(units.accel.lsb, 0.3048 / 134_217_728.0); // not 1/3.2808 ft
    assert_eq!(kind.rate(), Some(100));
}

#[test]
fn long_header_fields() {
    let repr = Repr::parse(&Frame::new_checked(DOCUMENTED_X).unwrap());
    assert_eq!(
        (repr.header.week, repr.header.millisecond),
        (2209, 491_740_110)
    );
    assert_eq!(repr.header.long.time_status, 180);
    assert_eq!(repr.header.long.definition, 0x0DC5);
    assert_eq!(repr.header.long.receiver_status, 0x0200_0020);
    assert_eq!(repr.lead, [4, 41, 0xA1, 0x08]);
}

#[test]
fn words_go_back_to_their_places() {
    let mut bytes = RING_LASER;
    let mut frame = Frame::new_checked(&mut bytes).unwrap();
    frame.change([1, 2, 3], [4, -5, i32::MIN], false).unwrap();
    assert_eq!(
        (frame.gyro(), frame.accel()),
        ([1, 2, 3], [4, -5, i32::MIN])
    );
    let value = |n: usize| i32::from_le_bytes(take(&bytes, 28 + 4 * n));
    assert_eq!([0, 1, 2, 3, 4, 5].map(value), [i32::MIN, 5, 4, 3, -2, 1]);
    assert_eq!(bytes[..28], RING_LASER[..28]);
    assert_eq!(scan(&bytes), Scan::Frame(SHORT_LEN));
}

#[test]
fn scales_of_the_types() {
    let lsb = |kind| ImuType(kind).units().map(|u| (u.gyro.lsb, u.accel.lsb));
    assert_eq!(lsb(12).unwrap().1, 2.0 * lsb(11).unwrap().1);
    assert_eq!(lsb(32), Some((DEGREE / 2_097_152.0, 1.0 / 4_194_304.0)));
    assert_eq!(lsb(26), Some((1e-9, 2e-8)));
    assert_eq!(lsb(40), None); // HG1700-AG71: no published scale
    for kind in 0..=255 {
        assert_eq!(
            lsb(kind).is_some(),
            ImuType(kind).rate().is_some(),
            "{kind}"
        );
    }
    assert!(!ImuType(11).status_is_good(0x0800_0000));
    assert!(ImuType(32).status_is_good(0x0800_0000));
}

/// The documentation's examples are of an EG320N at rest: 1 g and the noise of its gyros. Taken for
/// increments, they would be 125 g.
#[test]
fn epson_values_are_rates() {
    for golden in [&DOCUMENTED_SX[..], &DOCUMENTED_X] {
        let frame = Frame::new_checked(golden).unwrap();
        let (_, kind) = frame.info().unwrap();
        let units = kind.units().unwrap();
        let g = frame.accel().map(|n| f64::from(n) * units.accel.lsb / G);
        let size = g.iter().map(|a| a * a).sum::<f64>().sqrt();
        assert!((size - 1.005).abs() < 0.001, "{size} g");
        let rates = frame.gyro().map(|n| f64::from(n) * units.gyro.lsb);
        assert!(rates.iter().all(|rate| rate.abs() < 0.2 * DEGREE));
        let quantities = [units.gyro, units.accel].map(|unit| unit.quantity);
        assert_eq!(quantities, [Quantity::Rate; 2]);
    }
}

/// What getImuRawScaleFactors of `novatel_oem7_driver` (commit 0c0e135) returns for the types 41,
/// 62 and 61 at 125, 200 and 200 Hz: an increment a count, rad and m/s.
#[test]
fn epson_scales_are_those_of_novatels_driver() {
    for (kind, hz, gyro, accel) in [
        (
            41,
            125,
            1.704_423_097_650_712_7e-11,
            2.394_201_660_156_25e-10,
        ),
        (
            62,
            200,
            1.065_264_436_031_695_3e-11,
            1.496_376_037_597_656_3e-10,
        ),
        (
            61,
            200,
            2.017_544_262_816_779e-11,
            2.992_752_075_195_313e-10,
        ),
    ] {
        let units = ImuType(kind).units().unwrap();
        assert_eq!(ImuType(kind).rate(), Some(hz));
        for (unit, theirs) in [(units.gyro, gyro), (units.accel, accel)] {
            let ours = unit.increment(1.0 / f64::from(hz)).unwrap();
            assert!(
                (ours / theirs - 1.0).abs() < 2e-6,
                "{kind}: {ours} {theirs}"
            );
        }
    }
}

#[test]
fn other_logs_pass_and_impossible_lengths_do_not_wait() {
    let mut other = RING_LASER;
    other[4] = 0xFC; // INSPVAS is 508 = 0x1FC
    other[5] = 0x01;
    seal(&mut other);
    assert_eq!(scan(&other), Scan::Other(SHORT_LEN));
    assert_eq!(Frame::new_checked(other).err(), Some(Error::Header));
    let mut wrong = RING_LASER;
    wrong[3] = 0xFF;
    assert_eq!(scan(&wrong[..12]), Scan::BadChecksum);
    wrong = RING_LASER;
    wrong[40] ^= 0x80;
    assert_eq!(scan(&wrong), Scan::BadChecksum);
    let mut long = DOCUMENTED_X;
    long[3] = 29;
    seal(&mut long);
    assert_eq!(scan(&long), Scan::BadChecksum);
    assert_eq!(scan(&[0xAA, 0x44]), Scan::Partial(3));
    assert_eq!(scan(&[0xAA, 0x44, 0x14]), Scan::Garbage);
}

/// With a start mark in its data.
/// A VERSION log of three components, longer than a framer waits for, as the encoder of
/// `novatel_edie` 2.10.11 writes it.
const VERSION: [u8; 360] = hex(concat!(
    "aa44121c25000020480100008fb45205feb14814080000028136f30803000000010000004c31325256000000",
    "0000000000000000445a5a303630343030313000000000004f454d5632472d322e30302d32540000332e3030",
    "304131390000000000000000332e3030304139000000000000000000323030362f4665622f20390031373a31",
    "343a33330000000001007a3a5343484f54540000000000000000000000000000000000000000000000000000",
    "0000000000000000000000000000000000000000000000000000000000000000000000000000000000000000",
    "0000000000000000000000000000000000000000000000000000000001007a3a555345524150500000000000",
    "000000000000000000000000000000000000000000000000000000000000000000000000312e303030413100",
    "000000000000000000000000000000000000000000000000323030362f4665622f20390031373a31343a3333",
    "00000000b425324a",
));

/// It passes as one long message in whatever pieces it comes, and the frames around it are found.
#[test]
fn a_longer_log_than_the_framer_waits_for() {
    use crate::wire::framer::{Kind, tests::events};
    let [before, after] = [example(1), example(2)];
    let stream = [&before[..], &VERSION, b"<OK\r\n", &after].concat();
    for piece in [1, 7, 100, 256] {
        let found = events(crate::wire::ImuFormat::Novatel, &stream, piece);
        let of = |wanted: Kind| -> Vec<u8> {
            let events = found.iter().filter(|(kind, _)| *kind == wanted);
            events.flat_map(|(_, bytes)| bytes.clone()).collect()
        };
        assert_eq!(of(Kind::Frame), [&before[..], &after].concat(), "{piece}");
        assert_eq!(of(Kind::Long), VERSION, "{piece}");
        assert_eq!(of(Kind::Garbage), b"<OK\r\n", "{piece}");
    }
}

/// The smallest number on the wire has no opposite, and the largest y does not wrap to it.
#[test]
fn the_ends_of_y_hold() {
    let y = 12 + at::GYRO + 4;
    let wire = |frame: &[u8]| i32::from_le_bytes(take(frame, y));
    for (came, moved, left) in [
        (i32::MIN, 0, i32::MIN),
        (i32::MIN, -5, -i32::MAX + 5),
        (i32::MAX, 0, i32::MAX),
        (i32::MAX, -5, i32::MAX),
        (i32::MAX, 5, i32::MAX - 5),
    ] {
        let mut frame = RING_LASER;
        put(&mut frame, y, came.to_le_bytes());
        seal(&mut frame);
        let mut view = Frame::new_checked(&mut frame).unwrap();
        let [x, y, z] = view.gyro();
        let accel = view.accel();
        view.change([x, y.saturating_add(moved), z], accel, false);
        assert_eq!(wire(&frame), left, "{came} {moved}");
        assert_eq!(scan(&frame), Scan::Frame(56));
    }
}

pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let repr = Repr {
        log: Log::Rawimusx,
        header: Header::default(),
        lead: [0, 11, 0xAA, 0x44],
        second_of_week: f64::from(n) / 100.0,
        status: 0,
        gyro: [0x1344_AA13, 2, 3],
        accel: [4, 5, 6],
    };
    made(|buffer| repr.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(frame)?);
    made(|buffer| repr.emit(buffer))
}
