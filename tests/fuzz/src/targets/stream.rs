//! Any bytes, in any format, cut anywhere: every byte comes out once and in order, and only checked
//! frames are reported. A frame changed to its own sample is the same frame, and one changed to
//! another sample is still a frame. A frame that cannot be changed stays as it is.

use firmware::sample::{Axes, RawSample};
use firmware::wire::framer::{Event, Framer, LONGEST};
use firmware::wire::receiver::epoch::Arrival;
use firmware::wire::{
    Change, Checked, Detector, Error, Framing, ImuFormat, Receiver, ReceiverFormat, Scan, Settings,
};

/// Checks an event. Returns whether it is a frame.
fn check(format: ImuFormat, event: Event<'_, ImuFormat>, seen: &mut Vec<u8>) -> bool {
    seen.extend_from_slice(event.bytes());
    assert!(!event.bytes().is_empty());
    let before = event.bytes().to_vec();
    let len = before.len();
    let Some(mut frame) = event.frame() else {
        assert!(Checked::new(format, &mut before.clone()).is_err());
        return false;
    };
    assert_eq!(format.scan(&before), Scan::Frame(len));
    let reading = frame.read().expect("a good frame has values");
    let mut change = |sample, mark| {
        let change = Change {
            sample,
            mark,
            settings: &Settings::DEFAULT,
        };
        let saturated = frame.change(&change);
        (saturated, frame.bytes().to_vec())
    };
    let same = change(&reading.sample, false);
    if same == (Err(Error::Content), before.clone()) {
        // only a frame of unknown units may refuse, such as a signed MAVLink frame: it passes
        // unchanged
        let stream = frame.source().stream(&Settings::DEFAULT, frame.content());
        assert!(stream.is_none());
        return true;
    }
    assert_eq!(same, (Ok(Axes::NONE), before.clone()));
    let other = match reading.sample {
        RawSample::Counts { gyro, accel } => RawSample::Counts {
            gyro: gyro.map(|value| value.wrapping_mul(3)),
            accel: accel.map(|value| value.wrapping_add(i32::MAX)),
        },
        RawSample::Floats { gyro, accel } => RawSample::Floats {
            gyro: gyro.map(|value| value * 2.0),
            accel: accel.map(|value| value / 0.0),
        },
    };
    // the recomputed checksum equals the one that was changed by the difference
    let (saturated, changed) = change(&other, false);
    assert!(saturated.is_ok());
    assert_eq!(format.scan(&changed), Scan::Frame(len));
    let mut sealed = changed.clone();
    format.seal(&mut sealed);
    assert_eq!(sealed, changed);
    let (_, marked) = change(&other, true);
    assert_eq!(format.scan(&marked), Scan::Frame(len));
    true
}

/// Every byte comes out once, in order.
fn passes<F: Framing>(
    format: F,
    stream: &[u8],
    piece: usize,
    mut check: impl FnMut(Event<'_, F>, &mut Vec<u8>),
) {
    let mut framer = Framer::new(format);
    let mut seen = Vec::new();
    for bytes in stream.chunks(piece) {
        assert_eq!(framer.push(bytes), bytes.len());
        while let Some(event) = framer.next_event() {
            check(event, &mut seen);
        }
    }
    if let Some(event) = framer.flush() {
        seen.extend_from_slice(event.bytes());
    }
    assert_eq!(seen, stream);
}

/// A fix has finite values and positive standard deviations, whatever the bytes are.
fn fixes(format: ReceiverFormat, stream: &[u8], piece: usize) -> bool {
    let mut found = false;
    for configured in [Some(format), None] {
        let mut receiver = Receiver::new(configured);
        let mut arrival = Arrival::default();
        for bytes in stream.chunks(piece) {
            receiver.push(bytes, arrival);
            while let Some(solution) = receiver.next_fix() {
                let Some(fix) = solution.fix else { continue };
                found = true;
                assert!(fix.velocity.iter().all(|v| v.is_finite()));
                assert!(fix.sigmas.iter().all(|sigma| *sigma > 0.0));
            }
            arrival.us += u64::from(bytes[0]) * 1000;
        }
    }
    found
}

/// Whether there was a good frame or a fix.
pub fn run(input: &[u8]) -> bool {
    let [which, piece, input @ ..] = input else {
        return false;
    };
    let piece = usize::from(*piece) % LONGEST + 1;
    let which_format =
        usize::from(*which & 0x7F) % (ImuFormat::ALL.len() + ReceiverFormat::ALL.len());
    let Some(format) = ImuFormat::ALL.get(which_format).copied() else {
        let which = which_format - ImuFormat::ALL.len();
        passes(ReceiverFormat::ALL[which], input, piece, |event, seen| {
            let _ = event.values();
            seen.extend_from_slice(event.bytes());
        });
        return fixes(ReceiverFormat::ALL[which], input, piece);
    };
    let stream = if which & 0x80 == 0 {
        input.to_vec()
    } else {
        crate::repaired(format, input)
    };
    let mut found = false;
    passes(format, &stream, piece, |event, seen| {
        found |= check(format, event, seen);
    });
    Detector::new().push(&stream, |_, _| {});
    found
}
