use super::super::seal;
use super::*;
use crate::wire::field::{hex, put};
use crate::wire::receiver::testing::{self, DecodedMessage};
use crate::wire::{Error, ReceiverFormat};
use std::vec::Vec;

/// An example with a start mark in its data.
pub(in crate::wire) fn example(n: u8) -> Vec<u8> {
    let mut frame = POSITION.to_vec();
    put(&mut frame, 16, u32::from(n).to_le_bytes());
    put(&mut frame, HEADER + 52, [0xAA, 0x44, 0x12, 28]);
    seal(&mut frame);
    frame
}

/// Words apart, and joined again.
pub(in crate::wire) fn remade(frame: &[u8]) -> Result<Vec<u8>, Error> {
    testing::remade(ReceiverFormat::Novatel, frame, seal)
}

/// The ASCII example of BESTGNSSPOS on docs.novatel.com, in the binary form of NovAtel's encoder:
/// `PPP,51.15043712234,-114.03067870773,1097.3556,-17.0001,WGS84,0.0176,0.0123,0.0317`.
const POSITION: [u8; 104] = hex(
    "aa44121c950500a04800000082b4a1088869141d2000000292c2a9410000000045000000ff460c86419349409298d3a3f6815cc0d50968226c259140340088c13d000000e02d903cf085493cdcd7013d5453545200008841000000002a26262500003f373d4992d4",
);
/// `SOL_COMPUTED,DOPPLER_VELOCITY,0.150,0.000,5.2500,227.600000,-0.1250` by the same encoder.
const VELOCITY: [u8; 76] = hex(
    "aa44121c630000202c0000007fb49d07309d101800000002a210008000000000080000009a99193e0000000000000000000015403333333333736c40000000000000c0bf00000000ca30f219",
);
/// `SOL_COMPUTED,NARROW_INT,1.5,120.25,0.5,0.0,0.125,0.25` by the same encoder.
const HEADING2: [u8; 80] = hex(
    "aa44121c37050020300000004fb49d07309d1018000000022df2008000000000320000000000c03f0080f0420000003f000000000000003e0000803e30303031303030321211111000010033a418883c",
);

/// The example of BESTXYZ on docs.novatel.com, by the same encoder.
const CARTESIAN: [u8; 144] = hex(
    "aa44121cf1000020700000009db49f07309d101800000002000000800000000032000000da1b7c91e3f038c19f3c2c0475f54bc16891ed14a8da52419c33223ca167b33c7f6a3c3c00000000320000002f6ea301bc05523f6ea301bc051274bf2d431cebe2361abf5305a33c7dd0333d7f6abc3c414141410000803e0000803f000000000c0b0b0b000100333ee1544b",
);
/// A PSRPOS and a PSRVEL, by the same encoder: `SINGLE,51.15043712234,-114.03067870773,1097.3556,
/// -17.0001,WGS84,1.8176,1.2123,3.0317` and `PSRDIFF,0.150,0.000,5.2500,227.600000,-0.1250`.
const PSR_POSITION: [u8; 104] = hex(
    "aa44121c2f000020480000009db49f07309d101800000002000000800000000010000000ff460c86419349409298d3a3f6815cc0d50968226c259140340088c13d0000001ea7e83fa52c9b3f5f0742400000000000000000000000000c0c0c0c000600333d209194",
);
const PSR_VELOCITY: [u8; 76] = hex(
    "aa44121c640000202c0000009db49f07309d1018000000020000008000000000110000009a99193e0000000000000000000015403333333333736c40000000000000c0bf00000000a37fd6d8",
);

fn changed<const N: usize>(frame: &[u8], at: usize, bytes: [u8; N]) -> DecodedMessage {
    let mut frame = frame.to_vec();
    put(&mut frame, HEADER + at, bytes);
    seal(&mut frame);
    parse(&frame).unwrap()
}

fn parse(frame: &[u8]) -> Result<DecodedMessage, Error> {
    testing::parse(ReceiverFormat::Novatel, frame)
}

#[test]
fn golden_logs() {
    let part = parse(&POSITION).unwrap();
    assert_eq!(part.time, Time::Week(487_877_000));
    let (position, own) = (part.position.unwrap(), &part.own[..3]);
    let near = |a: f64, b: f64, within| (a - b).abs() < within;
    assert!(near(
        position.latitude,
        51.150_437_122_34_f64.to_radians(),
        1e-13
    ));
    assert!(near(
        position.longitude,
        -114.030_678_707_73_f64.to_radians(),
        1e-13
    ));
    assert!(near(position.height, 1097.3556 - 17.0001, 1e-5));
    assert_eq!(own, [0.0; 3]);
    assert_eq!(part.stated[..3], [0.0176, 0.0123, 0.0317]);

    let part = parse(&VELOCITY).unwrap();
    assert_eq!(part.time, Time::Week(403_742_000));
    let ([north, east, down], own) = (part.velocity.unwrap(), &part.own[3..]);
    let track = 227.6_f64.to_radians();
    assert!(near(north, 5.25 * track.cos(), 3e-6) && near(east, 5.25 * track.sin(), 3e-6));
    // 0.15 s late, in which the velocity may have changed
    assert_eq!((down, own), (0.125, &[0.15; 3][..]));
    assert_eq!(part.assumed[3..], [0.05; 3]);

    let heading = parse(&HEADING2).unwrap().heading.unwrap();
    assert!((heading.angle - 120.25_f32.to_radians()).abs() < 1e-6);
    assert!((heading.sigma - 0.125_f32.to_radians()).abs() < 1e-6);
}

#[test]
fn positions_and_velocities_of_one_solution_alone() {
    let (best, psr) = (parse(&POSITION).unwrap(), parse(&PSR_POSITION).unwrap());
    assert_eq!(psr.time, Time::Week(403_742_000));
    assert_eq!(psr.position, best.position);
    assert_eq!(psr.stated[..3], [1.8176, 1.2123, 3.0317]);
    let (best, psr) = (parse(&VELOCITY).unwrap(), parse(&PSR_VELOCITY).unwrap());
    assert_eq!((psr.velocity, psr.own), (best.velocity, best.own));
    for (id, frame) in [(141_u16, PSR_POSITION), (1538, PSR_POSITION)] {
        let mut frame = frame;
        put(&mut frame, 4, id.to_le_bytes());
        seal(&mut frame);
        assert!(parse(&frame).unwrap().position.is_some(), "{id}");
    }
}

/// The place of the example by another way: its radius, longitude, and the latitude that the
/// normal of the ellipsoid has there.
#[test]
fn earth_centred_logs() {
    let part = parse(&CARTESIAN).unwrap();
    let at = part.position.unwrap();
    let [x, y, z] = [-1_634_531.568_3, -3_664_618.032_6, 4_942_496.327_0_f64];
    let e2 = 0.006_694_379_990_141_3;
    let normal = 6_378_137.0 / (1.0 - e2 * at.latitude.sin().powi(2)).sqrt();
    let across = (normal + at.height) * at.latitude.cos();
    let back = [
        across * at.longitude.cos(),
        across * at.longitude.sin(),
        (normal * (1.0 - e2) + at.height) * at.latitude.sin(),
    ];
    for (back, want) in back.into_iter().zip([x, y, z]) {
        assert!((back - want).abs() < 1e-3, "{back} {want}");
    }
    let speed = |v: [f64; 3]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let v = [0.0011, -0.0049, -0.0001];
    assert!((speed(part.velocity.unwrap()) - speed(v)).abs() < 1e-9);
    let up = (x * v[0] + y * v[1] + z * v[2]) / speed([x, y, z]);
    assert!((part.velocity.unwrap()[2] + up).abs() < 2e-5);
    assert_eq!(part.own[3..], [0.25; 3]); // its latency
    // the trace stays
    let trace = |of: &[f32]| of.iter().map(|s| s * s).sum::<f32>();
    let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-5;
    assert!(near(
        trace(&part.stated[..3]),
        trace(&[0.0099, 0.0219, 0.0115])
    ));
    assert!(near(
        trace(&part.stated[3..]),
        trace(&[0.0199, 0.0439, 0.0230])
    ));

    for (at, wild) in [(0, 1_u32), (4, 56), (32, 0)] {
        let part = changed(&CARTESIAN, at, wild.to_le_bytes());
        assert_eq!(part.position, None, "{at}");
    }
    for (at, wild) in [(44, 1_u32), (48, 56), (76, 0), (92, f32::NAN.to_bits())] {
        let part = changed(&CARTESIAN, at, wild.to_le_bytes());
        assert_eq!(
            (part.position.is_some(), part.velocity),
            (true, None),
            "{at}"
        );
    }
    for at in [8, 16, 24] {
        let part = changed(&CARTESIAN, at, f64::NAN.to_le_bytes());
        assert_eq!((part.position, part.velocity), (None, None), "{at}");
    }
}

/// BESTPOS and BESTVEL count before what other logs of the epoch hold, in any order; where they are
/// inertial ones, the others count.
#[test]
fn the_best_solution_counts_first() {
    let mut inertial = POSITION;
    put(&mut inertial, HEADER + 4, 53_u32.to_le_bytes());
    seal(&mut inertial);
    let joined = |frames: [&[u8]; 4]| {
        let mut values = Values::NONE;
        for frame in frames {
            read(frame, &mut values);
        }
        (values.position, values.velocity, values.stated[1])
    };
    let psr = [&PSR_POSITION[..], &PSR_VELOCITY, &CARTESIAN];
    let [first, second, third] = psr;
    let alone = joined([first, second, first, second]);
    assert_eq!(joined([&inertial, first, second, third]), alone);
    let best = parse(&POSITION).unwrap();
    for order in [
        [&POSITION[..], third, first, second],
        [second, third, &POSITION, first],
        [third, first, second, &POSITION],
    ] {
        let (position, _, sigma) = joined(order);
        assert_eq!((Some(position), sigma), (best.position, 0.0123));
    }
}

#[test]
fn what_is_not_measured_is_not_reported() {
    for status in [1_u32, 6, 18] {
        let bytes = status.to_le_bytes();
        assert_eq!(changed(&POSITION, 0, bytes).position, None, "{status}");
        assert_eq!(changed(&VELOCITY, 0, bytes).velocity, None, "{status}");
        assert_eq!(changed(&HEADING2, 0, bytes).heading, None, "{status}");
    }
    // none, fixed, propagated, inertial, out of bounds
    for kind in [0_u32, 1, 2, 19, 51, 52, 53, 56, 72, 73, 74, 1000] {
        let bytes = kind.to_le_bytes();
        assert_eq!(changed(&POSITION, 4, bytes).position, None, "{kind}");
        assert_eq!(changed(&VELOCITY, 4, bytes).velocity, None, "{kind}");
    }
    for kind in [16_u32, 17, 18, 34, 50, 69, 70] {
        assert!(changed(&POSITION, 4, kind.to_le_bytes()).position.is_some());
    }
    for wild in [f64::NAN, f64::INFINITY, 1e9] {
        for at in [8, 16, 24] {
            assert_eq!(changed(&POSITION, at, wild.to_le_bytes()).position, None);
        }
        for at in [16, 24, 32] {
            assert_eq!(changed(&VELOCITY, at, wild.to_le_bytes()).velocity, None);
        }
    }
    for wild in [0.0_f32, -1.0, f32::NAN, f32::INFINITY] {
        for at in [40, 44, 48] {
            assert_eq!(changed(&POSITION, at, wild.to_le_bytes()).position, None);
        }
        assert_eq!(changed(&HEADING2, 24, wild.to_le_bytes()).heading, None);
    }
    for latency in [-0.1_f32, 1.5, f32::NAN] {
        assert_eq!(changed(&VELOCITY, 8, latency.to_le_bytes()).velocity, None);
    }
    let mut unknown = POSITION;
    unknown[13] = 20;
    seal(&mut unknown);
    assert_eq!(parse(&unknown), Err(Error::Field)); // the receiver does not know the time
}

#[test]
fn other_logs_pass_and_damage_does_not() {
    for id in [43_u16, 268, 1465] {
        let mut frame = POSITION;
        put(&mut frame, 4, id.to_le_bytes());
        seal(&mut frame);
        assert_eq!(scan(&frame), Scan::Other(104), "{id}");
        assert_eq!(parse(&frame), Err(Error::Content));
    }
    // an answer, and a log in text
    for kind in [0x80, 0x20] {
        let mut frame = POSITION;
        frame[6] = kind;
        seal(&mut frame);
        assert_eq!(scan(&frame), Scan::Other(104));
    }
    let mut short = POSITION;
    put(&mut short, 8, 71_u16.to_le_bytes());
    assert_eq!(scan(&short[..28]), Scan::BadChecksum);
    assert_eq!(scan(&POSITION[..10]), Scan::Partial(28));
    for bit in 24..8 * POSITION.len() {
        let mut frame = POSITION;
        frame[bit / 8] ^= 1 << (bit % 8);
        assert!(parse(&frame).is_err(), "bit {bit}");
    }
}

/// The same logs in text, by the same encoder.
const TEXT: [&str; 3] = [
    r#"#BESTPOSA,COM1,0,90.5,FINESTEERING,2400,123456.789,02000000,cdba,32768;SOL_COMPUTED,PPP,51.15043712234,-114.03067870773,1097.3556,-17.0001,WGS84,0.0176,0.0123,0.0317,"TSTR",17.000,0.000,42,38,38,38,00,00,3f,37*dd908de4"#,
    "#BESTVELA,COM1,0,90.5,FINESTEERING,2400,123456.789,02000000,cdba,32768;SOL_COMPUTED,DOPPLER_VELOCITY,0.150,0.000,5.2500,227.600000,-0.1250,0*76f21a67",
    r#"#HEADING2A,COM1,0,90.5,FINESTEERING,2400,123456.789,02000000,cdba,32768;SOL_COMPUTED,NARROW_INT,1.500000000,120.250000000,0.500000000,0.0,0.125000000,0.250000000,"0001","0002",18,17,17,16,00,01,00,33*1fa4ad61"#,
];

/// A text with a right CRC.
fn sealed(text: &str) -> Vec<u8> {
    let (body, _) = text.split_once('*').unwrap();
    let sum = crate::wire::checksum::crc32_novatel(&body.as_bytes()[1..]);
    std::format!("{body}*{sum:08X}").into_bytes()
}

#[test]
fn logs_in_text_have_the_values_of_binary_ones() {
    for (text, binary) in TEXT.iter().zip([&POSITION[..], &VELOCITY, &HEADING2]) {
        let bytes = text.as_bytes();
        assert_eq!(scan(bytes), Scan::Frame(bytes.len()));
        assert_eq!(scan(&sealed(text)), Scan::Frame(bytes.len()));
        let (mut read, binary) = (parse(bytes).unwrap(), parse(binary).unwrap());
        assert_eq!(read.time, Time::Week(123_456_789));
        read.time = binary.time;
        let height = |part: &mut DecodedMessage| {
            part.position
                .as_mut()
                .map(|at| core::mem::take(&mut at.height))
        };
        let mut binary = binary;
        let heights = height(&mut read).zip(height(&mut binary));
        assert!(heights.is_none_or(|(a, b)| (a - b).abs() < 1e-6)); // the geoid is an f32
        assert_eq!(read, binary);
        for at in 0..bytes.len() {
            let waits = matches!(scan(&bytes[..at]), Scan::Partial(needed)
                if needed > at && needed <= bytes.len());
            assert!(waits, "{at}");
            for bit in 0..8 {
                let mut damaged = bytes.to_vec();
                damaged[at] ^= 1 << bit;
                let case = at > bytes.len() - 9 && damaged[at].eq_ignore_ascii_case(&bytes[at]);
                assert_eq!(parse(&damaged).is_err(), !case, "byte {at} bit {bit}");
            }
        }
    }
}

#[test]
fn other_solutions_in_text() {
    let [position, velocity, _] = TEXT;
    for (text, from, to) in [
        (position, "BESTPOSA", "PSRPOSA"),
        (position, "BESTPOSA", "RTKPOSA"),
        (position, "BESTPOSA", "PPPPOSA"),
        (velocity, "BESTVELA", "PSRVELA"),
        (velocity, "BESTVELA", "RTKVELA"),
    ] {
        let other = parse(&sealed(&text.replace(from, to))).unwrap();
        assert_eq!(other, parse(text.as_bytes()).unwrap(), "{to}");
    }
    let (bytes, mut values) = (sealed(&position.replace("BEST", "PSR")), Values::NONE);
    read(&CARTESIAN, &mut values);
    let before = values;
    read(&bytes, &mut values);
    assert_eq!(values, before);
}

#[test]
fn what_a_log_in_text_does_not_vouch_for_is_no_value() {
    let [position, velocity, _] = TEXT;
    for (from, to) in [
        ("SOL_COMPUTED", "INSUFFICIENT_OBS"),
        ("PPP", "INS_PSRSP"),
        ("PPP", "PROPAGATED"),
        ("51.15", "91.15"),
        ("51.15043712234", ""),
        ("0.0123", "0.0"),
    ] {
        let part = parse(&sealed(&position.replacen(from, to, 1))).unwrap();
        assert_eq!(part.position, None, "{from} {to}");
    }
    for (from, to) in [("5.2500", "-5.25"), ("227.6", "361.0"), ("0.150", "x")] {
        assert_eq!(
            parse(&sealed(&velocity.replacen(from, to, 1)))
                .unwrap()
                .velocity,
            None
        );
    }
    for (from, to) in [("FINESTEERING", "UNKNOWN"), ("123456.789", "")] {
        assert_eq!(
            parse(&sealed(&velocity.replacen(from, to, 1))),
            Err(Error::Field)
        );
    }
    for other in ["#RANGEA,COM1,0;1*", "#A*"] {
        let other = sealed(other);
        assert_eq!(scan(&other), Scan::Other(other.len()));
    }
    let long = std::format!("#RANGEA,{}", "x".repeat(300));
    assert_eq!(scan(long.as_bytes()), Scan::Garbage);
}
