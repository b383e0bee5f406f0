//! With a correction of zero the output is the input, byte for byte, in every mode and format, in
//! whatever pieces it arrives.

use crate::device::Device;
use crate::frames::{Fields, Kind, kinds};
use firmware::app::{Config, Phase};
use firmware::control::Mode;
use proptest::prelude::*;

/// Any values, extreme ones too; fields narrower than 32 bits keep the low bits.
fn fields() -> impl Strategy<Value = Fields> {
    let value = prop_oneof![
        any::<i32>(),
        -100..100i32,
        Just(0x007F_FFFF),
        Just(-0x0080_0000)
    ];
    let triad = prop::array::uniform3(value);
    (triad.clone(), triad, any::<u32>()).prop_map(|(gyro, accel, rest)| Fields {
        gyro,
        accel,
        rest,
        ..Fields::default()
    })
}

fn run(config: Config, stream: &[u8], piece: usize) -> Device {
    let mut device = Device::new(config);
    device.lines.sensor.piece = piece;
    device.feed(stream);
    device
}

proptest! {
    #[test]
    fn frames_go_through(
        which in 0..kinds().len(), frozen: bool, piece in 1..100usize,
        all in prop::collection::vec(fields(), 1..80),
    ) {
        let kind = kinds()[which];
        let sent: Vec<_> = (0..).zip(&all).map(|(n, f)| kind.frame(n, *f)).collect();
        let mode = if frozen { Mode::Frozen } else { Mode::Bypass };
        let config = Config { mode, block: 0.01, ..kind.config() };
        let device = run(config, &sent.concat(), piece);
        prop_assert_eq!(device.app.phase(), Phase::Run(mode));
        // one message a frame: each leaves in one burst
        prop_assert_eq!(&device.lines.navigation.sent, &sent);
        let counters = device.counters();
        prop_assert_eq!(counters.frames as usize, sent.len());
        prop_assert_eq!((counters.garbage, counters.dropped, counters.bad_checksums), (0, 0, 0));
    }

    /// Detection passes all bytes on from the first one, and correction follows without a lost
    /// byte.
    #[test]
    fn detection_has_no_seam(which in 0..kinds().len(), piece in 1..100usize, cut in 0..30usize) {
        let kind = kinds()[which];
        let stream = kind.stream(0, 40).concat();
        let config = Config { format: None, mode: Mode::Frozen, block: 0.01, ..kind.config() };
        let device = run(config, &stream[cut..], piece);
        prop_assert_eq!(device.app.phase(), Phase::Run(Mode::Frozen));
        prop_assert_eq!(device.lines.navigation.bytes(), &stream[cut..]);
        prop_assert!(device.counters().frames > 30);
    }
}

/// Any bits in the values of a KVH message, NaN and infinities too.
#[test]
fn odd_floats_go_through() {
    use firmware::wire::kvh::{Layout, Repr};
    let odd = [
        0x8000_0000,
        0x7FC0_0001,
        0xFF81_2345,
        0x7F80_0000,
        1,
        0x7F7F_FFFF,
    ];
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        block: 0.002,
        ..Kind::KVH.config()
    });
    let mut stream = Vec::new();
    for n in 0..60 {
        let value = |k: usize| f32::from_bits(odd[(n + k) % odd.len()]);
        let repr = Repr {
            layout: Layout::A,
            gyro: [value(0), value(1), value(2)],
            accel: [value(3), value(4), value(5)],
            extra: [0; 4],
            status: 0x7F, // the own-fault bit of another device stays too
            sequence: n as u8,
            temperature: 29,
        };
        let mut buffer = [0; 40];
        let len = repr.emit(&mut buffer).expect("room");
        stream.extend(&buffer[..len]);
    }
    device.feed(&stream);
    assert_eq!(device.lines.navigation.bytes(), stream);
}

/// CR LF, control messages, special datagrams, other logs: passed on in order.
#[test]
fn other_messages_go_through() {
    let stim: Vec<u8> = Kind::STIM
        .stream(0, 50)
        .into_iter()
        .flat_map(|frame| [frame, b"\r\n".to_vec()].concat())
        .collect();
    let mut device = Device::new(Kind::STIM.config());
    device.feed(&stim);
    assert_eq!(device.lines.navigation.bytes(), stim);
    assert_eq!(device.counters().others, 50);
    let mut hg = Vec::new();
    for (n, frame) in (0..).zip(Kind::HG4930.stream(0, 20)) {
        for m in 0..5 {
            hg.extend(control(n + m));
        }
        hg.extend(frame);
    }
    let mut device = Device::new(Config {
        mode: Mode::Frozen,
        ..Kind::HG4930.config()
    });
    device.feed(&hg);
    assert_eq!(device.lines.navigation.bytes(), hg);
    assert_eq!(
        (device.counters().others, device.counters().frames),
        (100, 20)
    );
}

fn control(n: u16) -> Vec<u8> {
    use firmware::wire::hg4930::{Message, Repr};
    let repr = Repr {
        message: Message::Control,
        rate: [1, 2, n as i16],
        accel: [0; 3],
        status_1: n & 3,
        status_2: 0,
        angle: [0; 3],
        velocity: [0; 3],
    };
    let mut buffer = [0; 20];
    repr.emit(&mut buffer).expect("room");
    buffer.to_vec()
}
