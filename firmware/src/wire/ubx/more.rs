//! What goes with a NAV-PVT of the same time, and what older receivers send instead.
//!
//! Source: the u-blox interface descriptions (6 to F9) as `pyubx2` 1.4.0 implements them, which
//! made the golden messages. Payloads; `time` is the time of week u32, ms:
//!
//! ```text
//! NAV-COV 01 36, 64        time | version 0 | position valid u8 @5 | velocity valid u8 | ...
//!   | position NN NE ND EE ED DD f32 @16, m^2 | velocity the same @40, m^2/s^2
//! NAV-RELPOSNED 01 3C, 64  version 1 | ... | time @4 | ... | heading i32 @24, 1e-5 degree | ...
//!   | its accuracy u32 @52 | ... | flags u32 @60
//! NAV-POSLLH 01 02, 28     time | longitude i32 @4 | latitude i32, 1e-7 degree | height @12, mm
//!   | above the sea i32 | horizontal u32 @20 and vertical accuracy u32 @24, mm
//! NAV-POSECEF 01 01, 20    time | x, y, z i32 @4, cm | accuracy u32 @16, cm
//! NAV-VELNED 01 12, 36     time | north, east, down i32 @4, cm/s | ... | accuracy u32 @28, cm/s
//! NAV-VELECEF 01 11, 20    time | x, y, z i32 @4, cm/s | accuracy u32 @16, cm/s
//! NAV-HPPOSLLH 01 14, 36   version 0 | ... | invalid u8 @3 | time @4 | longitude @8 | latitude
//!   | height @16 as above | above the sea | rests of longitude, latitude i8 @24, 1e-9 degree
//!   | rest of the height i8 @26, 0.1 mm | ... | horizontal @28 and vertical accuracy @32, 0.1 mm
//! NAV-HPPOSECEF 01 13, 28  version 0 | ... | time @4 | x, y, z i32 @8, cm | rests i8 @20, 0.1 mm
//!   | invalid u8 @23 | accuracy u32 @24, 0.1 mm
//! NAV-STATUS 01 03, 16     time | fix u8 @4 | flags u8 @5
//! NAV-SOL 01 06, 52        time | ... | fix u8 @10 | flags u8 | position @12 as in NAV-POSECEF
//!   | velocity @28 as in NAV-VELECEF
//! ```
//!
//! Positions and velocities are taken where NAV-PVT has none; a precise position always. They have
//! no flag of their own: NAV-STATUS and NAV-SOL have, and a position that is worse than 1 km is
//! none.

use super::{LEAST_SIGMA, PVT_HEADER};
use crate::fix::{Heading, NOT_MEASURED, Position};
use crate::units::DEGREE;
use crate::wire::field::take;
use crate::wire::receiver::cartesian;
use crate::wire::receiver::epoch::{Head, Time, Values};
use core::f32::consts::FRAC_1_SQRT_2;

/// Least standard deviation of a heading, rad.
const LEAST_RAD: f32 = 1e-3;
/// A receiver without a fix states an accuracy of kilometres, m (assumed).
const WORST_M: f32 = 1000.0;
const ROOT_THIRD: f32 = 0.577_350_3;

/// The flags of a heading between two antennas on one vehicle: fix good, relative position valid,
/// moving base, heading valid. Without the moving base the other antenna stands somewhere else.
const FLAGS: u32 = 1 | 1 << 2 | 1 << 5 | 1 << 8;

/// The messages that are read. NAV-PVT is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Message {
    Covariance = 1,
    Baseline,
    Geodetic,
    Cartesian,
    Ned,
    CartesianVelocity,
    Precise,
    PreciseCartesian,
    Status,
    Solution,
}

impl Message {
    fn of(id: [u8; 2], payload: usize) -> Option<Message> {
        Some(match (id, payload) {
            ([1, 0x36], 64) => Message::Covariance,
            ([1, 0x3C], 64) => Message::Baseline,
            ([1, 0x02], 28) => Message::Geodetic,
            ([1, 0x01], 20) => Message::Cartesian,
            ([1, 0x12], 36) => Message::Ned,
            ([1, 0x11], 20) => Message::CartesianVelocity,
            ([1, 0x14], 36) => Message::Precise,
            ([1, 0x13], 28) => Message::PreciseCartesian,
            ([1, 0x03], 16) => Message::Status,
            ([1, 0x06], 52) => Message::Solution,
            _ => return None,
        })
    }

    fn over(frame: &[u8]) -> Option<(Message, &[u8])> {
        let payload = frame.get(PVT_HEADER.len()..frame.len().saturating_sub(2))?;
        Some((Message::of(take(frame, 2), payload.len())?, payload))
    }
}

/// Whether a message with this id has fields that are read.
pub fn is_read(id: [u8; 2], payload: usize) -> bool {
    Message::of(id, payload).is_some()
}

/// Kind and time of such a message, of the versions that are known.
pub fn head(frame: &[u8]) -> Option<Head> {
    let (message, payload) = Message::over(frame)?;
    let ([first], [fifth]) = (take(payload, 0), take(payload, 4));
    let at = match message {
        Message::Covariance if fifth != 0 => return None,
        Message::Baseline if first == 1 => 4,
        Message::Precise | Message::PreciseCartesian if first == 0 => 4,
        Message::Baseline | Message::Precise | Message::PreciseCartesian => return None,
        _ => 0,
    };
    Some(Head {
        kind: message as u8,
        time: Time::Week(u32::from_le_bytes(take(payload, at))),
    })
}

/// Writes the values of such a message.
#[inline(never)]
pub fn read(frame: &[u8], values: &mut Values) {
    let Some((message, p)) = Message::over(frame) else {
        return;
    };
    match message {
        Message::Covariance => covariance(p, values),
        Message::Baseline => baseline(p, values),
        Message::Geodetic if !values.has(0) => {
            let position = geodetic(p, 4, [0; 3]);
            let accuracies = [20, 24].map(|at| unsigned(p, at) as f32 * 1e-3);
            place(Some(position), accuracies, values);
        }
        Message::Precise if take(p, 3) == [0] => {
            let rests = take(p, 24).map(|rest: u8| i64::from(rest as i8));
            let [lon, lat, height] = rests;
            let accuracies = [28, 32].map(|at| unsigned(p, at) as f32 * 1e-4);
            place(Some(geodetic(p, 8, [lon, lat, height])), accuracies, values);
        }
        Message::Cartesian if !values.has(0) => earth_centred(p, 4, [0; 3], 16, 1e-2, values),
        Message::PreciseCartesian if take::<1>(p, 23)[0] & 1 == 0 => {
            let rests = take(p, 20).map(|rest: u8| i64::from(rest as i8));
            earth_centred(p, 8, rests, 24, 1e-4, values);
        }
        Message::Ned if !values.has(3) => {
            let velocity = triad(p, 4).map(|cm| cm as f64 * 1e-2);
            moves(velocity, unsigned(p, 28), values);
        }
        Message::CartesianVelocity => cartesian_velocity(p, 4, values),
        Message::Status => vouched(take(p, 4), values),
        Message::Solution => {
            vouched(take(p, 10), values);
            if !values.has(0) {
                earth_centred(p, 12, [0; 3], 24, 1e-2, values);
            }
            cartesian_velocity(p, 28, values);
        }
        _ => {}
    }
}

fn unsigned(payload: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(take(payload, at))
}

fn triad(payload: &[u8], at: usize) -> [i64; 3] {
    [at, at + 4, at + 8].map(|at| i32::from_le_bytes(take(payload, at)).into())
}

/// Type of the fix, and its flags: as in NAV-PVT.
fn vouched([fix, flags]: [u8; 2], values: &mut Values) {
    values.refused |= flags & 1 == 0 || !matches!(fix, 3 | 4);
}

fn covariance(payload: &[u8], values: &mut Values) {
    let diagonal = |at| [at, at + 12, at + 20].map(|at| f32::from_le_bytes(take(payload, at)));
    let [position, velocity] = take(payload, 5);
    let [least_m, least_mps] = LEAST_SIGMA;
    if position == 1 {
        values.variances(0, diagonal(16), least_m);
    }
    if velocity == 1 {
        values.variances(3, diagonal(40), least_mps);
    }
}

fn baseline(payload: &[u8], values: &mut Values) {
    const UNIT: f32 = (1e-5 * DEGREE) as f32;
    if unsigned(payload, 60) & FLAGS != FLAGS {
        return;
    }
    let angle = i32::from_le_bytes(take(payload, 24)) as f32 * UNIT;
    values.heading = Some(Heading {
        angle,
        sigma: (unsigned(payload, 52) as f32 * UNIT).max(LEAST_RAD),
    });
}

/// Longitude and latitude, 1e-7 degree and rests of 1e-9; height, mm and a rest of 0.1 mm.
fn geodetic(payload: &[u8], at: usize, [lon, lat, height]: [i64; 3]) -> Position {
    let [longitude, latitude, mm] = triad(payload, at);
    let angle = |whole: i64, rest: i64| (whole * 100 + rest) as f64 * (1e-9 * DEGREE);
    Position {
        latitude: angle(latitude, lat),
        longitude: angle(longitude, lon),
        height: (mm * 10 + height) as f64 * 1e-4,
    }
}

/// A position of cm and rests of 0.1 mm, and the unit of its accuracy.
#[inline(never)]
fn earth_centred(
    payload: &[u8],
    at: usize,
    rests: [i64; 3],
    accuracy: usize,
    unit: f32,
    values: &mut Values,
) {
    let mut xyz = [0.0; 3];
    for (m, (cm, rest)) in xyz
        .iter_mut()
        .zip(triad(payload, at).into_iter().zip(rests))
    {
        *m = (cm * 100 + rest) as f64 * 1e-4;
    }
    // of three axes
    let axis = unsigned(payload, accuracy) as f32 * unit * ROOT_THIRD;
    place(
        cartesian::position(xyz),
        [axis / FRAC_1_SQRT_2, axis],
        values,
    );
}

/// A position with its horizontal and vertical accuracy, m.
#[inline(never)]
fn place(position: Option<Position>, accuracies: [f32; 2], values: &mut Values) {
    let [horizontal, vertical] = accuracies;
    let Some(position) = position.filter(|position| position.is_plausible()) else {
        return;
    };
    if horizontal > WORST_M {
        values.refused = true;
        return;
    }
    let [least_m, _] = LEAST_SIGMA;
    let [axis, height] = [horizontal * FRAC_1_SQRT_2, vertical].map(|m| match m {
        0.0 => NOT_MEASURED,
        m => m.max(least_m),
    });
    values.position = position;
    Values::set(&mut values.own, 0, [0.0; 3]);
    Values::set(&mut values.assumed, 0, [axis, axis, height]);
}

/// A velocity north, east, down, m/s, with the accuracy of three axes, cm/s.
#[inline(never)]
fn moves(velocity: [f64; 3], accuracy: u32, values: &mut Values) {
    let [_, least_mps] = LEAST_SIGMA;
    let axis = match accuracy {
        0 => NOT_MEASURED,
        cm => (cm as f32 * (1e-2 * ROOT_THIRD)).max(least_mps),
    };
    values.velocity = velocity;
    Values::set(&mut values.own, 3, [0.0; 3]);
    Values::set(&mut values.assumed, 3, [axis; 3]);
}

/// It needs the position of the same epoch, which comes before it.
#[inline(never)]
fn cartesian_velocity(payload: &[u8], at: usize, values: &mut Values) {
    if values.has(0) && !values.has(3) {
        let xyz = triad(payload, at).map(|cm| cm as f64 * 1e-2);
        let velocity = cartesian::velocity(&values.position, xyz);
        moves(velocity, unsigned(payload, at + 12), values);
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
    use crate::wire::receiver::testing::{self, DecodedMessage, NONE};

    const COVARIANCE: [u8; 72] = hex(
        "b5620136400015cd5b070001010000000000000000000000803e0ad7233c0ad7a33cec51b83e8fc2f53cec51b83f0ad7233b0000000000000000faed6b3b000000000ad7233c703b",
    );
    const BASELINE: [u8; 72] = hex(
        "b562013c40000100000015cd5b076400000014000000fdffffff660000004727ad0100000000000000000a0000000a000000140000000a0000004fc3000000000000370100003276",
    );

    /// 47.285 and 8.5653 degrees, 547.7 m, the same from the Earth's centre; 1.25, -2.5, 0.12 m/s.
    const GEODETIC: [u8; 36] =
        hex("b56201021c0015cd5b0708f61a05501e2f1c745b0800909f070086050000d0070000a829");
    const CARTESIAN: [u8; 28] = hex("b5620101140015cd5b0771a88c194c21d903f144cc1bad0000002a6b");
    const NED: [u8; 44] = hex(
        "b5620112240015cd5b077d00000006ffffff0c0000001801000017010000bf83c401110000009f86010076a0",
    );
    const CARTESIAN_VELOCITY: [u8; 28] =
        hex("b5620111140015cd5b07c2fffffffafeffff4c000000110000007c38");
    const PRECISE: [u8; 44] = hex(
        "b562011424000000000015cd5b0708f61a05501e2f1c745b0800909f07000000000086050000d0070000c2ab",
    );
    const PRECISE_CARTESIAN: [u8; 36] =
        hex("b56201131c000000000015cd5b0771a88c194c21d903f044cc1b00000000ad00000043c9");
    const STATUS: [u8; 24] = hex("b5620103100015cd5b070301000000000000000000005c44");
    const SOLUTION: [u8; 60] = hex(
        "b5620106340015cd5b07000000000000030171a88c194c21d903f144cc1bad000000c2fffffffafeffff4c000000110000000000000000000000655e",
    );

    /// A message, and bytes of its payload that are others.
    type Message<'m> = (&'m [u8], &'m [(usize, u8)]);

    /// The values of messages of one epoch, whose payloads may be changed before.
    fn joined(messages: &[Message]) -> Values {
        let mut values = Values::NONE;
        for (message, changes) in messages {
            let mut frame = message.to_vec();
            let end = frame.len() - 2;
            changes.iter().for_each(|(at, byte)| frame[6 + at] = *byte);
            let sum = fletcher8(&frame[2..end]);
            put(&mut frame, end, sum);
            assert_eq!(scan(&frame), Scan::Frame(frame.len()));
            let head = super::super::head(&frame).unwrap();
            assert_eq!(head.time, Time::Week(123_456_789));
            super::super::read(&frame, &mut values);
        }
        values
    }

    fn check(values: &Values, sigmas: [f32; 6], within_m: f64) {
        let at = values.position;
        let metres = [
            (at.latitude - 47.285_f64.to_radians()) * 6.37e6,
            (at.longitude - 8.5653_f64.to_radians()) * 4.3e6,
            at.height - 547.7,
        ];
        assert!(metres.iter().all(|m| m.abs() < within_m), "{metres:?}");
        let moves = values.velocity.into_iter().zip([1.25, -2.5, 0.12]);
        assert!(
            moves.clone().all(|(v, want)| (v - want).abs() < 0.01),
            "{values:?}"
        );
        for (sigma, want) in values.assumed.into_iter().zip(sigmas) {
            assert!((sigma - want).abs() < 0.01 * want, "{:?}", values.assumed);
        }
        assert_eq!((values.own, values.refused), ([0.0; 6], false));
    }

    #[test]
    fn geodetic_and_cartesian_forms_agree() {
        const NONE: &[(usize, u8)] = &[];
        let (m, mps) = (1.0, 0.098_15);
        let flat = [m, m, 2.0, mps, mps, mps];
        check(&joined(&[(&GEODETIC, NONE), (&NED, NONE)]), flat, 0.006);
        let round = [m, m, m, mps, mps, mps];
        let pair: [Message; 2] = [(&CARTESIAN, NONE), (&CARTESIAN_VELOCITY, NONE)];
        check(&joined(&pair), round, 0.01);
        check(&joined(&[(&SOLUTION, NONE)]), round, 0.01);
        check(
            &joined(&[(&GEODETIC, NONE), pair[1], (&STATUS, NONE)]),
            flat,
            0.006,
        );
        // precise positions count after coarse ones: 0.1414 m, and 0.0173 m of three axes
        let fine = [0.1, 0.1, 0.2, mps, mps, mps];
        check(
            &joined(&[(&GEODETIC, NONE), (&PRECISE, NONE), (&NED, NONE)]),
            fine,
            1e-3,
        );
        let fine = [0.01, 0.01, 0.01, mps, mps, mps];
        let rests: &[(usize, u8)] = &[(20, 3), (21, 37), (22, 71)];
        check(
            &joined(&[(&PRECISE_CARTESIAN, rests), (&NED, NONE)]),
            fine,
            1e-3,
        );
        // 33e-9 and -45e-9 degrees, 0.7 mm
        let rests: &[(usize, u8)] = &[(24, 33), (25, 256_u16.wrapping_sub(45) as u8), (26, 7)];
        let [plain, moved] = [NONE, rests].map(|rests| joined(&[(&PRECISE, rests)]).position);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(near(
            moved.longitude - plain.longitude,
            33e-9_f64.to_radians()
        ));
        assert!(near(
            moved.latitude - plain.latitude,
            -45e-9_f64.to_radians()
        ));
        assert!((moved.height - plain.height - 7e-4).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_fix_is_refused() {
        let velocity = joined(&[(&CARTESIAN_VELOCITY, &[])]);
        assert!(!velocity.has(0) && !velocity.has(3)); // turned by which position?
        for (message, at, byte) in [
            (&STATUS[..], 4, 0),
            (&STATUS, 4, 2),
            (&STATUS, 5, 0xFE),
            (&SOLUTION, 10, 5),
            (&SOLUTION, 11, 0),
            (&GEODETIC, 22, 0x40), // 4.2 km
        ] {
            assert!(joined(&[(&NED, &[]), (message, &[(at, byte)])]).refused);
        }
        for (message, at) in [(&PRECISE[..], 3), (&PRECISE_CARTESIAN, 23)] {
            assert!(!joined(&[(message, &[(at, 1)])]).has(0)); // invalid
        }
        // the solution of a receiver that has NAV-PVT is that
        let pvt = super::super::Pvt {
            time_of_week: 123_456_789,
            ..Default::default()
        };
        assert!(joined(&[(&pvt.emit(), &[]), (&GEODETIC, &[])]).refused);
    }

    /// That of a u-blox 7 has 84 bytes.
    #[test]
    fn a_shorter_pvt_is_read() {
        let pvt = super::super::Pvt {
            time_of_week: 123_456_789,
            fix: 3,
            flags: 1,
            latitude: 472_850_000,
            horizontal_accuracy: 1414,
            velocity: [1000, 0, 0],
            ..Default::default()
        };
        let mut frame = pvt.emit()[..90].to_vec();
        frame[4] = 84;
        frame.extend(fletcher8(&frame[2..90]));
        assert_eq!(scan(&frame), Scan::Frame(92));
        let part = read(&frame).unwrap();
        assert_eq!(part.velocity, Some([1.0, 0.0, 0.0]));
        assert!((part.assumed[0] - 1.0).abs() < 1e-3);
    }

    fn read(frame: &[u8]) -> Option<DecodedMessage> {
        testing::parse(ReceiverFormat::Ubx, frame).ok()
    }

    fn changed<const N: usize>(
        frame: &[u8; 72],
        at: usize,
        bytes: [u8; N],
    ) -> Option<DecodedMessage> {
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
