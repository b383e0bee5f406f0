//! The error bound: how far corrections within their limits can move a free-inertial position at
//! worst.
//!
//! Let the correction of every axis stay within L_g (rad/s) and L_a (m/s^2), and vary in the worst
//! way. The error of the increments is then at most sqrt(3) L in any direction. Over the time t
//! since the navigation became free inertial, the position moves by at most the integral of the
//! absolute impulse responses of the Schuler loop (omega^2 = g/R), plus the heading's part at speed
//! v:
//!
//! ```text
//! A(t) = integral |sin(omega s)| / omega ds                              accelerometers
//! G(t) = R (t - sin(omega t) / omega)                                    level gyros
//! H(t) = v t^2 + Omega R (t^2 / 2 - (1 - cos(omega t)) / omega^2)        vertical gyro
//! worst(t) = sqrt(3) (L_a A + L_g sqrt(G^2 + H^2) (1 + (Omega + v/R) t))
//! ```
//!
//! The first term of H comes from turns and changes of speed: a force f that is resolved with a
//! heading error psi adds psi x f. The integral of f is the change of velocity, at most 2 v;
//! integrated by parts with |psi| <= L t that is at most 2 L v t a unit of time. The second term of
//! H comes from the Earth's rate. The last factor covers how tilt and heading act on each other.
//! Vertical errors are left to the height sensor. This holds for free-inertial navigation after an
//! alignment without the correction; see [`ErrorBound::with_alignment`] for an alignment with it.

use crate::compensator::Limit;
use core::f64::consts::PI;

/// Radius of the Earth, m, rounded up; gravity, m/s^2, rounded down: errors are greatest in a slow
/// Schuler loop.
const RADIUS: f64 = 6.4e6;
const GRAVITY: f64 = 9.78;
/// Earth rate, rad/s.
const EARTH_RATE: f64 = 7.292_115e-5;
const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// Times for which the bound is reported, s: 5, 10, 15, 20 and 22 min.
pub const TIMES_S: [u32; 5] = [300, 600, 900, 1200, 1320];

/// The limits of the correction and of the vehicle's speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// Largest correction of an axis.
    pub limit: Limit,
    /// Largest speed over ground, m/s, >= 0.
    pub speed: f32,
}

impl ErrorBound {
    /// Greatest error, in metres of horizontal position, that corrections add within `t` seconds of
    /// free-inertial navigation.
    #[must_use]
    pub fn metres(&self, t: f64) -> f64 {
        let omega = libm::sqrt(GRAVITY / RADIUS);
        let (speed, turn) = (f64::from(self.speed), omega * t);
        let swing = (1.0 - libm::cos(turn)) / (omega * omega);
        let level = RADIUS * (t - libm::sin(turn) / omega);
        let heading = speed * t * t + EARTH_RATE * RADIUS * (0.5 * t * t - swing);
        let mutual = 1.0 + (EARTH_RATE + speed / RADIUS) * t;
        let gyro = f64::from(self.limit.gyro) * libm::hypot(level, heading) * mutual;
        let accel = f64::from(self.limit.accel) * rectified(turn) / (omega * omega);
        SQRT_3 * (gyro + accel)
    }

    /// The same when the alignment at latitude `lat` (rad) was made with a correction in force.
    /// That correction tilts by up to L_a / g and turns the heading by up to L_g / (Omega cos lat).
    /// Free inertial navigation with another correction adds both.
    #[must_use]
    pub fn with_alignment(&self, t: f64, lat: f64) -> f64 {
        let omega = libm::sqrt(GRAVITY / RADIUS);
        let swing = 1.0 - libm::cos((omega * t).min(PI));
        let tilt = SQRT_3 * f64::from(self.limit.accel) / GRAVITY;
        let heading = SQRT_3 * f64::from(self.limit.gyro) / (EARTH_RATE * libm::cos(lat));
        let earth = EARTH_RATE * RADIUS * (t - libm::sin(omega * t) / omega);
        let carried = libm::hypot(2.0 * f64::from(self.speed) * t, earth);
        let mutual = 1.0 + (EARTH_RATE + f64::from(self.speed) / RADIUS) * t;
        self.metres(t) + (tilt * RADIUS * swing + heading * carried) * mutual
    }

    /// [`Self::metres`] at [`TIMES_S`], rounded up. The integrals are constants, so that this takes
    /// few instructions and little code.
    #[must_use]
    pub fn table(&self) -> [u32; 5] {
        AT_TIMES.map(|at| {
            let Integrals {
                time,
                accel,
                level,
                earth,
            } = at;
            let heading = self.speed * time * time + earth;
            let mutual = 1.0 + (EARTH_RATE as f32 + self.speed / RADIUS as f32) * time;
            let gyro = libm::sqrtf(level * level + heading * heading) * mutual;
            let metres = SQRT_3 as f32 * (self.limit.gyro * gyro + self.limit.accel * accel);
            // more than the rounding of six operations; `as` saturates
            libm::ceilf(metres * (1.0 + 1e-6)) as u32
        })
    }
}

/// The terms of [`ErrorBound::metres`] at one time: t, A, G, and the second term of H, in s and m.
#[derive(Clone, Copy)]
struct Integrals {
    time: f32,
    accel: f32,
    level: f32,
    earth: f32,
}

const AT_TIMES: [Integrals; 5] = {
    let mut all = [integrals(0.0); 5];
    let mut k = 0;
    while k < all.len() {
        all[k] = integrals(TIMES_S[k] as f64);
        k += 1;
    }
    all
};

/// By power series, which converge fast because these times are less than half a period.
const fn integrals(t: f64) -> Integrals {
    // x^2 of x = omega t; terms of (1 - cos x) / x^2 and of (x - sin x) / x^3
    let square = t * t * (GRAVITY / RADIUS);
    let (mut cos, mut sin) = (0.5, 1.0 / 6.0);
    let (mut cos_term, mut sin_term) = (0.5, 1.0 / 6.0);
    let mut n = 2.0;
    while n < 30.0 {
        cos_term *= -square / ((n + 1.0) * (n + 2.0));
        sin_term *= -square / ((n + 2.0) * (n + 3.0));
        cos += cos_term;
        sin += sin_term;
        n += 2.0;
    }
    let swing = cos * t * t;
    Integrals {
        time: t as f32,
        accel: swing as f32,
        level: (RADIUS * sin * square * t) as f32,
        earth: (EARTH_RATE * RADIUS * (0.5 * t * t - swing)) as f32,
    }
}

/// The integral of |sin| from 0 to x.
fn rectified(x: f64) -> f64 {
    let halves = libm::floor(x / PI);
    2.0 * halves + 1.0 - libm::cos(x - halves * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bound(gyro: f32, accel: f32, speed: f32) -> ErrorBound {
        ErrorBound {
            limit: Limit { gyro, accel },
            speed,
        }
    }

    #[test]
    fn closed_forms_are_the_integrals() {
        let (t, n) = (6000.0, 600_000); // longer than half a Schuler period
        let omega = libm::sqrt(GRAVITY / RADIUS);
        let ds = t / f64::from(n);
        let (mut a, mut g, mut h) = (0.0, 0.0, 0.0);
        for k in 0..n {
            let s = (f64::from(k) + 0.5) * ds;
            a += (omega * s).sin().abs() / omega * ds;
            g += RADIUS * (1.0 - (omega * s).cos()) * ds;
            h += EARTH_RATE * RADIUS * (1.0 - (omega * (t - s)).cos()) * s * ds;
        }
        let close = |x: f64, y: f64| (x / y - 1.0).abs() < 1e-5;
        assert!(close(
            bound(0.0, 1e-3, 10.0).metres(t),
            SQRT_3 * 1e-3_f32 as f64 * a
        ));
        let still = bound(1e-8, 0.0, 0.0).metres(t);
        let want = SQRT_3 * f64::from(1e-8_f32) * g.hypot(h) * (1.0 + EARTH_RATE * t);
        assert!(close(still, want), "{still} {want}");
    }

    #[test]
    fn the_table_is_the_closed_form() {
        for h in [
            bound(4.8e-8, 1e-3, 30.0),
            bound(5e-5, 1e-2, 50.0),
            bound(1e-6, 0.0, 0.0),
            bound(0.0, 1e-4, 9.0),
        ] {
            for (got, t) in h.table().into_iter().zip(TIMES_S) {
                let want = h.metres(f64::from(t));
                let got = f64::from(got);
                assert!(
                    got >= want && got <= want * (1.0 + 3e-6) + 1.0,
                    "{got} {want}"
                );
            }
        }
    }

    #[test]
    fn a_table_grows_and_never_overflows() {
        let table = bound(4.8e-8, 1e-3, 30.0).table();
        assert!(table.is_sorted() && table[0] > 0);
        assert_eq!(bound(0.0, 0.0, 100.0).table(), [0; 5]);
        assert_eq!(bound(1e30, 0.0, 0.0).table(), [u32::MAX; 5]);
        let h = bound(4.8e-8, 1e-3, 30.0);
        assert!(h.with_alignment(1320.0, 0.8) > h.metres(1320.0));
    }
}
