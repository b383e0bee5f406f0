//! The matching's errors at its beginning.

use super::filter::{Biased, COSINE, ERRORS, SINE, STANDS_OUT};
use super::level::Levelled;
use crate::fix::Fix;
use crate::nav::vector::{Q, V32, narrow, rotated};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Standard deviation of a velocity before its first observation, m/s.
const ANY_VELOCITY: f32 = 2.0;

/// The velocity of `H`: none when the receiver's may be none.
pub fn anchor(fix: &Fix) -> [f32; 2] {
    let [n, e, _] = narrow(fix.velocity);
    let [.., sn, se, _] = fix.sigmas;
    if libm::hypotf(n, e) <= STANDS_OUT * sn.max(se) {
        [0.0; 2]
    } else {
        [n, e]
    }
}

/// The filter's errors at its beginning. c is as likely 1 as -1, so that the mean of 1 - c is 1.
pub fn begin(kalman: &mut Biased, by: &[[f32; OUTPUTS]; ERRORS], rest: &[[f32; ERRORS]; ERRORS]) {
    let applied = *kalman.model().estimate();
    kalman.align(by, rest, &applied);
    let mut shift = [0.0; ERRORS];
    shift[COSINE] = -1.0;
    kalman.feedback(&shift);
}

/// Covariance of errors at the beginning but the tilt: velocity, cosine and sine are free, and
/// about down `w` is where the navigator is.
pub fn free() -> [[f32; ERRORS]; ERRORS] {
    let v = ANY_VELOCITY * ANY_VELOCITY;
    let variance = [0.0, 0.0, 1e-8, v, v, v, 1.0, 1.0, 1.0];
    let mut rest = [[0.0; ERRORS]; ERRORS];
    for (i, (row, variance)) in rest.iter_mut().zip(variance).enumerate() {
        if let Some(entry) = row.get_mut(i) {
            *entry = variance;
        }
    }
    rest
}

/// Errors of a level attitude: tilt by the accelerometers' bias and the gyros' drift since the
/// middle of the levelling, and errors that the receiver did not state. Velocity, cosine and sine
/// are free.
pub fn first(levelled: &Levelled, q_bw: Q) -> ([[f32; OUTPUTS]; ERRORS], [[f32; ERRORS]; ERRORS]) {
    let mut by = [[0.0; OUTPUTS]; ERRORS];
    let (half, lean) = (-0.5 * levelled.time, 1.0 / levelled.gravity);
    let rows = [
        ([half, 0.0, 0.0], [0.0, lean, 0.0]),
        ([0.0, half, 0.0], [-lean, 0.0, 0.0]),
    ];
    let [w, x, y, z] = q_bw;
    for (by, (gyro, accel)) in by.iter_mut().zip(rows) {
        // a row times C is C' times it
        let back = |v: V32| narrow(rotated([w, -x, -y, -z], v.map(f64::from)));
        let ([a, b, c], [d, e, f]) = (back(gyro), back(accel));
        *by = [a, b, c, d, e, f];
    }
    // the tilt that the receiver's acceleration shows: phi = [e, -n] in w, which is the
    // acceleration in north and east less H (1 - c, -s), with a mean of zero
    let [n, e] = levelled.slope;
    let square = n * n + e * e;
    let mut rest = free();
    (rest[0][0], rest[1][1]) = (levelled.tilt + square, levelled.tilt + square);
    for (i, by_cosine, by_sine) in [(0, -e, n), (1, n, e)] {
        (rest[i][COSINE], rest[COSINE][i]) = (by_cosine, by_cosine);
        (rest[i][SINE], rest[SINE][i]) = (by_sine, by_sine);
    }
    (by, rest)
}
