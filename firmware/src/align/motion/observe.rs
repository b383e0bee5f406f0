//! Linear observations of the heading, or that it does not change.

use super::filter::Match;
use crate::fix::Heading;
use crate::nav::vector::{Q, V, narrow, product};

/// A course is one from this speed on, m/s, and from this many times its own standard deviation.
const COURSE_MPS: f32 = 3.0;
const COURSE_SIGMAS: f32 = 5.0;
/// Angle between the course and the forward axis: the slip of the tyres and the mounting. It stays
/// the same, so that many observations know no more than one (assumed).
const SLIP: f32 = 0.03;
/// In a curve the course is that of another point of the vehicle, m from the one that does not
/// slip (assumed).
const AXLE_M: f32 = 2.0;
/// Rotation of a vehicle that stands, by people and wind, in a second, rad (assumed).
const SWAY: f32 = 5e-4;
/// The forward axis is horizontal enough for a heading: cosine of its pitch.
const HORIZONTAL: f32 = 0.5;

/// The navigator's state at a fix.
#[derive(Debug, Clone, Copy)]
pub struct Sight {
    /// The vehicle's forward axis in `w`.
    pub forward: V,
    /// Estimates of cosine and sine of the azimuth.
    pub azimuth: [f32; 2],
    /// Rate of rotation since the last fix, rad/s.
    pub rate: f32,
    /// Variance of the attitude about down, rad^2.
    pub phi_down: f32,
}

/// A combination of errors that is observed: `azimuth (1 - c, -s) + phi_down phi(now) - before
/// phi(last fix)`.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    pub azimuth: [f32; 2],
    pub phi_down: f32,
    pub before: f32,
    /// The value observed.
    pub z: f32,
    /// Variance of its independent error.
    pub white: f32,
    /// Variance that no number of observations goes below.
    pub constant: f32,
    /// Whether it is a course.
    pub course: bool,
}

impl Row {
    /// The variance of the observation when the combination is known with variance `p`. `None`: it
    /// is known well enough already.
    pub fn variance(&self, p: f32) -> Option<f32> {
        floored(p, self.white, self.constant)
    }
}

/// The variance of an observation with a constant error: so large that what is known with variance
/// `p` is not known better than by the constant error afterwards. `None`: it is so already.
pub fn floored(p: f32, white: f32, constant: f32) -> Option<f32> {
    (p > constant).then(|| white.max(p * constant / (p - constant)))
}

/// The rotation from one attitude to another, rotation vector about the axes of `w`.
pub fn rotation([w, x, y, z]: Q, now: Q) -> V {
    let [c, a, b, d] = product(now, [w, -x, -y, -z]);
    let sign = if c < 0.0 { -1.0 } else { 1.0 };
    let size = libm::sqrt(a * a + b * b + d * d);
    // 2 atan(size / c) / size, which is 2 / c for small ones
    let k = if size < 1e-6 {
        2.0
    } else {
        2.0 * libm::atan2(size, c * sign) / size
    };
    [a, b, d].map(|part| sign * k * part)
}

/// A vehicle that stands does not turn: what the navigator has turned about down is its error.
pub fn no_turn(rotation: V) -> Row {
    Row {
        azimuth: [0.0; 2],
        phi_down: 1.0,
        before: 1.0,
        z: -rotation[2] as f32,
        white: 2.0 * SWAY * SWAY,
        constant: 0.0,
        course: false,
    }
}

/// A vehicle on wheels moves along its forward axis `d`, forwards or backwards: `d x R u = 0` with
/// the direction `u` of the receiver's velocity.
pub fn course(seen: &Match<'_>, sight: &Sight) -> Option<Row> {
    if !seen.config.rolls {
        return None;
    }
    let [n, e, _] = narrow(seen.fix.velocity);
    let [.., sn, se, _] = seen.fix.sigmas;
    let (speed, sigma) = (libm::hypotf(n, e), sn.max(se));
    let fast = speed > COURSE_MPS.max(COURSE_SIGMAS * sigma);
    if !fast {
        return None;
    }
    let [x, y] = horizontal(narrow(sight.forward))?;
    let (n, e) = (n / speed, e / speed);
    let (across, along) = (x * e - y * n, x * n + y * e);
    let [c, s] = sight.azimuth;
    // d . R u: the effect of phi about down; it is 1 or -1 and may be unknown
    let side = (c * along + s * across).clamp(-1.0, 1.0);
    let arm = seen.config.navigator.lever_arm;
    let arm = libm::hypotf(arm[0], libm::hypotf(arm[1], arm[2]));
    let noise = sigma / speed;
    let curve = (AXLE_M + arm) * sight.rate / speed;
    Some(Row {
        azimuth: [across, -along],
        phi_down: side,
        before: 0.0,
        z: across,
        white: noise * noise + curve * curve + sight.phi_down * (1.0 - side * side),
        constant: SLIP * SLIP,
        course: true,
    })
}

/// A heading for the horizontal direction `forward` in `w`: values of `1 - c` and `-s`, and their
/// variance. `None` for a forward axis that stands upright.
pub fn heading(forward: [f32; 2], heading: &Heading, phi_down: f32) -> Option<([f32; 2], f32)> {
    let [x, y] = horizontal([forward[0], forward[1], 0.0])?;
    let (e, n) = (libm::sinf(heading.angle), libm::cosf(heading.angle));
    let variance = heading.sigma * heading.sigma + phi_down;
    variance
        .is_finite()
        .then_some(([1.0 - (x * n + y * e), y * n - x * e], variance))
}

/// The direction of the horizontal part.
fn horizontal([x, y, _]: [f32; 3]) -> Option<[f32; 2]> {
    let size = libm::hypotf(x, y);
    (size > HORIZONTAL).then(|| [x / size, y / size])
}
