//! Every byte that comes leaves: once, in order, unmoved, whatever it is. A correction changes
//! values and checksums of good frames and nothing else.

use crate::device::{Device, nets};
use crate::frames::{Kind, kinds};
use firmware::app::Config;
use firmware::compensator::Limit;
use firmware::control::Mode;
use firmware::sample::RawSample;
use firmware::wire::command::Request;
use firmware::wire::{Change, Checked, Framing, ImuFormat, Scan, Settings};
use proptest::prelude::*;

const TEXT: [&[u8]; 6] = [
    b"CONFIG,1\r\n",
    b"ROTFMT,DELTA\r\n",
    b"<OK\r\n[COM1]",
    b"$GPGGA,134658.00,5106.9792,N,11402.3003,W,2,09,1.0,1048.47,M,-16.27,M,08,AAAA*60\r\n",
    b"#BESTPOSA,COM1,0,90.5,FINESTEERING,1949,403742.000,02000000,b1f6,32768;SOL_COMPUTED*0\r\n",
    b"\r",
];

/// A piece of the sensor's output, or a request meanwhile.
#[derive(Debug, Clone)]
enum Piece {
    /// A number of frames of a kind in a row.
    Frames(usize, u8),
    /// One with a wrong bit.
    Damaged(usize, prop::sample::Index),
    /// The beginning of one.
    Part(usize, prop::sample::Index),
    Text(usize),
    Noise(Vec<u8>),
    /// A `NovAtel` log with so many bytes of payload and these among them.
    Log(u16, Vec<u8>),
    /// Milliseconds without a byte.
    Pause(u16),
    Mode(Mode),
}

fn pieces() -> impl Strategy<Value = Vec<Piece>> {
    let kind = 0..kinds().len();
    let noise = || prop::collection::vec(any::<u8>(), 0..200);
    let modes = prop_oneof![
        Just(Mode::Bypass),
        Just(Mode::Frozen),
        Just(Mode::Bypass),
        Just(Mode::Shadow)
    ];
    let piece = prop_oneof![
        6 => (kind.clone(), 1..30u8).prop_map(|(kind, many)| Piece::Frames(kind, many)),
        2 => (kind.clone(), any::<prop::sample::Index>()).prop_map(|(k, at)| Piece::Damaged(k, at)),
        2 => (kind, any::<prop::sample::Index>()).prop_map(|(k, at)| Piece::Part(k, at)),
        2 => (0..TEXT.len()).prop_map(Piece::Text),
        2 => noise().prop_map(Piece::Noise),
        1 => (0..3000u16, noise()).prop_map(|(len, bytes)| Piece::Log(len, bytes)),
        1 => (0..400u16).prop_map(Piece::Pause),
        1 => modes.prop_map(Piece::Mode),
    ];
    prop::collection::vec(piece, 1..40)
}

/// A good log with a long header, and bytes among its payload that may look like frames.
pub fn log(len: u16, bytes: &[u8]) -> Vec<u8> {
    let mut log = vec![0xAA, 0x44, 0x12, 28, 43, 0, 0, 32];
    log.extend(len.to_le_bytes());
    log.resize(28, 0);
    log.extend((0..len).map(|n| (n % 251) as u8));
    let middle = 28 + usize::from(len / 2);
    for (place, byte) in log[middle..].iter_mut().zip(bytes) {
        *place = *byte;
    }
    log.extend([0; 4]);
    ImuFormat::Novatel.seal(&mut log);
    log
}

/// Which bytes of a good frame a correction may change: values, and the checksum behind them.
fn may_change(format: ImuFormat, frame: &[u8]) -> Vec<bool> {
    let mut changed = vec![false; frame.len()];
    for n in 1..64i32 {
        let mut other = frame.to_vec();
        let mut checked = Checked::new(format, &mut other).expect("a frame");
        let value = |axis: u32| n.wrapping_mul(0x0125_9E37).rotate_left(5 * axis) >> (n % 3 * 8);
        let Ok(reading) = checked.read() else { break };
        let sample = match reading.sample {
            RawSample::Counts { .. } => RawSample::Counts {
                gyro: [0, 1, 2].map(value),
                accel: [3, 4, 5].map(value),
            },
            RawSample::Floats { .. } => RawSample::Floats {
                gyro: [0, 1, 2].map(|axis| f32::from_bits(value(axis).cast_unsigned())),
                accel: [3, 4, 5].map(|axis| f32::from_bits(value(axis).cast_unsigned())),
            },
        };
        let settings = &Settings::DEFAULT;
        let change = Change {
            sample: &sample,
            mark: false,
            settings,
        };
        let _ = checked.change(&change);
        for (changed, (a, b)) in changed.iter_mut().zip(frame.iter().zip(&other)) {
            *changed |= a != b;
        }
    }
    // six values, twice where a frame contains them twice, and two checksums
    let most = 2 * 6 * 4 + 8;
    assert!(changed.iter().filter(|c| **c).count() <= most, "{format:?}");
    changed
}

/// Marks the bytes that a correction may change. A good frame is one by its bytes, whoever sent
/// them: the beginning of a frame may be completed by the noise behind it.
fn may_be_corrected(came: &[u8]) -> Vec<bool> {
    let mut mask = vec![false; came.len()];
    let mut formats: Vec<ImuFormat> = Vec::new();
    for format in ImuFormat::ALL
        .into_iter()
        .chain(kinds().into_iter().map(|kind| kind.format))
    {
        if !formats.contains(&format) {
            formats.push(format);
        }
    }
    for at in 0..came.len() {
        for format in &formats {
            let Scan::Frame(len) = format.scan(&came[at..]) else {
                continue;
            };
            let may = may_change(*format, &came[at..at + len]);
            for (mask, may) in mask[at..].iter_mut().zip(may) {
                *mask |= may;
            }
        }
    }
    mask
}

/// Sends the pieces. Returns what came.
fn send(device: &mut Device, pieces: &[Piece]) -> Vec<u8> {
    let kinds = kinds();
    let mut came = Vec::new();
    let mut n = 0u32;
    for piece in pieces {
        let mut frame = |which: usize| {
            n += 1;
            kinds[which].stream(n, n + 1).remove(0)
        };
        let bytes = match piece {
            Piece::Frames(which, many) => (0..*many).flat_map(|_| frame(*which)).collect(),
            Piece::Damaged(which, at) => {
                let mut frame = frame(*which);
                let bit = at.index(8 * frame.len());
                frame[bit / 8] ^= 1 << (bit % 8);
                frame
            }
            Piece::Part(which, at) => {
                let mut frame = frame(*which);
                frame.truncate(at.index(frame.len()));
                frame
            }
            Piece::Text(which) => TEXT[*which].to_vec(),
            Piece::Noise(bytes) => bytes.clone(),
            Piece::Log(len, bytes) => log(*len, bytes),
            Piece::Pause(ms) => {
                device.wait_ms((*ms).into());
                continue;
            }
            Piece::Mode(mode) => {
                device.order(&Request::SetMode(*mode));
                continue;
            }
        };
        device.feed(&bytes);
        device.pass_us(300);
        came.extend(bytes);
    }
    device.wait_ms(500);
    came
}

/// A device that corrects by much in every axis.
fn correcting(config: Config) -> Device {
    Device::new(Config {
        mode: Mode::Frozen,
        block: 0.01,
        limit: Limit {
            gyro: 10.0,
            accel: 100.0,
        },
        nets: nets([0.5, -0.5, 0.5], [5.0, -5.0, 5.0]),
        mark: false,
        ..config
    })
}

/// Every beginning of a frame, completed by bytes that another sender happened to send, is a frame.
#[test]
fn a_frame_that_another_byte_completes_is_corrected() {
    for kind in kinds() {
        let mut device = correcting(kind.config());
        let mut came = Vec::new();
        for n in 0..300 {
            let frame = kind.stream(n, n + 1).remove(0);
            let (part, rest) = frame.split_at(frame.len() - 1);
            device.feed(part);
            device.pass_us(300);
            device.feed(rest);
            came.extend(frame);
        }
        device.wait_ms(500);
        let left = device.lines.navigation.bytes();
        assert_ne!(left, came, "{kind:?}");
        let mask = may_be_corrected(&came);
        for (at, (came, left)) in came.iter().zip(&left).enumerate() {
            assert!(came == left || mask[at], "{kind:?}: byte {at}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// With a zero correction the output is the input, in every mode and state, with and without a
    /// configured format, whatever comes and however it is cut.
    #[test]
    fn every_byte_passes_once(
        pieces in pieces(), cut in 1..100usize, format in prop::option::of(0..kinds().len()), bypass: bool,
    ) {
        let config = format.map_or_else(Config::default, |which| kinds()[which].config());
        let mode = if bypass { Mode::Bypass } else { Mode::Frozen };
        let mut device = Device::new(Config { mode, block: 0.01, ..config });
        device.lines.sensor.piece = cut;
        let came = send(&mut device, &pieces);
        prop_assert_eq!(device.counters().dropped, 0);
        prop_assert_eq!(device.lines.navigation.bytes(), came);
    }

    /// In the other modes the output has the length of the input, and all bytes that are no value
    /// and no checksum are the same.
    #[test]
    fn only_values_are_corrected(
        pieces in pieces(), cut in 1..100usize, format in prop::option::of(0..kinds().len()),
    ) {
        let config = format.map_or_else(Config::default, |which| kinds()[which].config());
        let mut device = correcting(config);
        device.lines.sensor.piece = cut;
        let came = send(&mut device, &pieces);
        let left = device.lines.navigation.bytes();
        prop_assert_eq!(left.len(), came.len());
        let mask = may_be_corrected(&came);
        for (at, (came, left)) in came.iter().zip(&left).enumerate() {
            prop_assert!(came == left || mask[at], "byte {} of {}", at, mask.len());
        }
    }
}

/// A sensor of another format than the one configured: all of its bytes pass, and a fault reports
/// it.
#[test]
fn another_format_than_the_configured_one_passes() {
    use firmware::wire::command::fault;
    for kind in kinds() {
        for other in [Kind::KVH, Kind::STIM]
            .into_iter()
            .filter(|other| other.format != kind.format)
        {
            let mut device = Device::new(kind.config());
            let stream = other.stream(0, 40_000 / 36).concat();
            device.feed(&stream);
            device.wait_ms(100); // the last bytes may look like a beginning
            assert_eq!(
                device.lines.navigation.bytes(),
                stream,
                "{other:?} as {kind:?}"
            );
            assert_ne!(
                device.app.faults() & fault::UNKNOWN_FORMAT,
                0,
                "{other:?} as {kind:?}"
            );
        }
    }
}
