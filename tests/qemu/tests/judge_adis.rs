//! A decoder written in another language from the interface document alone reads our frames around
//! ADIS bursts with the intended meaning.

use firmware::sample::RawSample;
use firmware::wire::{Change, Checked, Fields, ImuFormat, framer};
use qemu::drive::drive;
use qemu::judges::{ask, python};
use qemu::replay::config;
use qemu::software::on_desktop;

fn adis() -> ImuFormat {
    ImuFormat::from_name("adis-uart").expect("a format")
}

fn ask_for_lines(bytes: &[u8]) -> Option<Vec<String>> {
    let python = python()?;
    Some(ask(&python, "adis.py", bytes).expect("it decodes"))
}

/// The values, as the decoder prints them.
fn words(sample: RawSample) -> String {
    let RawSample::Counts { gyro, accel } = sample else {
        panic!("integers");
    };
    let words = [gyro, accel].concat();
    words
        .iter()
        .map(i32::to_string)
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn the_reader_of_the_document_reads_the_corrected_stream() {
    let records = drive(adis(), 4).expect("a drive");
    let sent = on_desktop(config(adis()), &records).sent;
    // garbage with a start mark, then the frames, one of them damaged
    let mut line = b"\xad\x15\x14 no frame".to_vec();
    let damaged = line.len() + 44 * 7 + 20;
    line.extend(&sent);
    line[damaged] ^= 0x10;
    let Some(lines) = ask_for_lines(&line) else {
        return;
    };
    let frames = sent.chunks(44).enumerate().filter(|(n, _)| *n != 7);
    let expected: Vec<String> = frames
        .map(|(_, frame)| {
            let mut frame = frame.to_vec();
            let checked = Checked::new(adis(), &mut frame).expect("a good frame");
            let reading = checked.read().expect("values");
            let counter = reading.counter.expect("a counter");
            let time = u32::from_le_bytes([frame[4], frame[5], frame[6], frame[7]]);
            format!("0 {time} 0 {} 250 {counter}", words(reading.sample))
        })
        .collect();
    assert_eq!(lines.len(), 3999);
    assert_eq!(lines, expected);
}

/// All forms, before and after a change, and with our own fault flag.
#[test]
fn the_reader_of_the_document_reads_every_form() {
    for sensor in adis().simulated() {
        let fields = Fields {
            index: 0x1234,
            time: 1.5,
            gyro: [1000, -2000, 32_767],
            accel: [-32_768, 5, 5000],
            rest: 251,
        };
        let mut buffer = [0; framer::LONGEST];
        let len = (sensor.emit)(&fields, &mut buffer).expect("room");
        let settings = sensor.settings();
        let before = buffer[..len].to_vec();
        let mut checked = Checked::new(adis(), &mut buffer[..len]).expect("a good frame");
        let sample = RawSample::Counts {
            gyro: [17, -18_000, 30_000],
            accel: [-5, 0, -32_768],
        };
        let change = Change {
            sample: &sample,
            mark: true,
            settings: &settings,
        };
        checked.change(&change).expect("room");
        let Some(lines) = ask_for_lines(&[&before[..], checked.bytes()].concat()) else {
            return;
        };
        let increments = u8::from(sensor.name.contains("increments"));
        let old = "1500000 0 1000 -2000 32767 -32768 5 5000 251 4660";
        let new = "1500000 0 17 -18000 30000 -5 0 -32768 251 4660";
        let marked = increments | 0x80;
        let expected = [format!("{increments} {old}"), format!("{marked} {new}")];
        assert_eq!(lines, expected, "{}", sensor.name);
    }
}
