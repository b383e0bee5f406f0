//! Receiver messages from third-party libraries (`judges/receivers.py`), which the device's
//! decoders read with the same meaning, one by one and as a stream.

use std::collections::HashMap;

use firmware::wire::receiver::ReceiverFormat;
use firmware::wire::receiver::epoch::{Arrival, Time, Values};
use firmware::wire::{Framing, Receiver, Scan};
use qemu::judges::{ask, python};

/// A message, and the values that the judge reads in it.
struct JudgedMessage {
    format: ReceiverFormat,
    bytes: Vec<u8>,
    values: HashMap<String, f64>,
}

fn made(line: &str) -> JudgedMessage {
    let mut words = line.split(' ');
    let name = words.next().expect("a format");
    let mut all = ReceiverFormat::ALL.into_iter();
    let format = all.find(|format| format!("{format:?}") == name);
    let hex = words.next().expect("bytes");
    let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hex");
    let values = words.map(|word| {
        let (key, value) = word.split_once('=').expect("a value");
        (key.to_owned(), value.parse().expect("a number"))
    });
    JudgedMessage {
        format: format.expect("a known format"),
        bytes: (0..hex.len()).step_by(2).map(byte).collect(),
        values: values.collect(),
    }
}

/// The device's value for a key of the judge, and the tolerance.
fn read(values: &Values, time: Time, key: &str) -> (f64, f64) {
    let degrees = |radians: f64| radians.to_degrees();
    let heading = || values.heading.expect("a heading");
    let [north, east, down] = values.velocity;
    match key {
        "ms" => match time {
            Time::Week(ms) | Time::Day(ms) => (ms.into(), 0.0),
            Time::Same => panic!("a time"),
        },
        // the judges round to 1e-10 degree
        "lat" => (degrees(values.position.latitude), 2e-10),
        "lon" => (degrees(values.position.longitude), 2e-10),
        // NovAtel's decoder has the geoid as an f32, also from text
        "h" => (values.position.height, 5e-6),
        "n" => (north, 1e-6),
        "e" => (east, 1e-6),
        "d" => (down, 1e-6),
        "speed" => (north.hypot(east), 3e-5),
        "course" => (degrees(east.atan2(north)).rem_euclid(360.0), 2e-3),
        "heading" => (degrees(heading().angle.into()), 5e-5),
        "hs" => (degrees(heading().sigma.into()), 2e-5),
        sigma => {
            let at: usize = sigma
                .strip_prefix('s')
                .expect("a key")
                .parse()
                .expect("one");
            let stated = values.stated[at];
            let known = if stated.is_finite() {
                stated
            } else {
                values.assumed[at]
            };
            (known.into(), 2e-6 * f64::from(known))
        }
    }
}

#[test]
fn messages_of_four_libraries_have_the_meaning_that_they_read() {
    let Some(python) = python() else { return };
    let lines = ask(&python, "receivers.py", &[]).expect("it makes messages");
    assert_eq!(lines.len(), 50 * 24);
    let mut compared = 0;
    for line in &lines {
        let JudgedMessage {
            format,
            bytes,
            values,
        } = made(line);
        assert_eq!(format.scan(&bytes), Scan::Frame(bytes.len()), "{line}");
        let head = format.head(&bytes).expect("a message that is read");
        let mut decoded = Values::NONE;
        format.read(&bytes, &mut decoded);
        for (key, want) in values {
            let (got, within) = read(&decoded, head.time, &key);
            assert!((got - want).abs() <= within, "{key} {got} {want}: {line}");
            compared += 1;
        }
        // nothing of a damaged message is read
        let mut damaged = bytes.clone();
        damaged[bytes.len() / 2] ^= 2;
        assert!(!matches!(
            format.scan(&damaged),
            Scan::Frame(_) | Scan::Other(_)
        ));
    }
    assert!(compared > 4000, "{compared}");
}

/// All messages of a format one after another, joined to fixes: one for each epoch that is made.
#[test]
fn their_streams_become_fixes() {
    let Some(python) = python() else { return };
    let lines = ask(&python, "receivers.py", &[]).expect("it makes messages");
    for format in ReceiverFormat::ALL {
        let mut receiver = Receiver::new(Some(format));
        let (mut fixes, mut headings, mut us) = (0, 0, 0);
        let all = lines.iter().map(|line| made(line));
        for message in all.filter(|message| message.format == format) {
            for piece in message.bytes.chunks(64) {
                us += 1000;
                receiver.push(piece, Arrival { us, sample: 0 });
                while let Some(solution) = receiver.next_fix() {
                    let fix = solution.fix.expect("a good fix");
                    assert!(fix.has(0..5), "{fix:?}");
                    fixes += 1;
                    headings += u32::from(fix.heading.is_some());
                }
            }
        }
        // from the second one on with a heading
        assert_eq!((fixes, headings), (50, 49), "{format:?}");
    }
}
