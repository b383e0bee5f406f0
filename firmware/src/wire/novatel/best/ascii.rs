//! The same logs in text: BESTPOSA, BESTVELA, HEADING2A, PSRPOSA and so on. BESTXYZA is longer than
//! what a framer holds.
//!
//! Source: docs.novatel.com, OEM7 (page "ASCII"); `novatel_edie` 2.10.11 made the golden logs.
//!
//! ```text
//! # | name | , port , sequence , idle , time status , week , second , ... | ; | field , ... | *
//!   | CRC-32 of all between # and *, 8 hexadecimal digits
//! BESTPOSA status, type, latitude, longitude, height above the sea, geoid, datum, three sigmas
//! BESTVELA status, type, latency, age, speed, track, upwards
//! HEADING2A status, type, length, heading, pitch, reserved, heading's sigma
//! ```
//!
//! A log ends with its CRC; the end of its line belongs to no message.

use super::{HeadingFields, Log, PositionFields, VelocityFields};
use crate::wire::Scan;
use crate::wire::checksum::crc32_novatel;
use crate::wire::field::head as first;
use crate::wire::framer::LONGEST;
use crate::wire::nmea::number::{Fields, time_of_week};
use crate::wire::receiver::epoch::{Head, Time, Values};

/// Digits of the CRC.
const DIGITS: usize = 8;

/// Types of a position or velocity from satellites alone, as in the binary form.
const MEASURED: [&[u8]; 20] = [
    b"DOPPLER_VELOCITY",
    b"SINGLE",
    b"PSRDIFF",
    b"WAAS",
    b"OMNISTAR",
    b"L1_FLOAT",
    b"IONOFREE_FLOAT",
    b"NARROW_FLOAT",
    b"L1_INT",
    b"WIDE_INT",
    b"NARROW_INT",
    b"OMNISTAR_HP",
    b"OMNISTAR_XP",
    b"CDGPS",
    b"PPP_CONVERGING",
    b"PPP",
    b"OPERATIONAL",
    b"WARNING",
    b"PPP_BASIC_CONVERGING",
    b"PPP_BASIC",
];

/// Scans for a log in text at the beginning of `bytes`.
#[inline(never)]
pub(super) fn scan(bytes: &[u8]) -> Scan {
    let mut star = None;
    for (at, &byte) in bytes.iter().enumerate().take(LONGEST - DIGITS) {
        match byte {
            b'#' if at == 0 => {}
            b'*' if at > 1 => {
                star = Some(at);
                break;
            }
            b'A'..=b'Z' => {}
            b' '..=b'~' if at > 1 && byte != b'#' => {}
            _ => return Scan::Garbage,
        }
    }
    let Some(star) = star else {
        return match bytes.len() {
            len if len < LONGEST - DIGITS => Scan::Partial(len + 1),
            _ => Scan::Garbage,
        };
    };
    let len = star + 1 + DIGITS;
    let Some(digits) = bytes.get(star + 1..len) else {
        return Scan::Partial(len);
    };
    let hex = |sum: Option<u32>, digit: &u8| Some(sum? << 4 | char::from(*digit).to_digit(16)?);
    let stated = digits.iter().fold(Some(0), hex);
    if stated != Some(crc32_novatel(bytes.get(1..star).unwrap_or_default())) {
        return Scan::BadChecksum;
    }
    match log(bytes) {
        Some(_) => Scan::Frame(len),
        None => Scan::Other(len),
    }
}

fn log(frame: &[u8]) -> Option<Log> {
    let name = Fields(frame.get(1..)?).get(0);
    Some(match name {
        b"BESTPOSA" | b"BESTGNSSPOSA" => Log::Position,
        b"BESTVELA" | b"BESTGNSSVELA" => Log::Velocity,
        b"HEADING2A" => Log::Heading,
        b"PSRPOSA" | b"RTKPOSA" | b"PPPPOSA" => Log::OtherPosition,
        b"PSRVELA" | b"RTKVELA" => Log::OtherVelocity,
        _ => return None,
    })
}

/// As [`super::head`].
pub(super) fn head(frame: &[u8]) -> Option<Head> {
    let log = log(frame)?;
    let fields = Fields(frame);
    let known = !matches!(fields.get(4), b"UNKNOWN" | b"");
    let time = time_of_week(fields.get(6)).filter(|_| known)?;
    Some(Head {
        kind: log as u8,
        time: Time::Week(time),
    })
}

/// As [`super::read`].
#[inline(never)]
pub(super) fn read(frame: &[u8], values: &mut Values) {
    let ends = [b';', b'*'].map(|end| frame.iter().position(|byte| *byte == end));
    let [Some(body), Some(star)] = ends else {
        return;
    };
    let fields = Fields(first(frame, star).get(body + 1..).unwrap_or_default());
    let Some(log) = log(frame).filter(|log| !log.comes_too_late(values)) else {
        return;
    };
    if fields.get(0) != b"SOL_COMPUTED" || !MEASURED.contains(&fields.get(1)) {
        return;
    }
    let double = |n| fields.number(n).map_or(f64::NAN, |number| number.value());
    let single = |n| double(n) as f32;
    match log {
        Log::Position | Log::OtherPosition => PositionFields {
            degrees: [2, 3].map(double),
            heights: [4, 5].map(double),
            sigmas: [7, 8, 9].map(single),
        }
        .write(values),
        Log::Velocity | Log::OtherVelocity => VelocityFields {
            latency: single(2),
            speed: single(4),
            track: single(5),
            up: single(6),
        }
        .write(values),
        Log::Heading => HeadingFields {
            angle: single(3),
            sigma: single(6),
        }
        .write(values),
        Log::Cartesian => {}
    }
}
