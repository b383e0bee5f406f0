//! Epson's own Python driver reads bursts as the device reads them, before and after the device has
//! changed them.

use firmware::sample::{Axes, RawSample};
use firmware::wire::{Change, Checked, Fields, ImuFormat, Simulated, framer};
use qemu::drive::drive;
use qemu::judges::{ask_with, python};
use qemu::replay::{Input, config};
use qemu::software::on_desktop;
use std::path::Path;

fn epson() -> ImuFormat {
    ImuFormat::from_name("epson").expect("a format")
}

/// For each simulated sensor, the driver's model, BURST_CTRL1 and BURST_CTRL2, the ranges of the
/// increments, the names of the corrected fields, and counts per unit of the driver: deg/s and mg,
/// or degrees and m/s.
const SENSORS: [(&[&str; 5], [&str; 2], [f64; 2]); 3] = [
    (
        &["g366pdg0", "0xF003", "0x7000", "0", "0"],
        ["gyro32", "accl32"],
        [66.0 * 65_536.0, 4.0 * 65_536.0],
    ),
    (
        &["g370pdf1", "0xCC03", "0x4C00", "3", "3"],
        ["dlta32", "dltv32"],
        [66.0 * 65_536.0 / 8e-3, 2.5 * 65_536.0 / 8e-3 / 9.80665e-3],
    ),
    (
        &["g320", "0xF007", "0x0000", "0", "0"],
        ["gyro", "accl"],
        [125.0, 5.0],
    ),
];

/// The driver's output line for each burst, as names and numbers.
fn lines(python: &Path, arguments: &[&str], bytes: &[u8]) -> Vec<Vec<(String, f64)>> {
    let output = ask_with(python, "epson.py", arguments, bytes).expect("it decodes");
    let number = |word: &str| {
        let (name, value) = word.split_once('=').expect("a name");
        (name.to_string(), value.parse().expect("a number"))
    };
    let words = |line: &String| line.split_whitespace().map(number).collect();
    output.iter().map(words).collect()
}

/// The six corrected values of a line, and all its other numbers but the checksum.
fn apart(line: &[(String, f64)], fields: [&str; 2]) -> ([f64; 6], Vec<(String, f64)>) {
    let mut line = line.to_vec();
    line.retain(|(name, _)| name != "chksm");
    let names = fields.map(|field| ["X", "Y", "Z"].map(|axis| format!("{field}_{axis}")));
    let names = names.concat();
    let value = |name: &String| line.iter().find(|(n, _)| n == name).expect("it is there").1;
    let values: Vec<f64> = names.iter().map(value).collect();
    line.retain(|(name, _)| !names.contains(name));
    (values.try_into().expect("six"), line)
}

/// Compares the driver's values with counts. The driver rounds to 6 or 8 digits.
fn assert_reads(values: [f64; 6], counts: [i32; 6], per_unit: [f64; 2]) {
    for (axis, (value, count)) in values.into_iter().zip(counts).enumerate() {
        let ours = f64::from(count) / per_unit[axis / 3];
        assert!((value - ours).abs() < 0.6e-8, "axis {axis}: {value} {ours}");
    }
}

fn counts(sample: RawSample) -> [i32; 6] {
    match sample {
        RawSample::Counts { gyro, accel } => [gyro, accel].concat().try_into().expect("six"),
        RawSample::Floats { .. } => panic!("integers"),
    }
}

#[test]
fn epsons_driver_reads_the_corrected_stream() {
    let Some(python) = python() else { return };
    let (arguments, fields, per_unit) = SENSORS[0];
    let records = drive(epson(), 4).expect("a drive");
    let sent = on_desktop(config(epson()), &records).sent;
    let came = records
        .iter()
        .filter(|record| record.input == Input::Sensor);
    let came: Vec<u8> = came.flat_map(|record| record.bytes.clone()).collect();
    let [before, after] = [&came, &sent].map(|bytes| lines(&python, arguments, bytes));
    assert_eq!((before.len(), after.len()), (4000, 4000));
    let mut corrected = 0;
    for ((before, after), frame) in before.iter().zip(&after).zip(sent.chunks(36)) {
        let ((old, rest), (new, same)) = (apart(before, fields), apart(after, fields));
        assert_eq!(rest, same);
        let mut frame = frame.to_vec();
        let frame = Checked::new(epson(), &mut frame).expect("a good burst");
        assert_reads(new, counts(frame.read().expect("values").sample), per_unit);
        corrected += u32::from(old != new);
        // 1 deg/h and 100 ug of the networks, and a count
        let far = |(a, b): (f64, f64), most: f64| (a - b).abs() > most;
        let pairs = old.into_iter().zip(new).enumerate();
        let wrong = pairs.filter(|(k, p)| far(*p, if *k < 3 { 4e-4 } else { 0.2 }));
        assert_eq!(wrong.count(), 0, "{old:?} {new:?}");
    }
    assert!(corrected > 1000, "{corrected}");
    let mut damaged = sent[..72].to_vec();
    damaged[10] ^= 1;
    assert_eq!(lines(&python, arguments, &damaged).len(), 1);
}

#[test]
fn epsons_driver_reads_every_layout_before_and_after_a_change() {
    let Some(python) = python() else { return };
    let sensors = epson().simulated();
    assert_eq!(sensors.len(), SENSORS.len());
    for (sensor, (arguments, fields, per_unit)) in sensors.iter().zip(SENSORS) {
        let mut bytes = burst(sensor);
        let settings = sensor.settings();
        let mut checked =
            Checked::new(epson().configured(&settings), &mut bytes).expect("a good burst");
        let old = counts(checked.read().expect("values").sample);
        let before = lines(&python, arguments, checked.bytes());
        let new = [17, -18_000, 30_000, -5, 0, -32_768];
        let sample = RawSample::Counts {
            gyro: [17, -18_000, 30_000],
            accel: [-5, 0, -32_768],
        };
        let change = Change {
            sample: &sample,
            mark: false,
            settings: &settings,
        };
        assert_eq!(checked.change(&change), Ok(Axes::NONE));
        let after = lines(&python, arguments, checked.bytes());
        let (values, rest) = apart(&before[0], fields);
        assert_reads(values, old, per_unit);
        let (values, same) = apart(&after[0], fields);
        assert_reads(values, new, per_unit);
        assert_eq!(rest, same);
    }
}

fn burst(sensor: &Simulated) -> Vec<u8> {
    let fields = Fields {
        index: 0x1234,
        gyro: [1000, -2000, 32_767],
        accel: [-32_768, 5, 5000],
        rest: 0x0A00,
        ..Fields::default()
    };
    let mut buffer = [0; framer::LONGEST];
    let len = (sensor.emit)(&fields, &mut buffer).expect("room");
    buffer[..len].to_vec()
}
