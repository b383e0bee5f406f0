//! The hand-over of a matched attitude: from the levelled frame `w` to north, east, down.

use super::filter::{ERRORS, Filter, Match, unit};
pub use super::given::Shown;
use super::given::{Given, Matrix, given_biases, of_biases, shown};
use super::known::azimuth_row;
use super::take::Found;
use crate::control::Way;
use crate::fix::Fix;
use crate::nav::vector::{Q, V, add, product, rotated, scale};
use crate::nav::{self, Navigator};
use lrnn_nostd::learn::kalman::{OUTPUTS, Transition};

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
    /// Observations of them by the fixes.
    pub shown: Shown,
    /// Covariance of the errors, that of the sensors included as far as the alignment knows them.
    pub all: [[f32; ERRORS]; ERRORS],
    /// Source of the heading.
    pub way: Way,
    /// Standard deviation of the heading, rad.
    pub heading_sigma: f32,
    /// Mean normalised innovation squared of the last fixes.
    pub residual: f32,
    /// How long the alignment took, s.
    pub time_s: f64,
}

/// Rotation from `w` to north, east, down.
#[derive(Debug, Clone, Copy)]
pub struct Turned {
    /// Cosine and sine of the azimuth.
    azimuth: [f64; 2],
    turn: Q,
    q_bn: Q,
}

/// Position at which a navigator is to start.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub state: nav::State,
    azimuth: [f64; 2],
    /// The part of the velocity that was turned by the azimuth.
    beside: V,
}

/// The attitude of a filter that has passed all tests. The first of four parts: [`place`],
/// [`errors`] and [`found`] follow. `None`: the fix has no position.
#[inline(never)]
pub fn turned(filter: &Filter, navigator: &Navigator, fix: &Fix) -> Option<Turned> {
    if !fix.has(0..2) {
        return None;
    }
    let [c, s] = filter.azimuth().map(f64::from);
    let norm = libm::sqrt(c * c + s * s);
    let (c, s) = (c / norm, s / norm);
    let azimuth = libm::atan2(s, c);
    let (half_sin, half_cos) = libm::sincos(0.5 * azimuth);
    let turn = [half_cos, 0.0, 0.0, half_sin];
    Some(Turned {
        azimuth: [c, s],
        turn,
        q_bn: product(turn, navigator.state().q_bn),
    })
}

/// The receiver's velocity and the navigator's other state; the position of the sensors.
#[inline(never)]
pub fn place(filter: &Filter, navigator: &Navigator, of: &Turned, seen: &Match<'_>) -> Place {
    let (fix, q_bn, at) = (seen.fix, of.q_bn, navigator.state());
    let [.., n, e, _, _, _, _] = *filter.kalman().error_state();
    let [vn, ve] = filter.velocity().map(f64::from);
    let [x, y, z] = at.velocity;
    let beside = rotated(of.turn, [x - f64::from(n) - vn, y - f64::from(e) - ve, 0.0]);
    let velocity = [vn + beside[0], ve + beside[1], z];
    let arm = scale(seen.config.navigator.lever_arm.map(f64::from), -1.0);
    let age = f64::from(seen.age[0].clamp(0.0, 1.0));
    let mut position = fix
        .position
        .displaced(add(scale(velocity, age), rotated(q_bn, arm)));
    if !fix.has(2..3) {
        position.height = at.position.height;
    }
    Place {
        state: nav::State {
            position,
            velocity,
            q_bn,
        },
        azimuth: of.azimuth,
        beside,
    }
}

/// The errors there, which are put into `scratch`: see [`Found`]. False when they are not finite.
#[inline(never)]
pub fn errors(
    filter: &Filter,
    place: &Place,
    seen: &Match<'_>,
    scratch: &mut Transition<ERRORS>,
) -> bool {
    let map = map(place.azimuth, place.beside, filter);
    let given = Given {
        by: &mut scratch.gamma,
        rest: &mut scratch.q,
        all: &mut scratch.phi,
    };
    let covariance = filter.kalman().covariance();
    let joint = (
        covariance.errors(),
        covariance.cross(),
        &of_biases(filter.kalman()),
    );
    if !given_biases(joint, &map, &unit(seen.config), given) {
        return false;
    }
    for (k, sigma) in seen.fix.sigmas.iter().take(3).enumerate() {
        let sigma = if sigma.is_finite() {
            *sigma
        } else {
            ANY_HEIGHT
        };
        scratch.q[6 + k][6 + k] = sigma * sigma;
        scratch.phi[6 + k][6 + k] = sigma * sigma;
    }
    true
}

/// All but the errors. `None`: the covariance of the biases is not positive.
#[inline(never)]
pub fn found(filter: &Filter, state: nav::State, seen: &Match<'_>, time_s: f64) -> Option<Found> {
    let kalman = filter.kalman();
    let estimate = kalman.model().estimate();
    let mut shown = shown(&of_biases(kalman), estimate, &unit(seen.config))?;
    let mut applied = *filter.kalman().model().estimate();
    for (applied, known) in applied.iter_mut().zip(seen.known) {
        *applied += known;
    }
    shown.from = *seen.known;
    Some(Found {
        state,
        applied,
        shown,
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
