//! Cut-through in the board's own image in QEMU: bytes leave while the frame is still arriving,
//! they equal those without cut-through, and a third-party decoder reads them. QEMU has neither DMA
//! nor bit rates, so instructions are counted from a byte's interrupt on.

use std::io::{Read, Write};

use firmware::control::Mode;
use firmware::wire::ImuFormat;
use qemu::drive::{Record, drive};
use qemu::images::{BOARDS, Board};
use qemu::judges::{ask, python};
use qemu::live::Live;
use qemu::protocol::{cut_through, expected, health, obey, set_up_configured};
use qemu::replay::Input;

/// Bytes that cut-through holds back.
const HOLD: usize = 2;
/// By format: most instructions of an interrupt in which a byte arrives and one leaves. At two
/// cycles each and 168 MHz 430 take 5.1 us, half of a byte at 921 600 bit/s.
const MOST: [(ImuFormat, usize); 3] = [
    (ImuFormat::Stim300, 430),
    (ImuFormat::Kvh, 430),
    (ImuFormat::Novatel, 430),
];
/// Frames before the first one that is cut.
const BEGIN: usize = 3;

/// A running board that cuts this format; frames, one of them damaged if `damaged` is given; and
/// the output for each frame without cut-through.
fn begun(
    board: Board,
    format: ImuFormat,
    damaged: Option<usize>,
) -> Option<(Live, Vec<Record>, Vec<Vec<u8>>)> {
    let image = board.image.build_or_skip()?;
    let mut live = Live::start(board, &image).expect("it starts");
    let packets = set_up_configured(&cut_through(format), Mode::Frozen).expect("packets");
    obey(&mut live, &packets).expect("it obeys");
    let records = drive(format, 2).expect("a drive");
    let frames = records.into_iter().filter(|r| r.input == Input::Sensor);
    let mut frames: Vec<_> = frames.take(300).collect();
    if let Some(damaged) = damaged {
        frames[damaged].bytes[30] ^= 1;
    }
    let sent = expected(packets, &frames);
    let mut at = 0;
    let each = frames.iter().map(|frame| {
        at += frame.bytes.len();
        sent[at - frame.bytes.len()..at].to_vec()
    });
    let sent = each.collect();
    Some((live, frames, sent))
}

/// Sends bytes on the sensor line, and reads `expected` bytes from the navigation line.
fn pass(live: &mut Live, bytes: &[u8], expected: usize) -> Vec<u8> {
    live.sensor.write_all(bytes).expect("the line holds");
    let mut came = vec![0; expected];
    live.navigation.read_exact(&mut came).expect("they leave");
    came
}

/// Waits until the loop has finished its work for a frame; only then does it answer a request. Its
/// decision applies to the next frame.
fn settle(live: &mut Live) {
    health(&mut live.command).expect("it answers");
}

/// The kind of a message: its first byte and its length.
fn kind(frame: &Record) -> (u8, usize) {
    (frame.bytes[0], frame.bytes.len())
}

/// A part of each frame is sent, and all but the bytes held back leaves before the rest is sent. A
/// message that is not a frame, such as the STIM300's configuration, passes as a whole, and so does
/// the frame after it; then cutting starts again.
fn leaves_early(board: Board, format: ImuFormat) {
    let Some((mut live, frames, sent)) = begun(board, format, None) else {
        return;
    };
    let (mut changed, mut parted, mut whole) = (0, 0, BEGIN);
    for (n, (frame, sent)) in frames.iter().zip(&sent).enumerate() {
        let len = frame.bytes.len();
        if kind(frame) != kind(&frames[BEGIN]) {
            whole = whole.max(n + 2);
        }
        let part = if n < whole { len } else { 4 + n % (len - 4) };
        parted += usize::from(part < len);
        let early = if part == len { len } else { part - HOLD };
        let mut came = pass(&mut live, &frame.bytes[..part], early);
        came.extend(pass(&mut live, &frame.bytes[part..], len - early));
        assert!(&came == sent, "{} {format:?}, frame {n}", board.name);
        changed += usize::from(*sent != frame.bytes);
        settle(&mut live);
    }
    assert!(changed > frames.len() / 2, "{changed} frames corrected");
    assert!(parted > frames.len() / 2, "{parted} frames in two parts");
}

#[test]
fn bytes_leave_while_the_frame_arrives_on_the_board() {
    for board in BOARDS {
        for (format, _) in MOST {
            leaves_early(board, format);
        }
    }
}

/// Number of instructions of each interrupt of USART1, the sensor line of the STM32F405, from
/// QEMU's log of all instructions and exceptions.
fn of_the_sensors_interrupts(log: &str) -> Vec<usize> {
    let (mut all, mut count) = (Vec::new(), None);
    for line in log.lines() {
        if line.starts_with("Trace ") {
            count = count.map(|count: usize| count + 1);
        } else if line.contains("tailchaining") || line.contains("successful exception return") {
            all.extend(count.take());
        }
        if line.contains("taking pending") && line.ends_with("exception 53") {
            count = Some(0);
        }
    }
    all
}

#[test]
fn few_instructions_are_between_a_bytes_interrupt_and_the_byte_that_leaves() {
    let directory = tempfile::tempdir().expect("a folder");
    for (format, limit) in MOST {
        let Some((mut live, frames, sent)) = begun(BOARDS[0], format, None) else {
            return;
        };
        let log = directory.path().join(format!("{format:?}"));
        let mut leave = Vec::new();
        for (n, (frame, sent)) in frames.iter().zip(&sent).take(BEGIN + 12).enumerate() {
            let (bytes, last) = (&frame.bytes, frame.bytes.len() - 1);
            if n < BEGIN {
                assert!(&pass(&mut live, bytes, last + 1) == sent);
                settle(&mut live);
                continue;
            }
            if n == BEGIN {
                for line in [
                    format!("logfile {}", log.display()),
                    "singlestep on".to_owned(),
                    "log exec,nochain,int".to_owned(),
                ] {
                    live.monitor(&line).expect("the monitor answers");
                }
            }
            let mut came = Vec::new();
            for (at, byte) in bytes.iter().enumerate() {
                let few = match at {
                    at if at == last => HOLD + 1,
                    at if at < HOLD => 0,
                    _ => 1,
                };
                came.extend(pass(&mut live, &[*byte], few));
                leave.push(few > 0);
            }
            assert!(&came == sent, "{format:?}, frame {n}");
            settle(&mut live);
        }
        live.monitor("log none").expect("the monitor answers");
        let log = std::fs::read_to_string(log).expect("a log");
        let counts = of_the_sensors_interrupts(&log);
        assert_eq!(counts.len(), leave.len(), "an interrupt a byte");
        let sends = counts.iter().zip(&leave).filter(|(_, leaves)| **leaves);
        let most = *sends.map(|(count, _)| count).max().expect("bytes leave");
        println!("{format:?}: {most} instructions at most to send a byte");
        assert!(most <= limit, "{format:?}: {most} instructions");
        assert!(most > 50, "{format:?}: {most} instructions cannot do it");
    }
}

/// `NovAtel`'s own decoder reads the same with and without cut-through, and does not read a damaged
/// frame, which leaves unchanged. No other decoder of these formats is available.
#[test]
fn novatels_decoder_reads_what_was_cut_and_refuses_damage() {
    let Some(python) = python() else { return };
    let damaged = 100;
    let begun = begun(BOARDS[0], ImuFormat::Novatel, Some(damaged));
    let Some((mut live, frames, sent)) = begun else {
        return;
    };
    let mut cut = Vec::new();
    for (n, frame) in frames.iter().enumerate() {
        let len = frame.bytes.len();
        // a part of each cut frame leaves early; after the damaged one the loop sends whole frames
        let is_cut = n >= BEGIN && n <= damaged;
        let part = if is_cut { len - 4 } else { len };
        let early = if is_cut { part - HOLD } else { len };
        cut.extend(pass(&mut live, &frame.bytes[..part], early));
        cut.extend(pass(&mut live, &frame.bytes[part..], len - early));
        settle(&mut live);
    }
    let decode = |bytes: &[u8]| ask(&python, "novatel.py", bytes).expect("it decodes");
    let decoded = decode(&cut);
    assert_eq!(decoded.len(), frames.len() - 1);
    assert_eq!(decoded, decode(&sent.concat()));
    let came: Vec<u8> = frames
        .iter()
        .flat_map(|frame| frame.bytes.clone())
        .collect();
    assert_ne!(decoded, decode(&came), "nothing was corrected");
}
