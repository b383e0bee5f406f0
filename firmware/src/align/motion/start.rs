//! The hand-over of a matched attitude: from the levelled frame `w` to north, east, down.

use super::filter::{ERRORS, Filter, Match, unit};
pub use super::given::Shown;
use super::given::{Given, Matrix, given_biases};
use super::known::azimuth_row;
use crate::control::Way;
use crate::nav::vector::{V, add, product, rotated, scale};
use crate::nav::{self, Navigator};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Standard deviation of a height that the receiver does not measure, m.
const ANY_HEIGHT: f32 = 100.0;

impl Start {
    /// Standard deviations of the errors, that of the sensors included.
    #[must_use]
    pub fn sigmas(&self) -> [f32; ERRORS] {
        core::array::from_fn(|i| libm::sqrtf(self.all[i][i].max(0.0)))
    }
}

/// A state to start from, and its errors: in the order attitude (rad), velocity (m/s), position
/// (m), each north, east, down.
///
/// The errors are `by` times the sensors' errors that are left when `applied` has been subtracted,
/// plus others of covariance `rest`. So they are given the sensors' errors, whatever is assumed
/// about these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// State at the end of the last sample.
    pub state: nav::State,
    /// Effect of the sensors' errors.
    pub by: [[f32; OUTPUTS]; ERRORS],
    /// Covariance of the other errors.
    pub rest: [[f32; ERRORS]; ERRORS],
    /// The alignment's estimate of the sensors' errors, rad/s and m/s2.
    pub applied: [f32; OUTPUTS],
    /// What the fixes have shown of them.
    pub shown: Shown,
    /// Covariance of the errors, that of the sensors included as far as the alignment knows them.
    pub all: [[f32; ERRORS]; ERRORS],
    /// What gave the heading.
    pub way: Way,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes.
    pub residual: f32,
    /// How long the alignment took, s.
    pub time_s: f64,
}

/// The state of a filter that has passed all tests.
#[inline(never)]
pub fn start(
    filter: &Filter,
    navigator: &Navigator,
    seen: &Match<'_>,
    time_s: f64,
) -> Option<Start> {
    let fix = seen.fix;
    if !fix.has(0..2) {
        return None;
    }
    let [c, s] = filter.azimuth().map(f64::from);
    let norm = libm::sqrt(c * c + s * s);
    let (c, s) = (c / norm, s / norm);
    let azimuth = libm::atan2(s, c);
    let (half_sin, half_cos) = libm::sincos(0.5 * azimuth);
    let turn = [half_cos, 0.0, 0.0, half_sin];
    let at = navigator.state();
    let q_bn = product(turn, at.q_bn);

    // the receiver's velocity, and what the navigator knows beside it
    let [.., n, e, _, _, _, _] = *filter.kalman().error_state();
    let [vn, ve] = filter.velocity().map(f64::from);
    let [x, y, z] = at.velocity;
    let beside = rotated(turn, [x - f64::from(n) - vn, y - f64::from(e) - ve, 0.0]);
    let velocity = [vn + beside[0], ve + beside[1], z];
    let arm = scale(seen.config.navigator.lever_arm.map(f64::from), -1.0);
    let age = f64::from(seen.age[0].clamp(0.0, 1.0));
    let mut position = fix
        .position
        .displaced(add(scale(velocity, age), rotated(q_bn, arm)));
    if !fix.has(2..3) {
        position.height = at.position.height;
    }
    let map = map([c, s], beside, filter);
    let mut given = Given::ZEROED;
    if !given_biases(filter.kalman(), &map, &unit(seen.config), &mut given) {
        return None;
    }
    for (k, sigma) in fix.sigmas.iter().take(3).enumerate() {
        let sigma = if sigma.is_finite() {
            *sigma
        } else {
            ANY_HEIGHT
        };
        given.rest[6 + k][6 + k] = sigma * sigma;
        given.all[6 + k][6 + k] = sigma * sigma;
    }
    let mut applied = *filter.kalman().model().estimate();
    for (applied, known) in applied.iter_mut().zip(seen.known) {
        *applied += known;
    }
    let mut shown = given.shown;
    shown.from = *seen.known;
    Some(Start {
        state: nav::State {
            position,
            velocity,
            q_bn,
        },
        by: given.by,
        rest: given.rest,
        applied,
        shown,
        all: given.all,
        way: filter.way(),
        heading_sigma: filter.heading_sigma(),
        residual: filter.residual(),
        time_s,
    })
}

/// Errors of attitude and velocity in north, east, down by those of the filter. `beside` is the
/// part of the velocity that was turned by the azimuth.
fn map([c, s]: [f64; 2], beside: V, filter: &Filter) -> Matrix {
    let (c, s) = (c as f32, s as f32);
    let azimuth = azimuth_row(filter.azimuth());
    let mut m = [[0.0; ERRORS]; ERRORS];
    for at in [0, 3] {
        (m[at][at], m[at][at + 1]) = (c, -s);
        (m[at + 1][at], m[at + 1][at + 1]) = (s, c);
        m[at + 2][at + 2] = 1.0;
    }
    // an azimuth that is too large turns the attitude against phi
    let parts = [(2, -1.0), (3, -beside[1] as f32), (4, beside[0] as f32)];
    for (i, factor) in parts {
        for (entry, of) in m[i].iter_mut().zip(azimuth) {
            *entry += factor * of;
        }
    }
    m
}
