//! The command link against its own reading and against damage.

use super::*;
use proptest::prelude::*;
use std::vec::Vec;

fn mode() -> impl Strategy<Value = Mode> {
    prop_oneof![
        Just(Mode::Bypass),
        Just(Mode::Frozen),
        Just(Mode::Shadow),
        Just(Mode::Learn)
    ]
}

/// Any request; the bytes of a chunk are given apart because it borrows them.
fn request(kind: u8, a: u32, b: u32, mode: Mode, real: f64, bytes: &[u8]) -> Request<'_> {
    match kind % 18 {
        0 => Request::GetVersion,
        1 => Request::GetHealth,
        2 => Request::SetMode(mode),
        3 => Request::WriteImage { offset: a, bytes },
        4 => Request::CommitImage { length: a },
        5 => Request::ReadImage {
            offset: a,
            length: b as u16,
        },
        6 => Request::Reference(Window {
            first: a,
            last: b,
            angle: [real, -real, 0.0],
            velocity: [1.0, real, 9.8],
            angle_sigma: real as f32,
            velocity_sigma: 1e-3,
        }),
        7 => Request::Alignment(Alignment::Finished),
        8 => Request::GetCounters,
        9 => Request::StoreImage,
        10 => Request::GetEstimate,
        11 => Request::ReadLearnt {
            offset: a,
            length: b as u16,
        },
        12 => Request::Heading(Heading {
            angle: real as f32,
            sigma: 0.1,
        }),
        13 => Request::GetSolution,
        14 => Request::GetTrials,
        15 => Request::GetProgress,
        16 => Request::WheelSpeed(WheelSpeed {
            speed: real as f32,
            age_ms: b as u16,
        }),
        _ => Request::CommitLearnt,
    }
}

/// Every value another one.
fn solution(latitude: f64) -> Solution {
    let value = |n: u8| f32::from(n) * -1.5 + 0.1;
    Solution {
        place: [latitude, -core::f64::consts::PI],
        height: value(0),
        velocity: [value(1), value(2), value(3)],
        attitude: [value(4), value(5), value(6), value(7)],
        estimate: [8, 11].map(|n| [value(n), value(n + 1), value(n + 2)]),
        sigma: [14, 17].map(|n| [value(n), value(n + 1), f32::INFINITY]),
    }
}

/// Every value another one; counts and bits as long as they can be.
fn trials(number: u8) -> Trials {
    let value = |n: usize| number as f32 * 1e3 - n as f32;
    Trials {
        leading: number,
        enabled: u8::MAX,
        proved: !number,
        ended: core::array::from_fn(|n| u16::MAX - n as u16),
        evidence: core::array::from_fn(value),
        proof: core::array::from_fn(|n| value(n + 8)),
        check: core::array::from_fn(|n| value(n + 16)),
    }
}

/// Every value another one.
fn progress(used_fixes: u32) -> Progress {
    Progress {
        navigates: true,
        used_fixes,
        nearest: 3,
        proof: 12.5,
        proved: false,
        stored: true,
        in_force: false,
    }
}

proptest! {
    #[test]
    fn requests_survive_the_link(
        number: u8, kind: u8, a: u32, b: u32, mode in mode(), real in -1e9..1e9f64,
        bytes in prop::collection::vec(any::<u8>(), 0..=MAX_CHUNK),
    ) {
        let request = request(kind, a, b, mode, real, &bytes);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(number, &request, &mut buffer).unwrap();
        let (zero, rest) = packet.split_last().unwrap();
        prop_assert_eq!(*zero, 0);
        prop_assert!(rest.iter().all(|&byte| byte != 0));
        prop_assert_eq!(decode::<Request>(packet), Ok((number, request)));
    }

    #[test]
    fn responses_survive_the_link(
        number: u8, counts: [u32; 7], mode in mode(), offset: u32,
        bytes in prop::collection::vec(any::<u8>(), 0..=MAX_CHUNK),
    ) {
        let [faults, frames, bad_checksums, garbage, missed, saturated, bounded] = counts;
        let health = Health {
            mode, faults, frames, bad_checksums, garbage, missed, saturated, bounded,
            error_bound_m: [0, 1, offset, u32::MAX, 7],
            winner: number, navigates: true, used_fixes: frames, refused_fixes: garbage, promotions: missed, rollbacks: u32::MAX,
            busy: Some(number.into()), busiest: None,
            way: HeadingSource::Course, heading_sigma: Some(number.into()), residual: 123,
            refused_alignments: garbage, rests: missed, rest_s: u32::MAX,
        };
        let counters = Counters { frames, entered: [u32::MAX; 3], good_fixes: garbage, ..Counters::default() };
        let version = Version { wire: WIRE_VERSION, firmware: [0, 1, 65_535], image: 1 };
        let estimate = Estimate {
            sample: u32::MAX,
            counter: Some(u16::MAX),
            window: Some((u32::MAX, frames)),
            in_force: [[f32::MAX; 3]; 2],
            network_output: [[f32::MIN; 3]; 2],
            learnt: [[0.5; 3]; 2],
            used: u32::MAX,
            doubted: u32::MAX,
        };
        for response in [
            Response::Solution(solution(f64::from(offset) * 1e-9)),
            Response::Trials(trials(number)),
            Response::Progress(progress(frames)),
            Response::Estimate(estimate),
            Response::Done,
            Response::Refused(Reason::Unsupported),
            Response::Version(version),
            Response::Health(health),
            Response::Counters(counters),
            Response::Image { offset, bytes: &bytes },
        ] {
            let mut buffer = [0; MAX_PACKET];
            let packet = encode(number, &response, &mut buffer).unwrap();
            prop_assert_eq!(decode::<Response>(packet), Ok((number, response)));
        }
    }

    #[test]
    fn one_wrong_bit_is_never_believed(
        kind: u8, a: u32, b: u32, mode in mode(), real in -1e9..1e9f64, bit: prop::sample::Index,
        bytes in prop::collection::vec(any::<u8>(), 0..=MAX_CHUNK),
    ) {
        let request = request(kind, a, b, mode, real, &bytes);
        let mut buffer = [0; MAX_PACKET];
        let packet = encode(7, &request, &mut buffer).unwrap();
        let bit = bit.index(8 * (packet.len() - 1));
        packet[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(decode::<Request>(packet).is_err());
    }

    #[test]
    fn any_bytes_are_answered(mut bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut packets = Packets::new();
        for &byte in &bytes {
            if let Some(packet) = packets.push(byte) {
                prop_assert!(decode::<Request>(packet).is_err());
            }
        }
        let _ = decode::<Response>(&mut bytes);
    }
}

#[test]
fn packets_are_found_behind_noise() {
    let mut buffer = [0; MAX_PACKET];
    let sent = encode(3, &Request::SetMode(Mode::Learn), &mut buffer)
        .unwrap()
        .to_vec();
    let mut line = std::vec![0x55; 1000]; // longer than any packet
    line.extend([0, 0]);
    line.extend(&sent);
    line.extend(&sent[1..]); // damaged
    line.extend(&sent);
    let mut packets = Packets::default();
    let mut found = Vec::new();
    for byte in line {
        if let Some(packet) = packets.push(byte) {
            found.push(matches!(
                decode(packet),
                Ok((3, Request::SetMode(Mode::Learn)))
            ));
        }
    }
    assert_eq!(found, [true, false, true]);
}

/// The wire format itself, so that nobody changes it unawares: number 3, variant 2, mode 3, CRC-32
/// of those three bytes.
#[test]
fn golden_packet() {
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(3, &Request::SetMode(Mode::Learn), &mut buffer).unwrap();
    let crc = crate::wire::checksum::crc32_zlib(&[3, 2, 3]).to_le_bytes();
    assert!(!crc.contains(&0));
    let [a, b, c, d] = crc;
    assert_eq!(packet, [8, 3, 2, 3, a, b, c, d, 0]);
}

/// The number and the message of a packet, as postcard has written them.
fn plain<M: Serialize>(number: u8, message: &M) -> Vec<u8> {
    let mut buffer = [0; MAX_PACKET];
    let packet = encode(number, message, &mut buffer).unwrap();
    let len = packet.len() - 1;
    let len = crate::wire::cobs::decode_in_place(&mut packet[..len]).unwrap();
    packet[..len - 4].to_vec()
}

/// A packet with the right CRC around whatever bytes.
fn packed(message: &[u8]) -> Vec<u8> {
    let mut plain = message.to_vec();
    plain.extend(crate::wire::checksum::crc32_zlib(message).to_le_bytes());
    let mut packet = std::vec![0; plain.len() + 3];
    crate::wire::cobs::encode(&plain, &mut packet).unwrap();
    packet
}

/// Right CRC, wrong message: one of a newer version, one with bytes left over, none at all.
#[test]
fn what_this_version_does_not_know_is_refused() {
    let decoded =
        |message: &[u8]| decode::<Request>(&mut packed(message)).map(|(number, _)| number);
    assert_eq!(decoded(&[9, 1]), Ok(9));
    assert_eq!(decoded(&[9, 1, 0]), Err(Error::Field));
    assert_eq!(decoded(&[9, 200]), Err(Error::Field));
    assert_eq!(decoded(&[9]), Err(Error::Field));
    assert_eq!(decode::<Request>(&mut [3, 1, 2, 0]), Err(Error::Header));
}

#[test]
fn a_short_buffer_is_an_error() {
    let request = Request::WriteImage {
        offset: u32::MAX,
        bytes: &[0xFF; MAX_CHUNK],
    };
    let mut buffer = [0; MAX_PACKET];
    let needed = encode(255, &request, &mut buffer).unwrap().len();
    for short in 0..needed {
        assert_eq!(
            encode(255, &request, &mut buffer[..short]),
            Err(Error::Length)
        );
    }
}

/// The requests of versions 10 and 11 and their answers are the last variants, with their fields in
/// this order, so that nobody changes them unawares.
#[test]
fn golden_solution_and_trials() {
    let (known, tried) = (solution(0.7), trials(9));
    let floats = |all: &[f32]| {
        all.iter()
            .flat_map(|of| of.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let mut expected = std::vec![3, 16];
    expected.extend(known.place.into_iter().flat_map(f64::to_le_bytes));
    expected.extend(floats(&[known.height]));
    for part in [known.velocity.as_slice(), &known.attitude] {
        expected.extend(floats(part));
    }
    expected.extend(floats(known.estimate.as_flattened()));
    expected.extend(floats(known.sigma.as_flattened()));
    assert_eq!(plain(3, &Response::Solution(known)), expected);
    let mut expected = std::vec![3, 17, 9, 255, !9];
    for n in 0..6 {
        expected.extend([0xFF - n, 0xFF, 0x03]); // u16::MAX - n as postcard's varint
    }
    for part in [tried.evidence, tried.proof, tried.check] {
        expected.extend(floats(&part));
    }
    assert_eq!(plain(3, &Response::Trials(tried)), expected);
    assert_eq!(plain(3, &Request::GetSolution), [3, 29]);
    assert_eq!(plain(3, &Request::GetTrials), [3, 30]);
    assert_eq!(plain(3, &Request::GetProgress), [3, 31]);
    // 300 is AC 02 as postcard's varint, 12.5 is 0x4148_0000
    let expected = [3, 18, 1, 0xAC, 0x02, 3, 0, 0, 0x48, 0x41, 0, 1, 0];
    assert_eq!(plain(3, &Response::Progress(progress(300))), expected);
    assert_eq!(plain(3, &Request::GetTimes), [3, 38]);
    let times = Times {
        sync: Sync::Holdover,
        holdover_s: 300,
        board_ppb: -1, // zigzag: 1
        jitter_us: [12.5, 0.0],
        sample: 2,
        sample_us: 300,
        interval_ns: 12.5,
        error_us: 0.0,
    };
    let real = [0, 0, 0x48, 0x41];
    let expected = [
        &[3, 20, 2, 0xAC, 0x02, 1][..],
        &real,
        &[0; 4],
        &[2, 0xAC, 0x02],
        &real,
        &[0; 4],
    ];
    assert_eq!(plain(3, &Response::Times(times)), expected.concat());
}

/// A byte too few or too many, with the right checksum, is no answer; nor is a request that
/// carries something.
#[test]
fn solutions_and_trials_of_another_length_are_refused() {
    for response in [
        Response::Solution(solution(0.7)),
        Response::Trials(trials(1)),
        Response::Progress(progress(1)),
    ] {
        let message = plain(5, &response);
        let refused = |message: &[u8]| decode::<Response>(&mut packed(message)).unwrap_err();
        assert_eq!(decode::<Response>(&mut packed(&message)), Ok((5, response)));
        for short in 2..message.len() {
            assert_eq!(refused(&message[..short]), Error::Field, "{short}");
        }
        assert_eq!(refused(&[&message[..], &[0]].concat()), Error::Field);
    }
    for kind in 29..=31 {
        assert!(decode::<Request>(&mut packed(&[5, kind])).is_ok());
        for more in 1..40 {
            let message = [&[5, kind][..], &std::vec![0; more]].concat();
            assert!(decode::<Request>(&mut packed(&message)).is_err(), "{more}");
        }
    }
}
