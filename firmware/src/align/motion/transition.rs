//! The transition of the matching's nine errors from fix to fix.

use super::filter::{COMBINED, COSINE, ERRORS, SINE};
use super::observe::Row;
use lrnn_nostd::learn::kalman::Transition;

/// Data of the time since the last fix for the transition.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// The velocity of `H` at its beginning.
    pub before: [f32; 2],
    /// Velocity at its end.
    pub after: [f32; 2],
    /// The receiver's horizontal velocity beside that of `H`.
    pub beside: [f32; 2],
    /// Change of the receiver's velocity.
    pub change: f32,
    /// Change of the azimuth, rad.
    pub turn: f32,
    /// Horizontal Earth rate, rad/s.
    pub earth: f32,
    /// Rotation of the navigator's frame about down for 1 m/s to its east, rad.
    pub bent: f32,
    /// Horizontal velocity in `w`, m/s.
    pub velocity: [f32; 2],
    /// Variance in proportion to the motion: attitude, velocity.
    pub scale: [f32; 2],
}

/// The transition, and by how much the means move less: a shift for
/// [`lrnn_nostd::learn::kalman::Kalman::feedback`].
pub fn transition(
    passed: &Transition<ERRORS>,
    step: &Step,
    row: Option<&Row>,
) -> (Transition<ERRORS>, [f32; ERRORS]) {
    let mut to = Transition::ZEROED;
    to.time = passed.time;
    let (sin, cos) = (libm::sinf(step.turn), libm::cosf(step.turn));
    let [vn, ve] = step.before;
    for i in 0..6 {
        let mut from = passed.phi[i];
        if i == 2 {
            // the frame's own turn is part of the azimuth
            from[4] += step.bent;
        }
        let [p0, p1, p2, v0, v1, v2, ..] = from;
        let [one, other] = from_earth(passed.time, step, i, [p0, p1]);
        // the velocity's error is u + H (1 - c, -s)
        let by_cosine = v0 * vn + v1 * ve + one;
        let by_sine = v0 * ve - v1 * vn + other;
        to.phi[i] = [p0, p1, p2, v0, v1, v2, by_cosine, by_sine, 0.0];
        to.gamma[i] = passed.gamma[i];
        let [q0, q1, q2, q3, q4, q5, ..] = passed.q[i];
        to.q[i] = [q0, q1, q2, q3, q4, q5, 0.0, 0.0, 0.0];
        let [attitude, velocity] = step.scale;
        to.q[i][i] += if i < 3 { attitude } else { velocity };
    }
    // the azimuth turns: 1 - c and -s after it, of which the constant part is a shift
    let [n, e] = step.after;
    to.phi[3][COSINE] -= n * cos + e * sin;
    to.phi[3][SINE] -= e * cos - n * sin;
    to.phi[4][COSINE] -= e * cos - n * sin;
    to.phi[4][SINE] -= -e * sin - n * cos;
    (to.phi[COSINE][COSINE], to.phi[COSINE][SINE]) = (cos, -sin);
    (to.phi[SINE][COSINE], to.phi[SINE][SINE]) = (sin, cos);
    let (c, s) = (cos - 1.0, sin);
    let mut shift = [0.0; ERRORS];
    (shift[3], shift[4]) = (-(n * c + e * s), -(e * c - n * s));
    (shift[COSINE], shift[SINE]) = (c, s);
    if let Some(row) = row {
        combine(&mut to, &mut shift, row);
    }
    (to, shift)
}

/// Effect of `1 - c` and `-s` on error `i` by the Earth's rate that was assumed about the wrong
/// axis. `by_axis`: effect of an attitude error about the first two axes.
fn from_earth(time: f32, step: &Step, i: usize, by_axis: [f32; 2]) -> [f32; 2] {
    let half = 0.5 * time * step.earth;
    let [mut x, mut y] = by_axis;
    // the mean over the time
    match i {
        0 => x += 1.0,
        1 => y += 1.0,
        _ => {}
    }
    let coriolis = if i == 5 { -4.0 * half } else { 0.0 };
    let [vx, vy] = step.velocity;
    [half * x + coriolis * vy, -half * y + coriolis * vx]
}

/// The last error becomes a combination of the others after the transition.
fn combine(to: &mut Transition<ERRORS>, shift: &mut [f32; ERRORS], row: &Row) {
    let [cosine, sine] = row.azimuth;
    let down = row.phi_down;
    for j in 0..ERRORS {
        to.phi[COMBINED][j] =
            down * to.phi[2][j] + cosine * to.phi[COSINE][j] + sine * to.phi[SINE][j];
    }
    to.phi[COMBINED][2] -= row.before;
    shift[COMBINED] = down * shift[2] + cosine * shift[COSINE] + sine * shift[SINE];
    to.gamma[COMBINED] = to.gamma[2].map(|value| down * value);
    for j in 0..6 {
        let value = down * to.q[2][j];
        (to.q[COMBINED][j], to.q[j][COMBINED]) = (value, value);
    }
    to.q[COMBINED][COMBINED] = down * down * to.q[2][2];
}
