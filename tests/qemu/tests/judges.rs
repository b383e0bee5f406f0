//! Independent decoders read what the device sends, with the intended meaning: `NovAtel`'s own
//! decoder (EDIE) and pymavlink read the corrected streams, pyubx2 the fixes.

use firmware::sample::RawSample;
use firmware::wire::novatel::{Frame, Header, Log, Repr};
use firmware::wire::ubx::{PVT_LEN, Pvt};
use firmware::wire::{ImuFormat, mavlink};
use qemu::drive::drive;
use qemu::judges::{ask, python};
use qemu::replay::{Input, config};
use qemu::software::on_desktop;

/// A line as the judge prints it.
fn line(name: &str, repr: &Repr, week: u16) -> String {
    let [gx, gy, gz] = repr.gyro;
    let [ax, ay, az] = repr.accel;
    // The decoder does not know that these logs negate y; it returns the values as they are.
    let (gy, ay) = (-gy, -ay);
    let second = repr.second_of_week;
    let status = repr.status;
    format!("{name} {week} {second:?} {status} {gx} {gy} {gz} {ax} {ay} {az}")
}

#[test]
fn novatels_decoder_reads_the_corrected_stream() {
    let Some(python) = python() else { return };
    let records = drive(ImuFormat::Novatel, 5).expect("a drive");
    let sent = on_desktop(config(ImuFormat::Novatel), &records).sent;
    let length = Log::Rawimusx.frame_len();
    let frames: Vec<Repr> = sent
        .chunks(length)
        .map(|frame| Repr::parse(&Frame::new_checked(frame).expect("a good frame")))
        .collect();
    assert_eq!(frames.len(), 1000);
    let expected: Vec<String> = frames.iter().map(|f| line("RAWIMUSX", f, 2400)).collect();
    let output = ask(&python, "novatel.py", &sent).expect("it decodes");
    assert_eq!(output.len(), expected.len());
    assert_eq!(output, expected);

    // The same samples with the long header.
    let mut header = Header {
        week: 2400,
        ..Header::default()
    };
    header.long.port = 32;
    header.long.definition = 0x0DC5;
    let mut long = Vec::new();
    for frame in &frames {
        let mut buffer = [0; 128];
        let repr = Repr {
            log: Log::Rawimux,
            header,
            ..*frame
        };
        let length = repr.emit(&mut buffer).expect("it fits");
        long.extend_from_slice(&buffer[..length]);
    }
    let expected: Vec<String> = frames.iter().map(|f| line("RAWIMUX", f, 2400)).collect();
    assert_eq!(
        ask(&python, "novatel.py", &long).expect("it decodes"),
        expected
    );

    // The judge must report a damaged frame.
    let mut damaged = sent[..2 * length].to_vec();
    damaged[30] ^= 1;
    assert_eq!(
        ask(&python, "novatel.py", &damaged)
            .expect("it decodes")
            .len(),
        1
    );
}

#[test]
fn pyubx2_reads_the_fixes() {
    let Some(python) = python() else { return };
    let records = drive(ImuFormat::Novatel, 60).expect("a drive");
    let fixes: Vec<u8> = records
        .iter()
        .filter(|record| record.input == Input::Gnss)
        .flat_map(|record| record.bytes.clone())
        .collect();
    let expected: Vec<String> = fixes
        .chunks(PVT_LEN)
        .map(|bytes| {
            let p = Pvt::parse(bytes).expect("a good message");
            let [n, e, d] = p.velocity;
            let (lat, lon, h) = (p.latitude, p.longitude, p.height);
            let (time, fix, satellites) = (p.time_of_week, p.fix, p.satellites);
            let accuracy = p.horizontal_accuracy;
            format!("NAV-PVT {time} {lat} {lon} {h} {n} {e} {d} {fix} {satellites} {accuracy}")
        })
        .collect();
    assert!(expected.len() >= 60);
    assert_eq!(
        ask(&python, "ubx.py", &fixes).expect("it decodes"),
        expected
    );
}

/// A frame as the judge prints it: numbers in the shortest decimal form of an `f64`.
fn highres_imu(repr: &mavlink::Repr) -> String {
    let RawSample::Floats { gyro, accel } = repr.sample else {
        panic!("floats");
    };
    let values = gyro.into_iter().chain(accel).chain([repr.temperature]);
    let values = values.map(f64::from);
    let numbers = [repr.time_us as f64].into_iter().chain(values);
    let numbers = numbers.chain([f64::from(repr.updated), f64::from(repr.id)]);
    let numbers: Vec<f64> = numbers.collect();
    format!("{} {numbers:?}", repr.sequence)
}

/// A line of the judge in the same form.
fn judged(line: &str) -> String {
    let words: Vec<&str> = line.split(' ').collect();
    assert_eq!(words[0], "HIGHRES_IMU", "{line}");
    let numbers = words[2..]
        .iter()
        .map(|word| word.parse().expect("a number"));
    let numbers: Vec<f64> = numbers.collect();
    format!("{} {numbers:?}", words[1])
}

#[test]
fn pymavlink_reads_the_corrected_stream() {
    let Some(python) = python() else { return };
    let format = ImuFormat::Mavlink(mavlink::Imu::USUAL);
    let records = drive(format, 3).expect("a drive");
    let came: Vec<u8> = records
        .iter()
        .filter(|record| record.input == Input::Sensor)
        .flat_map(|record| record.bytes.clone())
        .collect();
    let sent = on_desktop(config(format), &records).sent;
    let length = records[0].bytes.len();
    let parse = |bytes: &[u8]| -> Vec<mavlink::Repr> {
        let frames = bytes.chunks(length);
        let frames = frames.map(|frame| {
            mavlink::Frame::new_checked(mavlink::Imu::USUAL, frame).expect("a good frame")
        });
        frames.map(|frame| mavlink::Repr::parse(&frame)).collect()
    };
    for (bytes, frames) in [(&came, parse(&came)), (&sent, parse(&sent))] {
        let output = ask(&python, "mavlink.py", bytes).expect("it decodes");
        let output: Vec<String> = output.iter().map(|line| judged(line)).collect();
        let expected: Vec<String> = frames.iter().map(highres_imu).collect();
        assert_eq!(output.len(), 3000);
        assert_eq!(output, expected);
    }
    // The correction is there, and it is small: at most 1 deg/h and 100 ug, in steps of the floats.
    let mut corrected = 0;
    for (before, after) in parse(&came).iter().zip(parse(&sent)) {
        let values = |repr: &mavlink::Repr| match repr.sample {
            RawSample::Floats { gyro, accel } => [gyro, accel],
            RawSample::Counts { .. } => panic!("floats"),
        };
        for (axis, (a, b)) in values(before).iter().zip(values(&after)).enumerate() {
            let most = [1e-5, 2e-3][axis];
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() < most, "{a} {b}");
                corrected += u32::from(*a != b);
            }
        }
        let rest = mavlink::Repr {
            sample: before.sample,
            ..after
        };
        assert_eq!(rest, *before);
    }
    assert!(corrected > 6000, "{corrected}");

    // Bytes beside frames and a damaged frame are no frames to the judge either.
    let mut damaged = sent[..3 * length].to_vec();
    damaged[length + 30] ^= 1;
    let output = ask(&python, "mavlink.py", &damaged).expect("it decodes");
    let good = output.iter().filter(|line| line.starts_with("HIGHRES_IMU"));
    assert_eq!(good.count(), 2);
}
