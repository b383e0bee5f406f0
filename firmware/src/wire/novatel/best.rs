//! BESTPOS, BESTVEL and HEADING2, and the logs of one solution alone (PSRPOS and its like), in
//! binary and in text; BESTXYZ in binary: what a `NovAtel` receiver knows of its position, velocity
//! and heading.
//!
//! Source: docs.novatel.com, OEM7 (pages of the logs, tables of solution status and position
//! type). `novatel_edie` 2.10.11 made the golden logs. After the long header of
//! [`super`], little-endian:
//!
//! ```text
//! BESTPOS 42, BESTGNSSPOS 1429, 72 bytes: status u32 | type u32 | latitude f64 @8 | longitude f64
//!   | height above the sea f64 @24 | geoid f32 @32 | datum u32 | sigmas f32 @40 @44 @48 | ...
//! BESTVEL 99, BESTGNSSVEL 1430, 44 bytes: status u32 | type u32 | latency f32 @8 | age f32
//!   | speed f64 @16 | track f64 @24 | upwards f64 @32 | reserved f32
//! PSRPOS 47, RTKPOS 141, PPPPOS 1538; PSRVEL 100, RTKVEL 216: the same
//! BESTXYZ 241, PSRXYZ 243, RTKXYZ 244, 112 bytes: status u32 | type u32 | x, y, z f64 @8
//!   | sigmas f32 @32 | status u32 @44 | type u32 @48 | velocity x, y, z f64 @52 | sigmas f32 @76
//!   | base | latency f32 @92 | ...
//! HEADING2 1335, 48 bytes: status u32 | type u32 | length f32 | heading f32 @12 | pitch f32
//!   | reserved f32 | heading's sigma f32 @24 | pitch's sigma f32 | ...
//! ```
//!
//! A position in which an inertial sensor has a share (types INS_...) is not taken: its errors are
//! not independent from fix to fix. BESTGNSSPOS and BESTGNSSVEL have none. What the others hold
//! counts where BESTPOS or BESTVEL give nothing.

mod ascii;

use super::{crc_is_right, states_its_length};
use crate::fix::{Heading, Position};
use crate::units::DEGREE;
use crate::wire::Scan;
use crate::wire::field::{Mark, mark, take};
use crate::wire::receiver::cartesian;
use crate::wire::receiver::epoch::{Head, Time, Values};

const HEADER: usize = 28;
/// Time status from which on the time is known to the receiver (20 is "unknown").
const TIME_KNOWN: u8 = 60;
/// Standard deviation of a component of the velocity, m/s (assumed: the OEM7 data sheet states 0.03
/// m/s for its RMS).
const VELOCITY_MPS: f32 = 0.05;
/// Change of the velocity in the latency of its time, m/s2 (assumed: a car that starts or brakes).
const CHANGE_MPS2: f32 = 1.0;
/// Least standard deviations of the position (m), the velocity (m/s) and the heading (rad).
const LEAST_M: f32 = 0.005;
const LEAST_MPS: f32 = 0.002;
const LEAST_RAD: f32 = 1e-3;

/// The logs that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Log {
    /// BESTPOS and BESTGNSSPOS.
    Position,
    /// BESTVEL and BESTGNSSVEL.
    Velocity,
    /// HEADING2.
    Heading,
    /// PSRPOS, RTKPOS, PPPPOS.
    OtherPosition,
    /// PSRVEL, RTKVEL.
    OtherVelocity,
    /// BESTXYZ, PSRXYZ, RTKXYZ.
    Cartesian,
}

/// The kinds that every receiver sends in the first epoch.
pub const USUAL: u16 = 1 << Log::Position as u8 | 1 << Log::Velocity as u8;

impl Log {
    fn of(id: u16) -> Option<Log> {
        match id {
            42 | 1429 => Some(Log::Position),
            99 | 1430 => Some(Log::Velocity),
            1335 => Some(Log::Heading),
            47 | 141 | 1538 => Some(Log::OtherPosition),
            100 | 216 => Some(Log::OtherVelocity),
            241 | 243 | 244 => Some(Log::Cartesian),
            _ => None,
        }
    }

    fn payload(self) -> usize {
        match self {
            Log::Position | Log::OtherPosition => 72,
            Log::Velocity | Log::OtherVelocity => 44,
            Log::Heading => 48,
            Log::Cartesian => 112,
        }
    }

    /// Whether BESTPOS or BESTVEL of the epoch has given what this log holds.
    fn comes_too_late(self, values: &Values) -> bool {
        match self {
            Log::OtherPosition => values.has(0),
            Log::OtherVelocity => values.has(3),
            _ => false,
        }
    }
}

/// Scans for a log at the beginning of `bytes`. Other logs with a right CRC pass.
#[inline(never)]
pub fn scan(bytes: &[u8]) -> Scan {
    if is_text(bytes) {
        return ascii::scan(bytes);
    }
    let short = mark(bytes, &[0xAA, 0x44, 0x13]);
    match (mark(bytes, &[0xAA, 0x44, 0x12]), short) {
        (Mark::No, Mark::No) => return Scan::Garbage,
        (Mark::Whole, _) | (_, Mark::Whole) => {}
        _ => return Scan::Partial(bytes.len() + 1),
    }
    let header = if short == Mark::Whole { 12 } else { HEADER };
    if bytes.len() < header {
        return Scan::Partial(header);
    }
    let (log, payload) = if short == Mark::Whole {
        let [len] = take(bytes, 3);
        (None, usize::from(len))
    } else {
        let id = u16::from_le_bytes(take(bytes, 4));
        let [kind] = take(bytes, 6);
        let binary = kind & 0xE0 == 0; // neither text nor an answer
        let log = Log::of(id).filter(|_| binary);
        (log, usize::from(u16::from_le_bytes(take(bytes, 8))))
    };
    let wrong = log.is_some_and(|log| log.payload() != payload);
    if wrong || !states_its_length(bytes, header) {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    }
    let len = header + payload + 4;
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !crc_is_right(frame) => Scan::BadChecksum,
        Some(_) if log.is_some() => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

fn is_text(bytes: &[u8]) -> bool {
    bytes.first() == Some(&b'#')
}

/// Kind and time of a log that a framer has checked; `None` if it is another one, or the receiver
/// does not know the time.
pub(in crate::wire) fn head(frame: &[u8]) -> Option<Head> {
    if is_text(frame) {
        return ascii::head(frame);
    }
    let log = Log::of(u16::from_le_bytes(take(frame, 4)))?;
    let [status] = take(frame, 13);
    (status >= TIME_KNOWN).then_some(Head {
        kind: log as u8,
        time: Time::Week(u32::from_le_bytes(take(frame, 16))),
    })
}

/// Writes the values of such a log.
#[inline(never)]
pub(in crate::wire) fn read(frame: &[u8], values: &mut Values) {
    if is_text(frame) {
        return ascii::read(frame, values);
    }
    let payload = frame.get(HEADER..).unwrap_or_default();
    let Some(log) = Log::of(u16::from_le_bytes(take(frame, 4))) else {
        return;
    };
    if log == Log::Cartesian {
        return earth_centred(payload, values);
    }
    if !is_computed(payload, 0) || log.comes_too_late(values) {
        return;
    }
    match log {
        Log::Position | Log::OtherPosition => PositionFields {
            degrees: [8, 16].map(|at| double(payload, at)),
            heights: [double(payload, 24), single(payload, 32).into()],
            sigmas: [40, 44, 48].map(|at| single(payload, at)),
        }
        .write(values),
        Log::Velocity | Log::OtherVelocity => VelocityFields {
            latency: single(payload, 8),
            speed: double(payload, 16) as f32,
            track: double(payload, 24) as f32,
            up: double(payload, 32) as f32,
        }
        .write(values),
        Log::Heading => HeadingFields {
            angle: single(payload, 12),
            sigma: single(payload, 24),
        }
        .write(values),
        Log::Cartesian => {}
    }
}

/// Position and velocity from the Earth's centre, each with a status of its own, where the epoch
/// has none.
#[inline(never)]
fn earth_centred(payload: &[u8], values: &mut Values) {
    let xyz = |at| [at, at + 8, at + 16].map(|at| double(payload, at));
    let Some(position) = cartesian::position(xyz(8)).filter(|_| is_computed(payload, 0)) else {
        return;
    };
    let stated = |at| {
        let sigmas = [at, at + 4, at + 8].map(|at| single(payload, at));
        let [x, y, z] = sigmas.map(|sigma| sigma * sigma);
        let known = sigmas.iter().all(|sigma| *sigma > 0.0);
        known.then(|| cartesian::variances(&position, [x, y, z, 0.0, 0.0, 0.0]))
    };
    if let Some(variances) = stated(32).filter(|_| !values.has(0)) {
        values.position = position;
        Values::set(&mut values.own, 0, [0.0; 3]);
        values.variances(0, variances, LEAST_M);
    }
    let velocity = cartesian::velocity(&position, xyz(52));
    let latency = single(payload, 92);
    let plausible = velocity.iter().all(|v| v.abs() < 1e4) && (0.0..1.0).contains(&latency);
    let moves = plausible && is_computed(payload, 44) && !values.has(3);
    if let Some(variances) = stated(76).filter(|_| moves) {
        values.velocity = velocity;
        Values::set(&mut values.own, 3, [latency * CHANGE_MPS2; 3]);
        values.variances(3, variances, LEAST_MPS);
    }
}

/// Whether status and type, at this place, are those of a solution from satellites.
fn is_computed(payload: &[u8], at: usize) -> bool {
    let [status, kind] = [at, at + 4].map(|at| u32::from_le_bytes(take(payload, at)));
    status == 0 && is_measured(kind)
}

/// Whether a position or velocity of this type comes from satellites alone: not none, fixed,
/// propagated, inertial, or out of bounds.
fn is_measured(kind: u32) -> bool {
    matches!(kind, 8 | 16..=18 | 20 | 32..=35 | 46..=50 | 64..=66 | 68..=71 | 75 | 77 | 78)
}

fn double(payload: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(take(payload, at))
}

fn single(payload: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(take(payload, at))
}

/// Fields of BESTPOS.
struct PositionFields {
    /// Latitude, longitude.
    degrees: [f64; 2],
    /// Above the sea, and the sea above the ellipsoid, m.
    heights: [f64; 2],
    /// North, east, up, m.
    sigmas: [f32; 3],
}

impl PositionFields {
    #[inline(never)]
    fn write(&self, values: &mut Values) {
        let [latitude, longitude] = self.degrees.map(|degrees| degrees * DEGREE);
        let [sea, geoid] = self.heights;
        let position = Position {
            latitude,
            longitude,
            height: sea + geoid,
        };
        let mut sigmas = self.sigmas.iter();
        if position.is_plausible() && sigmas.all(|sigma| *sigma > 0.0 && *sigma < 1e6) {
            values.position = position;
            Values::set(&mut values.own, 0, [0.0; 3]);
            let stated = self.sigmas.map(|sigma| sigma.max(LEAST_M));
            Values::set(&mut values.stated, 0, stated);
        }
    }
}

/// Fields of BESTVEL: s, m/s, degrees clockwise from north, m/s.
struct VelocityFields {
    latency: f32,
    speed: f32,
    track: f32,
    up: f32,
}

impl VelocityFields {
    /// The velocity is that of `latency` earlier than the time says. It is taken as of that time,
    /// and what it may have changed since is added to its standard deviation.
    #[inline(never)]
    fn write(&self, values: &mut Values) {
        let VelocityFields {
            latency,
            speed,
            track,
            up,
        } = *self;
        let plausible = (0.0..1e4).contains(&speed) && up.abs() < 1e4;
        if plausible && (0.0..=360.0).contains(&track) && (0.0..1.0).contains(&latency) {
            let own = latency * CHANGE_MPS2;
            values.over_ground(speed, track, up);
            Values::set(&mut values.own, 3, [own; 3]);
            Values::set(&mut values.assumed, 3, [VELOCITY_MPS; 3]);
        }
    }
}

/// Fields of HEADING2, degrees.
struct HeadingFields {
    angle: f32,
    sigma: f32,
}

impl HeadingFields {
    #[inline(never)]
    fn write(&self, values: &mut Values) {
        let HeadingFields { angle, sigma } = *self;
        let degree = DEGREE as f32;
        if (0.0..=360.0).contains(&angle) && sigma > 0.0 && sigma < 180.0 {
            values.heading = Some(Heading {
                angle: angle * degree,
                sigma: (sigma * degree).max(LEAST_RAD),
            });
        }
    }
}

#[cfg(test)]
pub(in crate::wire) mod tests;
