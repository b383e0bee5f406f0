//! Position, velocity and attitude in fixed point, and the step over a piece (Savage 1998; Groves
//! 2013, ch. 5; as `host_sim::inertial::sins::Sins::step`, but with the Earth's quantities at the
//! middle of the piece itself).
//!
//! # Ranges A factor of a product must be within 2^61 units (`super::fixed`). A solution is within
//! 1e4 m/s and 1e5 m, and a piece is checked before the step: at most 0.8 rad along an axis, 4096
//! m/s and 2 s. So a velocity within the step stays below 24 km/s (a factor holds 32), a way below
//! 48 km (524). The turn of the navigation frame is checked when it is known: at most 1 rad/s and
//! 1/8 rad, which are exceeded only close to a pole. A step that would leave these ranges gives
//! `None`.

use super::State;
use super::earth::{Local, wrapped};
use super::fixed::{
    ANGLE, LENGTH, RATE, Sum, VELOCITY, add, cross, from_f64, mul, to_f32, to_f64, within,
};
use super::gather::Piece;
use super::local_earth::LocalEarth;
use super::vector::{self, V, V32, matrix32};
use super::{MAX_HEIGHT, MAX_LATITUDE, MAX_VELOCITY};
use crate::fix::Position;
use core::f64::consts::PI;

/// Greatest turn of a piece along an axis, rad, and change of velocity, m/s.
const MAX_PIECE: [i64; 2] = [(1 << ANGLE) / 10 * 8, 4096 << VELOCITY];
/// Longest piece, s.
pub const LONGEST_S: f64 = 2.0;
/// Greatest turn of the navigation frame in a piece, rad.
const MAX_FRAME: i64 = 1 << (ANGLE - 3);
/// Largest rate, rad/s.
const MAX_RATE: i64 = 1 << RATE;
/// Bounds of a solution, and a whole turn.
pub(super) const LATITUDE: i64 = fixed(MAX_LATITUDE, ANGLE);
const HALF_TURN: i64 = fixed(PI, ANGLE);
const HEIGHT: i64 = fixed(MAX_HEIGHT, LENGTH);
const SPEED: i64 = fixed(MAX_VELOCITY, VELOCITY);
const ONE: i64 = 1 << ANGLE;
/// Largest element of a quaternion that is a unit one but for rounding, or for a flipped bit.
const ELEMENT: i64 = ONE + ONE / 256;

const fn fixed(x: f64, bits: u32) -> i64 {
    (x * super::fixed::unit(bits)) as i64
}

/// Position, velocity and attitude.
#[derive(Debug, Clone, Copy)]
struct Moving {
    // latitude and longitude, rad
    at: [i64; 2],
    height: i64,
    velocity: [i64; 3],
    q_bn: [i64; 4],
}

/// A state in fixed point, and the Earth around it.
#[derive(Debug, Clone)]
pub struct Solution {
    now: Moving,
    local_earth: LocalEarth,
}

/// Findings of a step beside the new solution, for the error dynamics.
pub struct Step {
    /// The Earth's quantities were recomputed.
    pub recomputed: bool,
    /// Change of velocity over ground, fixed point.
    pub change: [i64; 3],
    /// Integral of the specific force, north, east, down, m/s.
    pub force: V32,
    /// Velocity at the middle, m/s.
    pub v_mid: V32,
    /// Body to navigation axes at the middle.
    pub c_mid: [V32; 3],
}

impl Solution {
    /// A solution from a state in range with a unit quaternion.
    #[inline(never)]
    pub fn new(state: &State) -> Self {
        let Position {
            latitude,
            longitude,
            height,
        } = state.position;
        let at = [latitude, wrapped(longitude)].map(|x| from_f64(x, ANGLE));
        let height = from_f64(height, LENGTH);
        Self {
            now: Moving {
                at,
                height,
                velocity: state.velocity.map(|x| from_f64(x, VELOCITY)),
                q_bn: state.q_bn.map(|x| from_f64(x, ANGLE)),
            },
            local_earth: LocalEarth::new(at[0], height),
        }
    }

    /// The state as f64.
    pub fn state(&self) -> State {
        let [latitude, longitude] = self.now.at.map(|x| to_f64(x, ANGLE));
        State {
            position: Position {
                latitude,
                longitude,
                height: to_f64(self.now.height, LENGTH),
            },
            velocity: self.now.velocity.map(|x| to_f64(x, VELOCITY)),
            q_bn: self.now.q_bn.map(|x| to_f64(x, ANGLE)),
        }
    }

    /// The Earth around the position.
    pub fn local_earth(&self) -> &LocalEarth {
        &self.local_earth
    }

    /// Subtracts an error: attitude (rad, within 1), velocity (m/s), position (m, north, east,
    /// down). False, and no change, when the result is out of range.
    pub fn correct(&mut self, phi: V, dv: V, dp: V) -> bool {
        let latitude = to_f64(self.now.at[0], ANGLE);
        let height = to_f64(self.now.height, LENGTH);
        // metres north and east count at their origin, the corrected position: see
        // [`Position::ned_from`]
        let mut here = Local::at(latitude, height);
        for _ in 0..2 {
            here = Local::at(latitude - dp[0] / here.m_h, height + dp[2]);
        }
        let [north, east] = [dp[0] / here.m_h, dp[1] / (here.n_h * here.cos)];
        let Moving {
            at,
            height,
            velocity,
            q_bn,
        } = self.now;
        let dv = dv.map(|x| from_f64(x, VELOCITY));
        let q = vector::product(vector::from_rotvec(phi), q_bn.map(|x| to_f64(x, ANGLE)));
        let corrected = Moving {
            at: [
                at[0].saturating_sub(from_f64(north, ANGLE)),
                secant(at[1].saturating_sub(from_f64(wrapped(east), ANGLE))),
            ],
            height: height.saturating_add(from_f64(dp[2], LENGTH)),
            velocity: core::array::from_fn(|i| velocity[i].saturating_sub(dv[i])),
            q_bn: vector::renormalised(q).map(|x| from_f64(x, ANGLE)),
        };
        let good = corrected.in_range();
        if good {
            self.now = corrected;
        }
        good
    }

    /// One step; `None` when the solution would leave the range of the equations. It stays where it
    /// was then.
    #[inline]
    pub fn step(&mut self, piece: &Piece) -> Option<Step> {
        let Piece {
            phi,
            velocity: dv,
            time,
        } = *piece;
        if !(within(&phi, MAX_PIECE[0]) && within(&dv, MAX_PIECE[1])) {
            return None;
        }
        let half = time >> 1;
        let Moving {
            at,
            height,
            velocity,
            q_bn,
        } = self.now;

        // the Earth at the middle
        let ahead = mul::<62>(velocity[0], half);
        let latitude = at[0] + (mul::<62>(ahead, self.local_earth.meridian()) >> 3);
        let middle = height - mul::<62>(velocity[2], half);
        let recomputed = self.local_earth.follow(latitude, middle);
        let here = self.local_earth.here(latitude, middle);
        let [m, n] = here.curvature;

        let force = rotated(q_bn, dv);
        let weight = mul::<62>(here.gravity, time) >> 7;
        let v_mid = [
            velocity[0] + (force[0] >> 1),
            velocity[1] + (force[1] >> 1),
            velocity[2] + ((force[2] + weight) >> 1),
        ];
        // a rate from a velocity and a curvature has 67 bits
        let east = mul::<62>(v_mid[1], n);
        let omega_en = [
            east >> 10,
            -(mul::<62>(v_mid[0], m) >> 10),
            -mul::<58>(east, here.tangent),
        ];
        if !within(&omega_en, MAX_RATE) {
            return None;
        }
        let [north, down] = here.earth_rate;
        let omega_ie = [north, 0, down];
        let omega_in = add(omega_ie, omega_en);
        let zeta = omega_in.map(|rate| mul::<55>(rate, time));
        let coriolis = add(omega_ie, omega_in).map(|rate| mul::<55>(rate, time));
        if !(within(&zeta, MAX_FRAME) && within(&coriolis, MAX_FRAME)) {
            return None;
        }

        let dv_n = add(force, cross(force, zeta.map(|x| x >> 1)));
        let mut change = add(dv_n, cross(v_mid, coriolis));
        change[2] += weight;
        let v_mean = [
            velocity[0] + (change[0] >> 1),
            velocity[1] + (change[1] >> 1),
            velocity[2] + (change[2] >> 1),
        ];
        let [north, east, down] = v_mean.map(|v| mul::<62>(v, time));
        // 1/((N + h) cos) has 69 bits
        let by_east = mul::<62>(n, here.secant);
        let next = Moving {
            at: [
                at[0] + (mul::<62>(north, m) >> 3),
                secant(at[1].saturating_add(mul::<51>(east, by_east))),
            ],
            height: height - down,
            velocity: add(velocity, change),
            q_bn: turned(q_bn, phi, zeta),
        };
        if !next.in_range() {
            return None;
        }
        self.now = next;
        let middle = core::array::from_fn(|i| coarse(q_bn[i], next.q_bn[i]));
        Some(Step {
            recomputed,
            change,
            force: dv_n.map(|x| to_f32(x, VELOCITY)),
            v_mid: v_mid.map(|x| to_f32(x, VELOCITY)),
            c_mid: matrix32(unit32(middle)),
        })
    }
}

impl Moving {
    /// Whether the equations hold here.
    fn in_range(&self) -> bool {
        within(&[self.at[0]], LATITUDE)
            && within(&[self.at[1]], HALF_TURN)
            && within(&[self.height], HEIGHT)
            && within(&self.velocity, SPEED)
            && within(&self.q_bn, ELEMENT)
    }
}

/// A longitude that may have crossed the date line once.
#[inline(always)]
fn secant(longitude: i64) -> i64 {
    if longitude > HALF_TURN {
        longitude - 2 * HALF_TURN
    } else if longitude < -HALF_TURN {
        longitude + 2 * HALF_TURN
    } else {
        longitude
    }
}

/// The sum of two elements of quaternions in f32, to 2e-9.
#[inline(always)]
fn coarse(a: i64, b: i64) -> f32 {
    ((a + b) >> 31) as i32 as f32
}

/// Brings four numbers, not all 0, to unit length.
fn unit32([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    let k = 1.0 / libm::sqrtf(w * w + x * x + y * y + z * z);
    [w * k, x * k, y * k, z * k]
}

/// `v` turned by `q`: `v + 2 q x (q x v + w v)`.
#[inline(always)]
fn rotated([w, x, y, z]: [i64; 4], v: [i64; 3]) -> [i64; 3] {
    let [a, b, c] = v;
    let t = [
        Sum::of(y, c).minus(z, b).plus(w, a).over::<ANGLE>(),
        Sum::of(z, a).minus(x, c).plus(w, b).over::<ANGLE>(),
        Sum::of(x, b).minus(y, a).plus(w, c).over::<ANGLE>(),
    ];
    add(v, cross([x, y, z], t.map(|x| x << 1)))
}

/// Terms of `cos(n/2)` and of `sin(n/2)/n` by powers of `n^2`.
const COSINE: [i64; 9] = series(1.0, 1);
const SINE: [i64; 9] = series(0.5, 2);

const fn series(first: f64, from: u32) -> [i64; 9] {
    let mut terms = [0; 9];
    let (mut term, mut k) = (first, 0);
    while k < 9 {
        terms[k] = fixed(term, ANGLE);
        let next = from + 2 * k as u32;
        term /= -4.0 * (next as f64) * ((next + 1) as f64);
        k += 1;
    }
    terms
}

#[inline(always)]
fn polynomial(terms: &[i64], x: i64) -> i64 {
    let mut sum = 0;
    for term in terms.iter().rev() {
        sum = term + mul::<ANGLE>(sum, x);
    }
    sum
}

#[inline(never)]
fn long(terms: &[i64; 9], x: i64) -> i64 {
    polynomial(terms, x)
}

/// Quaternion of a rotation vector whose length is below 1.4 rad.
#[inline(always)]
pub(super) fn from_rotvec([x, y, z]: [i64; 3]) -> [i64; 4] {
    let n2 = Sum::of(x, x).plus(y, y).plus(z, z).over::<ANGLE>();
    // three terms are exact to 1e-17 below 0.06 rad, where nearly all pieces lie
    let (w, s) = if n2 < ONE / 280 {
        let ([a, b, c, d, ..], [e, f, g, h, ..]) = (COSINE, SINE);
        (polynomial(&[a, b, c, d], n2), polynomial(&[e, f, g, h], n2))
    } else {
        (long(&COSINE, n2), long(&SINE, n2))
    };
    [
        w,
        mul::<ANGLE>(x, s),
        mul::<ANGLE>(y, s),
        mul::<ANGLE>(z, s),
    ]
}

/// Quaternion product.
#[inline(always)]
fn product([aw, ax, ay, az]: [i64; 4], [bw, bx, by, bz]: [i64; 4]) -> [i64; 4] {
    let of = |a: i64, b: i64| Sum::of(a, b);
    [
        of(aw, bw).minus(ax, bx).minus(ay, by).minus(az, bz),
        of(aw, bx).plus(ax, bw).plus(ay, bz).minus(az, by),
        of(aw, by).minus(ax, bz).plus(ay, bw).plus(az, bx),
        of(aw, bz).plus(ax, by).minus(ay, bx).plus(az, bw),
    ]
    .map(Sum::over::<ANGLE>)
}

/// Brings a quaternion of nearly unit length to unit length: one Newton step.
#[inline(always)]
fn renormalised(q: [i64; 4]) -> [i64; 4] {
    let [w, x, y, z] = q;
    let n2 = Sum::of(w, w).plus(x, x).plus(y, y).plus(z, z);
    let short = (ONE - n2.over::<ANGLE>()) >> 1;
    q.map(|a| a + mul::<ANGLE>(a, short))
}

/// Attitude after the body has turned by `phi` (in body axes at the start) and the navigation frame
/// by `zeta`, rad. `zeta` is some urad: its cosine is 1 to 1e-11, which renormalising corrects.
#[inline(always)]
pub(super) fn turned(q_bn: [i64; 4], phi: [i64; 3], zeta: [i64; 3]) -> [i64; 4] {
    let [w, x, y, z] = product(q_bn, from_rotvec(phi));
    let [a, b, c] = zeta;
    // half of it, backwards
    let half = |sum: Sum| sum.over::<{ ANGLE + 1 }>();
    renormalised([
        w + half(Sum::of(a, x).plus(b, y).plus(c, z)),
        x - half(Sum::of(a, w).plus(b, z).minus(c, y)),
        y - half(Sum::of(b, w).plus(c, x).minus(a, z)),
        z - half(Sum::of(c, w).plus(a, y).minus(b, x)),
    ])
}

#[cfg(test)]
mod tests;
