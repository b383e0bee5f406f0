//! NMEA 0183 sentences of satellite receivers: GGA, GNS, RMC, GLL, VTG, GST, HDT, THS, ZDA.
//!
//! Source: NMEA 0183 as gpsd's "NMEA Revealed", `pynmeagps` and the u-blox interface description
//! state it. `pynmeagps` 1.1.8 made the golden sentences.
//!
//! ```text
//! $ | talker, 2 letters | sentence, 3 letters | , field , field ... | * | checksum | CR LF
//! ```
//!
//! The checksum is the exclusive or of all bytes between `$` and `*`, two hexadecimal digits. It is
//! weak: two errors in the same bit of two bytes cancel. A field may be empty.
//!
//! Loggers and terminals change what is around a sentence. So a line may end in LF alone, CR alone
//! or CR CR LF, digits of the checksum may be in lower case, and whatever stands before the `$`
//! (a tag block, a logger's time stamp) is skipped. Behind the checksum a quote, blank, comma,
//! semicolon or tab ends the sentence, as in the cells of a table, if it has all its fields: one
//! wrong bit turns a decimal point into a star, and two decimals may be the right checksum. **A
//! line without a checksum** is [`Scan::Other`]: [`super::Receiver`] reads it on a line that is
//! configured as NMEA and never had a checksum.
//!
//! It is written here because the crate `nmea` (0.8.0) costs 64 kB of flash for six sentences,
//! most of it the reading of dates and of floating-point numbers, and brings code that can panic.
//! Here a number is whole digits and a power of ten.
//!
//! NMEA states no accuracy of the velocity, none of the heading, and that of the position only in
//! GST. What is assumed instead is in this file, with its reason.

pub(super) mod number;

use super::Scan;
use super::field::{head as first, take};
use super::receiver::epoch::{Head, OPTIONAL, Time, Values};
use crate::fix::{Heading, NOT_MEASURED, Position};
use crate::units::DEGREE;
use core::f32::consts::FRAC_1_SQRT_2;
use number::{Fields, Number};

/// Bytes of the longest sentence that is read. The standard allows 82; receivers with more digits
/// or a longer GNS use more.
pub const LONGEST: usize = 128;
/// Bytes from the star on, where the line ends in LF alone.
const END: usize = 4;

/// Standard deviation of the horizontal distance at HDOP 1, m, by the quality of the fix: half of
/// gpsd's 95 % values for a plain and a differential fix; assumed for a carrier-phase fix.
const PLAIN_M: f32 = 7.5;
const DIFFERENTIAL_M: f32 = 1.9;
const FLOAT_M: f32 = 0.5;
const FIXED_M: f32 = 0.05;
/// Dilution of precision where none is stated, as with RMC and GLL, or in an empty field (assumed:
/// some satellites are hidden).
const UNSTATED_HDOP: f32 = 2.0;
/// Standard deviation of the height over that of the horizontal distance (assumed: satellites are
/// above only).
const HEIGHT: f32 = 2.0;
/// Standard deviation of a component of the velocity, m/s (assumed: twice what u-blox data sheets
/// state for a car in the open).
const VELOCITY_MPS: f32 = 0.1;
/// Standard deviation of a two-antenna heading, rad (assumed: 1 degree, antennas 0.2 m apart; more
/// distance is better).
const HEADING: f32 = DEGREE as f32;
/// Least standard deviation of a position, m: what GST rounds to at best.
const LEAST_M: f32 = 0.005;
/// m/s.
const KNOT: f32 = 1852.0 / 3600.0;
const KMH: f32 = 1.0 / 3.6;
/// Metres in a minute of latitude.
const MINUTE_M: f32 = 1852.0;
/// Standard deviation of a value that was rounded to one: 1 / sqrt(12).
const ROUNDED: f32 = 0.288_675_13;

/// The sentences that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sentence {
    /// Position, quality, HDOP, height.
    Gga,
    /// [`Self::Gga`] with a mode for each constellation.
    Gns,
    /// Horizontal position, velocity, date.
    Rmc,
    /// Velocity.
    Vtg,
    /// Standard deviations of the position.
    Gst,
    /// True heading.
    Hdt,
    /// True heading with its mode.
    Ths,
    /// Date.
    Zda,
    /// Horizontal position. No epoch waits for it: it says no more than the others, and often comes
    /// last.
    Gll = OPTIONAL as isize,
}

/// The kinds that every receiver sends in the first epoch: GGA and RMC.
pub const USUAL: u16 = 1 << Sentence::Gga as u8 | 1 << Sentence::Rmc as u8;

impl Sentence {
    /// The sentence by its address: a talker of satellite receivers, and the sentence.
    fn of(address: [u8; 5]) -> Option<Sentence> {
        let [a, b, rest @ ..] = address;
        if !matches!(
            &[a, b],
            b"GP" | b"GN" | b"GL" | b"GA" | b"GB" | b"BD" | b"GQ" | b"QZ" | b"GI"
        ) {
            return None;
        }
        Some(match &rest {
            b"GGA" => Sentence::Gga,
            b"GNS" => Sentence::Gns,
            b"RMC" => Sentence::Rmc,
            b"VTG" => Sentence::Vtg,
            b"GST" => Sentence::Gst,
            b"HDT" => Sentence::Hdt,
            b"THS" => Sentence::Ths,
            b"ZDA" => Sentence::Zda,
            b"GLL" => Sentence::Gll,
            _ => return None,
        })
    }

    /// Commas of the oldest form of the sentence that is in use.
    const fn commas(self) -> usize {
        match self {
            Sentence::Gga => 14,
            Sentence::Gns => 12,
            Sentence::Rmc => 11,
            Sentence::Vtg | Sentence::Gst => 8,
            Sentence::Gll | Sentence::Zda => 6,
            Sentence::Hdt | Sentence::Ths => 2,
        }
    }
}

/// Scans for a sentence at the beginning of `bytes`.
#[inline(never)]
pub fn scan(bytes: &[u8]) -> Scan {
    match bytes.split_first() {
        Some((b'$', _)) => {}
        Some(_) => return Scan::Garbage,
        None => return Scan::Partial(1),
    }
    let body = bytes.iter().skip(1).take(LONGEST - 5);
    let (mut sum, mut star) = (0, None);
    for (at, &byte) in (1..).zip(body) {
        match byte {
            b'*' => {
                star = Some(at);
                break;
            }
            b'A'..=b'Z' => {}
            b' '..=b'~' if at > 1 && byte != b'$' && byte != b'!' => {}
            b'\r' | b'\n' if is_read(first(bytes, at)) => return Scan::Other(at),
            _ => return Scan::Garbage,
        }
        sum ^= byte;
    }
    let Some(star) = star else {
        let so_far = bytes.len();
        if so_far > LONGEST - 5 {
            return Scan::Garbage;
        }
        return Scan::Partial(so_far + 1); // any byte may show that this is none
    };
    let end = bytes.get(star + 1..).unwrap_or_default();
    let (digits, len) = match *end {
        [a, b, b'\r', b'\n', ..] => ([a, b], star + 5),
        [_, _, b'\r'] => return Scan::Partial(star + 5),
        [a, b, b'\r' | b'\n', ..] => ([a, b], star + END),
        [a, b, b'"' | b'\'' | b',' | b';' | b'\t' | b' ', ..] if is_whole(first(bytes, star)) => {
            ([a, b], star + END - 1)
        }
        [_, _, _, ..] => return Scan::BadChecksum,
        _ => return Scan::Partial(star + END),
    };
    let hex = |digit: u8| char::from(digit).to_digit(16);
    let [high, low] = digits.map(hex);
    let stated = high.zip(low).map(|(high, low)| high << 4 | low);
    if stated != Some(u32::from(sum)) {
        return Scan::BadChecksum;
    }
    #[cfg(test)]
    super::checksum::count::one(len);
    if is_read(first(bytes, star)) {
        Scan::Frame(len)
    } else {
        Scan::Other(len)
    }
}

/// Whether this is one of the sentences that are read, up to its checksum.
fn is_read(text: &[u8]) -> bool {
    text.get(6).is_none_or(|byte| *byte == b',') && Sentence::of(take(text, 1)).is_some()
}

/// Whether a sentence has all its fields, as far as it is one that is read.
fn is_whole(text: &[u8]) -> bool {
    let commas = text.iter().filter(|byte| **byte == b',').count();
    Sentence::of(take(text, 1)).is_none_or(|sentence| commas >= sentence.commas())
}

/// Whether the checksum is missing in a sentence that the scan gave.
pub(super) fn lacks_checksum(sentence: &[u8]) -> bool {
    !sentence.contains(&b'*')
}

/// Whether a silence of the line completes its last bytes to a sentence: all has come of it but a
/// line feed behind a CR that stands alone.
pub(super) fn is_ended_by_silence(unread: &[u8]) -> bool {
    let mut line = [b'\n'; LONGEST + AFTER.len()];
    for (place, byte) in line.iter_mut().zip(unread) {
        *place = *byte;
    }
    match scan(first(&line, unread.len() + AFTER.len())) {
        Scan::Frame(_) => true,
        Scan::Other(len) => len < unread.len(),
        _ => false,
    }
}

/// What a silence of the line puts behind such bytes.
pub(super) const AFTER: [u8; END] = [b'\n'; END];

/// Kind and time of a sentence that a framer has checked; `None` if it is another one, a date
/// alone, or its time cannot be read.
pub(super) fn head(frame: &[u8]) -> Option<Head> {
    let sentence = Sentence::of(take(frame, 1))?;
    let time = match sentence {
        Sentence::Vtg | Sentence::Hdt | Sentence::Ths => Time::Same,
        Sentence::Gll => Time::Day(number::time_of_day(fields(frame).get(4))?),
        Sentence::Zda => return None,
        _ => Time::Day(number::time_of_day(fields(frame).get(0))?),
    };
    Some(Head {
        kind: sentence as u8,
        time,
    })
}

/// Day of the week, 0 for Sunday, and ms of the day, of a ZDA. It belongs to no epoch: some
/// receivers send that of the next second.
pub(super) fn date(frame: &[u8]) -> Option<(u8, u32)> {
    if Sentence::of(take(frame, 1)) != Some(Sentence::Zda) {
        return None;
    }
    let fields = fields(frame);
    let day = number::day_of_parts([1, 2, 3].map(|n| fields.get(n)))?;
    Some((day, number::time_of_day(fields.get(0))?))
}

/// The fields behind the address.
fn fields(sentence: &[u8]) -> Fields<'_> {
    let star = sentence.iter().position(|byte| *byte == b'*');
    let text = first(sentence, star.unwrap_or(sentence.len()));
    Fields(text.get(7..).unwrap_or_default())
}

/// Writes the values of such a sentence.
#[inline(never)]
pub(super) fn read(frame: &[u8], values: &mut Values) {
    let fields = fields(frame);
    match Sentence::of(take(frame, 1)) {
        Some(Sentence::Gga) => gga(fields, values),
        Some(Sentence::Gns) => gns(fields, values),
        Some(Sentence::Rmc) => rmc(fields, values),
        Some(Sentence::Gll) => gll(fields, values),
        Some(Sentence::Vtg) => vtg(fields, values),
        Some(Sentence::Gst) => gst(fields, values),
        Some(Sentence::Hdt) => heading(fields, values),
        Some(Sentence::Ths) if fields.get(1) == b"A" => heading(fields, values),
        Some(Sentence::Ths | Sentence::Zda) | None => {}
    }
}

/// time, latitude, N, longitude, E, quality, satellites, HDOP, height, M, geoid, M, age, station
#[inline(never)]
fn gga(f: Fields, values: &mut Values) {
    values.decide_position();
    let range = match f.get(5) {
        b"1" | b"3" => PLAIN_M,        // 3: precise positioning service
        b"2" | b"9" => DIFFERENTIAL_M, // 9: SBAS, by receivers of NovAtel
        b"4" => FIXED_M,
        b"5" => FLOAT_M,
        b"0" | b"6" | b"7" | b"8" => {
            values.refused = true; // none, estimated, by hand, simulated: a VTG may not say so
            return;
        }
        _ => return,
    };
    position(f, 1, Some([8, 10]), values);
    dilution(range, f, values);
}

/// time, latitude, N, longitude, E, modes, satellites, HDOP, height, geoid, ...
///
/// Each constellation has a mode. The least accurate one of those in use counts.
#[inline(never)]
fn gns(f: Fields, values: &mut Values) {
    values.decide_position();
    let mut worst = None;
    for mode in f.get(5) {
        let range = match mode {
            b'N' => continue,
            b'A' | b'P' => PLAIN_M,
            b'D' => DIFFERENTIAL_M,
            b'R' => FIXED_M,
            b'F' => FLOAT_M,
            _ => return, // estimated, by hand, simulated
        };
        worst = Some(range.max(worst.unwrap_or(0.0)));
    }
    let Some(range) = worst else { return };
    position(f, 1, Some([8, 9]), values);
    dilution(range, f, values);
}

/// Position from field `at` on. Height above the ellipsoid is that above the sea plus the geoid's.
/// Without either it is not measured.
#[inline(never)]
fn position(f: Fields, at: usize, heights: Option<[usize; 2]>, values: &mut Values) {
    let latitude = number::angle(f.get(at), f.get(at + 1), [b'N', b'S'], 90);
    let longitude = number::angle(f.get(at + 2), f.get(at + 3), [b'E', b'W'], 180);
    let (Some((latitude, lat_digit)), Some((longitude, lon_digit))) = (latitude, longitude) else {
        return;
    };
    let heights = heights.map(|of| of.map(|n| f.number(n)));
    let (height, height_own) = match heights {
        Some([Some(sea), Some(geoid)]) => {
            let digits = root_of_squares(sea.digit(), geoid.digit());
            (sea.value() + geoid.value(), digits * ROUNDED)
        }
        _ => (0.0, NOT_MEASURED),
    };
    let own = [lat_digit, lon_digit].map(|minute| minute * MINUTE_M * ROUNDED);
    let position = Position {
        latitude,
        longitude,
        height,
    };
    values.position = position;
    let [north, east] = own;
    Values::set(&mut values.own, 0, [north, east, height_own]);
}

/// Standard deviations from the quality of the fix and HDOP, until GST states them.
#[inline(never)]
fn dilution(range: f32, f: Fields, values: &mut Values) {
    let hdop = match f.get(7) {
        b"" => UNSTATED_HDOP,
        text => Number::of(text).map_or(0.0, |hdop| hdop.value() as f32),
    };
    if (0.1..50.0).contains(&hdop) {
        let distance = range * hdop;
        let axis = distance * FRAC_1_SQRT_2;
        Values::set(&mut values.assumed, 0, [axis, axis, HEIGHT * distance]);
    }
}

/// time, status, latitude, N, longitude, E, speed, course, date, declination, E, mode, ...
#[inline(never)]
fn rmc(f: Fields, values: &mut Values) {
    values.day = number::day_of_week(f.get(8));
    values.refused |= f.get(1) == b"V"; // a VTG may not say so
    if f.get(1) == b"A" && is_measured(f.get(11)) {
        velocity(f.get(6), f.get(7), KNOT, values);
        place(f, 2, f.get(11), values);
    }
}

/// latitude, N, longitude, E, time, status, mode
#[inline(never)]
fn gll(f: Fields, values: &mut Values) {
    if f.get(5) == b"A" && is_measured(f.get(6)) {
        place(f, 0, f.get(6), values);
    }
}

/// A position without height and dilution, where no GGA or GNS of the epoch has another one or says
/// that there is none.
#[inline(never)]
fn place(f: Fields, at: usize, mode: &[u8], values: &mut Values) {
    if values.position_is_decided {
        return;
    }
    position(f, at, None, values);
    let range = match mode {
        b"D" => DIFFERENTIAL_M,
        b"R" => FIXED_M,
        b"F" => FLOAT_M,
        _ => PLAIN_M,
    };
    let axis = range * UNSTATED_HDOP * FRAC_1_SQRT_2;
    Values::set(&mut values.assumed, 0, [axis, axis, NOT_MEASURED]);
}

/// course, T, magnetic course, M, speed, N, speed, K, mode
#[inline(never)]
fn vtg(f: Fields, values: &mut Values) {
    if is_measured(f.get(8)) {
        velocity(f.get(6), f.get(0), KMH, values);
    }
}

/// Mode: autonomous, differential, float, precise, real-time kinematic; empty before version 2.3.
fn is_measured(mode: &[u8]) -> bool {
    matches!(mode, b"" | b"A" | b"D" | b"F" | b"P" | b"R")
}

/// sqrt(a^2 + b^2)
fn root_of_squares(a: f32, b: f32) -> f32 {
    libm::sqrtf(a * a + b * b)
}

/// A receiver that stands gives no course. Then each component may be as large as the speed.
#[inline(never)]
fn velocity(speed: &[u8], course: &[u8], unit: f32, values: &mut Values) {
    let Some(speed) = Number::of(speed) else {
        return;
    };
    let mps = speed.value() as f32 * unit;
    if !(0.0..1e4).contains(&mps) {
        return;
    }
    let mut own = speed.digit() * unit * ROUNDED;
    match Number::of(course) {
        Some(course) => {
            let turned = course.digit() * DEGREE as f32 * mps * ROUNDED;
            let course = course.value() as f32;
            if !(0.0..=360.0).contains(&course) {
                return;
            }
            own = root_of_squares(own, turned);
            values.over_ground(mps, course, 0.0);
        }
        None => {
            own = root_of_squares(own, mps * FRAC_1_SQRT_2);
            values.velocity = [0.0; 3];
        }
    }
    Values::set(&mut values.own, 3, [own, own, NOT_MEASURED]);
    let assumed = [VELOCITY_MPS, VELOCITY_MPS, NOT_MEASURED];
    Values::set(&mut values.assumed, 3, assumed);
}

/// time, range, major, minor, orientation, latitude, longitude, height; all m
#[inline(never)]
fn gst(f: Fields, values: &mut Values) {
    for (sigma, n) in values.stated.iter_mut().zip(5..8) {
        let stated = f.number(n).map_or(0.0, |number| number.value() as f32);
        if stated > 0.0 {
            *sigma = stated.max(LEAST_M);
        }
    }
}

/// Heading of two antennas. One degree of the field is one degree here, from true north.
#[inline(never)]
fn heading(f: Fields, values: &mut Values) {
    let degrees = f.number(0).map(|number| number.value());
    if let Some(degrees) = degrees.filter(|degrees| (0.0..=360.0).contains(degrees)) {
        values.heading = Some(Heading {
            angle: (degrees * DEGREE) as f32,
            sigma: HEADING,
        });
    }
}

#[cfg(test)]
pub(super) mod tests;
