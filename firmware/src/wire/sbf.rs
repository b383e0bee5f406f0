//! Septentrio SBF blocks: PVTGeodetic, PosCovGeodetic, VelCovGeodetic, AttEuler, AttCovEuler, and
//! the Cartesian forms of the first three.
//!
//! Source: Septentrio's SBF reference guides as `pysbf2` and the ROS driver of Septentrio implement
//! them. `pysbf2` 1.0.7 read the golden blocks. Little-endian; a block is filled up to a multiple
//! of four bytes:
//!
//! ```text
//! $ @ | CRC u16 | id u16: number in bits 0 to 12, revision above | length u16, all of it
//!   | time of week u32, ms | week u16 | content @14
//! PVTGeodetic 4007  mode u8 @14 | error u8 | latitude f64 @16 | longitude f64, rad | height f64,
//!   above the ellipsoid | geoid f32 @40 | north, east, up f32 @44 | ... | from revision 2 on:
//!   latency u16 @88 | horizontal u16 @90 and vertical accuracy u16 @92, 0.01 m
//! PVTCartesian 4006 the same with x, y, z f64 @16, m, and f32 @44, m/s, from the Earth's centre
//! PosCovGeodetic 5906, VelCovGeodetic 5908  mode u8 @14 | error u8 | variances f32 @16 @20 @24
//! PosCovCartesian 5905, VelCovCartesian 5907  the same | xx yy zz tt xy xz xt yz yt zt f32 @16
//! AttEuler 5938     satellites u8 @14 | error u8 | mode u16 | information u16 | heading f32 @20
//! AttCovEuler 5939  reserved u8 @14 | error u8 | variance of the heading f32 @16, degree^2
//! CRC-16/XMODEM from the id on
//! ```
//!
//! A value that is not known has a number of its own: -2e10 in floating point, all ones else.

use super::Scan;
use super::checksum::xmodem;
use super::field::{Mark, mark, take};
use super::receiver::cartesian;
use super::receiver::epoch::{Head, Time, Values};
use crate::fix::{Heading, NOT_MEASURED, Position};
use crate::units::DEGREE;
use core::f32::consts::FRAC_1_SQRT_2;

/// Header with time and week.
const HEADER: usize = 14;
/// Bytes of the shortest block: header without time.
const SHORTEST: usize = 8;
/// Bytes of a PVTGeodetic that has accuracies.
const WITH_ACCURACY: usize = 94;
/// Standard deviation of a component of the velocity, m/s, without VelCovGeodetic (assumed: twice
/// what data sheets of such receivers state).
const VELOCITY_MPS: f32 = 0.05;
/// Standard deviation of a heading without AttCovEuler, rad (assumed: half a degree).
const HEADING: f32 = 0.5 * DEGREE as f32;
/// Least standard deviations of position (m), velocity (m/s) and heading (rad).
const LEAST_M: f32 = 0.005;
const LEAST_MPS: f32 = 0.002;
const LEAST_RAD: f32 = 1e-3;

/// The blocks that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// 4007
    Pvt,
    /// 5906
    PositionCovariance,
    /// 5908
    VelocityCovariance,
    /// 5938
    Attitude,
    /// 5939
    AttitudeCovariance,
    /// 4006
    Cartesian,
    /// 5905
    CartesianCovariance,
    /// 5907
    CartesianVelocityCovariance,
}

/// The kinds that every receiver sends in the first epoch.
pub const USUAL: u16 = 1 << Block::Pvt as u8;

impl Block {
    /// The block by its number, without its revision; and the least length of such a block.
    #[inline(never)]
    fn of(id: u16) -> Option<(Block, usize)> {
        match id & 0x1FFF {
            4007 => Some((Block::Pvt, 85)),
            5906 => Some((Block::PositionCovariance, 56)),
            5908 => Some((Block::VelocityCovariance, 56)),
            5938 => Some((Block::Attitude, 44)),
            5939 => Some((Block::AttitudeCovariance, 40)),
            4006 => Some((Block::Cartesian, 85)),
            5905 => Some((Block::CartesianCovariance, 56)),
            5907 => Some((Block::CartesianVelocityCovariance, 56)),
            _ => None,
        }
    }
}

/// Scans for a block at the beginning of `bytes`. Others with a right CRC pass.
#[inline(never)]
pub fn scan(bytes: &[u8]) -> Scan {
    match mark(bytes, b"$@") {
        Mark::No => return Scan::Garbage,
        Mark::Whole if bytes.len() >= SHORTEST => {}
        Mark::Whole => return Scan::Partial(SHORTEST),
        Mark::Part => return Scan::Partial(2),
    }
    let len = usize::from(u16::from_le_bytes(take(bytes, 6)));
    let block = Block::of(u16::from_le_bytes(take(bytes, 4)));
    let least = block.map_or(SHORTEST, |(_, least)| least);
    let too_long = block.is_some() && len > super::framer::LONGEST;
    if len % 4 != 0 || len < least || too_long {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    }
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !crc_is_right(frame) => Scan::BadChecksum,
        Some(_) if block.is_some() => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

fn crc_is_right(frame: &[u8]) -> bool {
    xmodem(frame.get(4..).unwrap_or_default()) == u16::from_le_bytes(take(frame, 2))
}

/// Kind and time of a block that a framer has checked; `None` if it is another one, or has no time.
pub(super) fn head(frame: &[u8]) -> Option<Head> {
    let (block, _) = Block::of(u16::from_le_bytes(take(frame, 4)))?;
    let ms = u32::from_le_bytes(take(frame, 8));
    (ms != u32::MAX).then_some(Head {
        kind: block as u8,
        time: Time::Week(ms),
    })
}

/// Writes the values of such a block.
#[inline(never)]
pub(super) fn read(frame: &[u8], values: &mut Values) {
    let block = Block::of(u16::from_le_bytes(take(frame, 4)));
    let [mode, error] = take(frame, HEADER);
    let good = error == 0 && is_measured(mode);
    let variances = || [16, 20, 24].map(|at| single(frame, at));
    match block.map(|(block, _)| block) {
        Some(Block::Pvt | Block::Cartesian) if !good => values.refused = true,
        Some(Block::Pvt) => pvt(frame, values),
        Some(Block::Cartesian) => pvt_cartesian(frame, values),
        Some(Block::PositionCovariance) if good => values.variances(0, variances(), LEAST_M),
        Some(Block::VelocityCovariance) if good => values.variances(3, variances(), LEAST_MPS),
        Some(Block::CartesianCovariance) if good => turned(frame, 0, LEAST_M, values),
        Some(Block::CartesianVelocityCovariance) if good => turned(frame, 3, LEAST_MPS, values),
        // error bits 0 and 1 are of the first baseline, bit 7 of all
        Some(Block::Attitude) if error & 0x83 == 0 => attitude(frame, values),
        Some(Block::AttitudeCovariance) if error & 0x83 == 0 => {
            attitude_covariance(frame, values);
        }
        _ => {}
    }
}

/// Three dimensions, from satellites: not none, fixed by hand, or with a height from before.
fn is_measured(mode: u8) -> bool {
    mode & 0x80 == 0 && matches!(mode & 0xF, 1 | 2 | 4..=8 | 10)
}

// A value that is not known is out of every range below.

fn double(frame: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(take(frame, at))
}

fn single(frame: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(take(frame, at))
}

#[inline(never)]
fn pvt(frame: &[u8], values: &mut Values) {
    let position = Position {
        latitude: double(frame, 16),
        longitude: double(frame, 24),
        height: double(frame, 32),
    };
    let [north, east, up] = [44, 48, 52].map(|at| single(frame, at));
    let down = [north.into(), east.into(), -f64::from(up)];
    solution(
        frame,
        position.is_plausible().then_some(position),
        down,
        values,
    );
}

#[inline(never)]
fn pvt_cartesian(frame: &[u8], values: &mut Values) {
    let position = cartesian::position([16, 24, 32].map(|at| double(frame, at)));
    let xyz = [44, 48, 52].map(|at| f64::from(single(frame, at)));
    let velocity = match &position {
        Some(position) if xyz.iter().all(|v| v.abs() < 1e4) => cartesian::velocity(position, xyz),
        _ => [f64::NAN; 3],
    };
    solution(frame, position, velocity, values);
}

#[inline(never)]
fn solution(frame: &[u8], position: Option<Position>, velocity: [f64; 3], values: &mut Values) {
    if let Some(position) = position {
        values.position = position;
        Values::set(&mut values.own, 0, [0.0; 3]);
    }
    if velocity.iter().all(|v| v.abs() < 1e4) {
        values.velocity = velocity;
        Values::set(&mut values.own, 3, [0.0; 3]);
    }
    let [h, v] = [90, 92].map(|at| accuracy(frame, at));
    let axis = h * FRAC_1_SQRT_2;
    Values::set(&mut values.assumed, 0, [axis, axis, v]);
    Values::set(&mut values.assumed, 3, [VELOCITY_MPS; 3]);
}

/// A covariance in Earth-centred axes; it needs the position of the same epoch, which comes before.
#[inline(never)]
fn turned(frame: &[u8], first: usize, least: f32, values: &mut Values) {
    if values.has(0) {
        let covariance = [16, 20, 24, 32, 36, 44].map(|at| single(frame, at));
        let variances = cartesian::variances(&values.position, covariance);
        values.variances(first, variances, least);
    }
}

/// Twice the standard deviation, of the horizontal distance or of the height.
#[inline(never)]
fn accuracy(frame: &[u8], at: usize) -> f32 {
    match u16::from_le_bytes(take(frame, at)) {
        _ if frame.len() < WITH_ACCURACY => NOT_MEASURED,
        0 | u16::MAX => NOT_MEASURED,
        cm => (f32::from(cm) * 0.005).max(LEAST_M),
    }
}

/// Main to first auxiliary antenna.
#[inline(never)]
fn attitude(frame: &[u8], values: &mut Values) {
    let mode = u16::from_le_bytes(take(frame, 16));
    let degrees = single(frame, 20);
    if matches!(mode, 1..=4) && (0.0..=360.0).contains(&degrees) {
        values.heading = Some(Heading {
            angle: degrees * DEGREE as f32,
            sigma: HEADING,
        });
    }
}

fn attitude_covariance(frame: &[u8], values: &mut Values) {
    let variance = single(frame, 16);
    if (0.0..180.0 * 180.0).contains(&variance) {
        let sigma = libm::sqrtf(variance) * DEGREE as f32;
        values.heading_sigma = Some(sigma.max(LEAST_RAD));
    }
}

#[cfg(test)]
pub(super) mod tests;
