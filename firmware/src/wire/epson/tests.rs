//! Bursts that Epson's driver `esensorlib` reads as they are meant, and what is refused.

use super::*;
use crate::units::{DEGREE, G};
use crate::wire::examples::made;
use crate::wire::field::hex;
use crate::wire::sequence::{Gap, Last};
use crate::wire::{Change, Checked, Framing, ImuFormat, ImuProtocol, Stream};
use std::string::ToString;
use std::vec::Vec;

/// M-G366, BURST_CTRL1 0xF003, BURST_CTRL2 0x7000: 35 degrees, 1, -0.5, 2.3e-7 deg/s, 1000, -100,
/// 1.526e-5 mg, counter 4660.
const RATES: [u8; 36] =
    hex("80fe000a00000000420000ffdf0000000000010fa00000fe700000000000041234286a0d");
/// M-G370PDF1, 0xCC03, 0x4C00, both ranges 3, with the error bit: 0.00012121, -0.00024242, 1e-8
/// degrees, 0.00031381, -0.00062763, 0 m/s, counter 7.
const INCREMENTS: [u8; 36] =
    hex("80fe010000000000010000fffe000000000003000a0000ffec0000ffffffff0007fdfe0d");
/// M-G320, 0xF007, 0x0000: 25 degrees, 1, -2, 0.008 deg/s, 1000, -1, 0.2 mg, pins 257, counter 9.
const NARROW: [u8; 24] = hex("80fe000a4a007dff0600011388fffb0001010100091c5c0d");
/// M-G365PDF1 with all fields, 0xFF07, 0x2D00, ranges 0 and 1: 7.58e-6, -1.515e-5, 0 degrees,
/// 1.569e-5, -3.92e-6, 0 m/s; rates, quaternion and attitude too.
const ALL: [u8; 74] = hex(
    "80fe00000000420000ffbe00000001000000040008fff400010000fffe00000000000300040000ffff00000000000540000000c00000010001000000000000ffff00000700ffff050b0d",
);

fn settings(registers: [u16; 2], model: Model, ranges: [u8; 2]) -> crate::wire::Settings {
    let mut settings = crate::wire::Settings::DEFAULT;
    settings.epson = Settings {
        layout: Layout::try_from(registers).unwrap(),
        model,
        angle_range: ranges[0],
        velocity_range: ranges[1],
        ..Protocol::DEFAULT
    };
    settings
}

fn stream(settings: &crate::wire::Settings) -> Option<Stream> {
    Protocol::stream(&settings.epson, 0, settings.rate)
}

/// The corrected values of a burst, in deg/s and mg, or in degrees and m/s.
fn scaled(burst: &[u8], settings: &crate::wire::Settings) -> [f64; 6] {
    let layout = settings.epson.layout;
    let RawSample::Counts { gyro, accel } = Frame::new_checked(layout, burst).unwrap().sample()
    else {
        panic!("integers");
    };
    let units = stream(settings).unwrap().units;
    let [_, velocity] = layout.increments();
    let accel_unit = if velocity { 1.0 } else { G / 1000.0 };
    let [a, b, c] = gyro.map(|count| f64::from(count) * units.gyro.lsb / DEGREE);
    let [d, e, f] = accel.map(|count| f64::from(count) * units.accel.lsb / accel_unit);
    [a, b, c, d, e, f]
}

#[test]
fn golden_bursts_read_and_are_made_again() {
    let rates = settings([0xF003, 0x7000], Model::G366, [12, 12]);
    let increments = settings([0xCC03, 0x4C00], Model::G370Pdf1, [3, 3]);
    let narrow = settings([0xF007, 0x0000], Model::G320, [12, 12]);
    let all = settings([0xFF07, 0x2D00], Model::G365Pdf1, [0, 1]);
    for (burst, settings, values, count) in [
        (
            &RATES[..],
            rates,
            [1.0, -0.5, 2.3e-7, 1000.0, -100.0, 1.526e-5],
            4660,
        ),
        (
            &INCREMENTS,
            increments,
            [0.00012121, -0.00024242, 1e-8, 0.00031381, -0.00062763, 0.0],
            7,
        ),
        (&NARROW, narrow, [1.0, -2.0, 0.008, 1000.0, -1.0, 0.2], 9),
        (
            &ALL,
            all,
            [7.58e-6, -1.515e-5, 0.0, 1.569e-5, -3.92e-6, 0.0],
            0xFFFF,
        ),
    ] {
        let layout = settings.epson.layout;
        assert_eq!(scan(layout, burst), Scan::Frame(burst.len()));
        for (ours, theirs) in scaled(burst, &settings).into_iter().zip(values) {
            assert!((ours - theirs).abs() < 6e-9, "{ours} {theirs}"); // it rounds to 8 digits
        }
        assert_eq!(
            Frame::new_checked(layout, burst).unwrap().count(),
            Some(count)
        );
        assert_eq!(remade(burst, layout).unwrap(), burst);
        // a change and the change back, with the layout of the settings
        let format = ImuFormat::ALL.into_iter().find(|f| f.name() == "epson");
        let format = format.unwrap().configured(&settings);
        let mut bytes = burst.to_vec();
        let mut checked = Checked::new(format, &mut bytes).unwrap();
        let before = checked.read().unwrap().sample;
        let sample = RawSample::Counts {
            gyro: [-1, 300, 5],
            accel: [-70, 80, -90],
        };
        for sample in [&sample, &before] {
            let mark = false;
            let settings = &settings;
            let change = Change {
                sample,
                mark,
                settings,
            };
            assert_eq!(checked.change(&change), Ok(Axes::NONE));
            assert_eq!(checked.read().unwrap().sample, *sample);
            assert_eq!(format.scan(checked.bytes()), Scan::Frame(burst.len()));
        }
        assert_eq!(bytes, burst);
    }
}

#[test]
fn the_error_bit_makes_all_values_invalid() {
    let layout = Layout::new(0xCC03, 0x4C00).unwrap();
    let failed = Frame::new_checked(layout, INCREMENTS).unwrap();
    assert_eq!(failed.reading().valid, Axes::NONE);
    let good = Frame::new_checked(Layout::USUAL, RATES).unwrap();
    assert_eq!(good.reading().valid, Axes::ALL);
    // without FLAG nothing is known of it
    let layout = Layout::new(0x3001, 0x0000).unwrap();
    let burst = made(|buffer| {
        Repr {
            layout,
            numbers: [[7; 4]; 10],
        }
        .emit(buffer)
    })
    .unwrap();
    let frame = Frame::new_checked(layout, &burst).unwrap();
    assert_eq!((frame.flags(), frame.reading().valid), (None, Axes::ALL));
    assert_eq!((burst.len(), frame.count()), (16, None));
}

/// Without a checksum a damaged burst could not be distinguished from a good one.
#[test]
fn bursts_without_checksum_or_values_are_refused() {
    let why = |burst_ctrl1| Layout::new(burst_ctrl1, 0).err();
    assert_eq!(why(0xF006), Some(Refused::Checksum)); // the sensor as delivered
    assert_eq!(why(0xD003), Some(Refused::Values)); // no gyros
    assert_eq!(why(0xE003), Some(Refused::Values)); // no accelerometers
    assert_eq!(why(0xC803), Some(Refused::Values)); // delta angle alone
    assert_eq!(why(0x3001), None);
    assert!(Refused::Checksum.to_string().contains("set bit 0"));
    // nor does the configuration record take one
    let mut buffer = [0; 8];
    let bytes = postcard::to_slice(&[0xF006u16, 0], &mut buffer).unwrap();
    assert!(postcard::from_bytes::<Layout>(bytes).is_err());
    let bytes = postcard::to_slice(&Layout::USUAL, &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes(bytes), Ok(Layout::USUAL));
}

#[test]
fn what_a_model_does_not_have_has_no_units() {
    for model in Model::ALL {
        let mut configured = settings([0xF003, 0x7000], model, [12, 12]);
        assert!(stream(&configured).is_some());
        let low = stream(&configured).unwrap().units;
        configured.epson.high_range = true;
        let high = stream(&configured).map(|stream| stream.units);
        assert_eq!(high.is_some(), model.has_two_ranges());
        if let Some(high) = high {
            assert_eq!(high.accel.lsb, 2.0 * low.accel.lsb);
            assert_eq!(high.gyro, low.gyro);
        }
        let increments = settings([0xCC03, 0x4C00], model, [15, 15]);
        let old = matches!(
            model,
            Model::G320 | Model::G354 | Model::G364Pdc0 | Model::G364Pdca
        );
        assert_eq!(stream(&increments).is_none(), old, "{}", model.name());
        assert!(stream(&settings([0xCC03, 0x4C00], model, [16, 0])).is_none());
    }
}

#[test]
fn another_length_or_end_is_no_burst() {
    let usual = Layout::USUAL;
    assert_eq!(scan(usual, &[]), Scan::Partial(1));
    assert_eq!(scan(usual, &RATES[..1]), Scan::Partial(36));
    assert_eq!(scan(usual, &RATES[1..]), Scan::Garbage);
    assert_eq!(scan(usual, &[RATES, RATES].concat()), Scan::Frame(36));
    for bit in 8..8 * RATES.len() {
        let mut damaged = RATES;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(scan(usual, &damaged), Scan::BadChecksum, "bit {bit}");
    }
    // bursts of another layout
    let other = Layout::new(0xF007, 0x7000).unwrap();
    assert_eq!(scan(other, &[RATES, RATES].concat()), Scan::BadChecksum);
    let format = ImuFormat::Epson(other);
    assert_eq!(Checked::new(format, &mut { RATES }), Err(Error::Length));
}

#[test]
fn the_counter_shows_gaps_when_its_step_is_configured() {
    let mut configured = settings([0xF003, 0x7000], Model::G366, [12, 12]);
    let gaps = |settings: &crate::wire::Settings| {
        let stream = stream(settings).unwrap();
        let mut last = Last::default();
        [0xFFFE, 0xFFFF, 0, 2, 2].map(|count| {
            let mut repr = Repr::parse(&Frame::new_checked(Layout::USUAL, RATES).unwrap());
            repr.numbers[9] = [count, 0, 0, 0];
            let burst = made(|buffer| repr.emit(buffer)).unwrap();
            let frame = Frame::new_checked(Layout::USUAL, burst).unwrap();
            stream.gap(&mut last, &frame.reading())
        })
    };
    assert_eq!(gaps(&configured), [Gap::None; 5]);
    configured.epson.count_step = 1;
    let expected = [
        Gap::None,
        Gap::None,
        Gap::None,
        Gap::Missed(1),
        Gap::Duplicate,
    ];
    assert_eq!(gaps(&configured), expected);
}

/// An example with start and end marks in its data.
pub(in crate::wire) fn example(n: u8, layout: Layout) -> Vec<u8> {
    let mut numbers = [[0x0D80_0D80, n.into(), -1, 0x0D0D]; 10];
    numbers[0] = [0xFE00, 0, 0, 0];
    numbers[9] = [n.into(), 0, 0, 0];
    made(|buffer| Repr { layout, numbers }.emit(buffer)).unwrap()
}

/// See [`crate::wire::examples::Examples::remade`].
pub(in crate::wire) fn remade(frame: &[u8], layout: Layout) -> Result<Vec<u8>, Error> {
    let repr = Repr::parse(&Frame::new_checked(layout, frame)?);
    made(|buffer| repr.emit(buffer))
}
