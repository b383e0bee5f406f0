//! Independent decoders read what the device sends, with the intended meaning: `NovAtel`'s own
//! decoder (EDIE) reads the corrected stream, pyubx2 the fixes.

use firmware::wire::ImuFormat;
use firmware::wire::novatel::{Frame, Header, Log, Repr};
use firmware::wire::ubx::{PVT_LEN, Pvt};
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
