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
//! Vertical errors are left to the height sensor.
//!
//! **The alignment** before may have been made with another correction within the limits. It then
//! has errors that the correction of the navigation afterwards adds to. An alignment at standstill
//! over the time T, at latitude phi, is off by at most
//!
//! ```text
//! tilt(T)    = sqrt(3) (L_a / g + L_g T / 2)
//! heading(T) = sqrt(3) (L_g / (Omega cos phi) + tan(phi) L_a / g + L_g T / 2)
//! ```
//!
//! Gravity gives the tilt, and the Earth's rotation about the tilted axis the heading. The terms
//! with T are the drift since the middle of that time. Where the first term of the heading is not
//! small, x / sqrt(1 - x^2) takes its place. A heading error psi turns a velocity v by at most
//! min(psi, 2) v. A navigation that begins at rest is therefore moved by at most
//!
//! ```text
//! turned(t)  = heading hypot(v t, Omega cos phi R (t - sin(omega t) / omega))
//! aligned(t) = (tilt R (1 - cos omega t) + turned(t)) (1 + (Omega + v/R) t)
//! ```
//!
//! **The rate of the words.** A correction is computed for the configured time between two samples.
//! If they come k times as often, all of the above is k times as large. k is measured against the
//! clock (`plausibility::rate`): no less than what that check lets pass unnoticed.

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

/// Latitude that is assumed while none is known, rad: 60 degrees. Nearer to a pole an alignment
/// errs more.
pub const LATITUDE: f64 = core::f64::consts::FRAC_PI_3;
/// Longest alignment of the navigation computer at standstill, s (assumed).
pub const ALIGNMENT_S: f64 = 300.0;

/// The limits of the correction and of the vehicle's speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorBound {
    /// Largest correction of an axis.
    pub limit: Limit,
    /// Largest speed over ground, m/s, >= 0.
    pub speed: f32,
    /// Latitude of the alignment, rad.
    pub latitude: f64,
    /// Ratio of measured to configured sample rate, >= 1.
    pub words: f32,
}

impl ErrorBound {
    /// Greatest error, in metres of horizontal position, that corrections add within `t` seconds of
    /// free-inertial navigation after an alignment without them.
    #[must_use]
    pub fn unaligned(&self, t: f64) -> f64 {
        let omega = libm::sqrt(GRAVITY / RADIUS);
        let (speed, turn) = (f64::from(self.speed), omega * t);
        let swing = (1.0 - libm::cos(turn)) / (omega * omega);
        let level = RADIUS * (t - libm::sin(turn) / omega);
        let heading = speed * t * t + EARTH_RATE * RADIUS * (0.5 * t * t - swing);
        let mutual = 1.0 + (EARTH_RATE + speed / RADIUS) * t;
        let [gyro, accel] = self.limits();
        let gyro = gyro * libm::hypot(level, heading) * mutual;
        SQRT_3 * (gyro + accel * rectified(turn) / (omega * omega))
    }

    /// Bound of the position error, m, when the alignment, at standstill, was made with a
    /// correction within the limits.
    #[must_use]
    pub fn metres(&self, t: f64) -> f64 {
        let omega = libm::sqrt(GRAVITY / RADIUS);
        let [tilt, heading] = self.alignment();
        let swing = 1.0 - libm::cos((omega * t).min(PI));
        let speed = f64::from(self.speed);
        let level = RADIUS * (t - libm::sin(omega * t) / omega);
        let earth = EARTH_RATE * libm::cos(self.latitude) * level;
        let mutual = 1.0 + (EARTH_RATE + speed / RADIUS) * t;
        let carried = heading * libm::hypot(speed * t, earth);
        self.unaligned(t) + (tilt * RADIUS * swing + carried) * mutual
    }

    /// The limits as they act on the navigation: rad/s, m/s^2.
    fn limits(&self) -> [f64; 2] {
        [self.limit.gyro, self.limit.accel].map(|limit| f64::from(limit) * f64::from(self.words))
    }

    /// Tilt and heading error of an alignment with a correction in force: rad, and as a ratio of
    /// the change of a velocity to the velocity.
    fn alignment(&self) -> [f64; 2] {
        let [gyro, accel] = self.limits();
        let (sin, cos) = libm::sincos(self.latitude);
        let cos = cos.max(1e-6);
        let drift = SQRT_3 * gyro * 0.5 * ALIGNMENT_S;
        let tilt = SQRT_3 * accel / GRAVITY;
        let turn = SQRT_3 * gyro / (EARTH_RATE * cos);
        let turn = if turn < 0.9 {
            turn / libm::sqrt(1.0 - turn * turn)
        } else {
            2.0
        };
        let heading = turn + tilt * (sin / cos).abs() + drift;
        [tilt + drift, heading.min(2.0)]
    }

    /// [`Self::metres`] at [`TIMES_S`], rounded up. The integrals are constants, so that this takes
    /// few instructions and little code.
    #[must_use]
    pub fn table(&self) -> [u32; 5] {
        let [limit_gyro, limit_accel] = self.limits().map(|limit| limit as f32);
        let [tilt, turn] = self.alignment().map(|error| error as f32);
        let cos = libm::cos(self.latitude) as f32;
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
            let alone = SQRT_3 as f32 * (limit_gyro * gyro + limit_accel * accel);
            let (way, earth) = (self.speed * time, EARTH_RATE as f32 * cos * level);
            // R (1 - cos) is g times the accelerometers' integral
            let carried = turn * libm::sqrtf(way * way + earth * earth);
            let metres = alone + (tilt * GRAVITY as f32 * accel + carried) * mutual;
            // more than the rounding of ten operations; `as` saturates
            libm::ceilf(metres * (1.0 + 2e-6)) as u32
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
            latitude: LATITUDE,
            words: 1.0,
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
            bound(0.0, 1e-3, 10.0).unaligned(t),
            SQRT_3 * 1e-3_f32 as f64 * a
        ));
        let still = bound(1e-8, 0.0, 0.0).unaligned(t);
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
            ErrorBound {
                latitude: -1.2,
                words: 1.25,
                ..bound(4.8e-8, 1e-3, 30.0)
            },
        ] {
            for (got, t) in h.table().into_iter().zip(TIMES_S) {
                let want = h.metres(f64::from(t));
                let got = f64::from(got);
                assert!(
                    got >= want && got <= want * (1.0 + 5e-6) + 1.0,
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
    }

    /// Five times as many words are five times the limit.
    #[test]
    fn the_rate_of_the_words_counts() {
        let configuration = bound(4.8e-8, 1e-3, 30.0);
        let often = ErrorBound {
            words: 5.0,
            ..configuration
        };
        let wide = bound(5.0 * 4.8e-8, 5.0 * 1e-3, 30.0);
        for t in TIMES_S.map(f64::from) {
            assert!((often.metres(t) / wide.metres(t) - 1.0).abs() < 1e-6);
            assert!(often.metres(t) > 4.9 * configuration.metres(t));
        }
    }

    /// An alignment with a gyro's correction east turns the heading by w / (Omega cos phi), and one
    /// of the accelerometers by tan(phi) a / g: both by hand.
    #[test]
    fn the_alignment_by_hand() {
        let of = |gyro, accel, latitude| ErrorBound {
            latitude,
            ..bound(gyro, accel, 50.0)
        };
        // 0.1 deg/h at 45 degrees, earth rate 15.041 deg/h
        let gyro = (0.1f64 / 3600.0).to_radians() as f32;
        let [tilt, heading] = of(gyro, 0.0, 45f64.to_radians()).alignment();
        let want = SQRT_3 * 0.1 / (15.041 * 0.5f64.sqrt());
        let drift = SQRT_3 * f64::from(gyro) * 150.0;
        assert!(
            (heading / (want + drift) - 1.0).abs() < 2e-4,
            "{heading} {want}"
        );
        assert!((tilt / drift - 1.0).abs() < 1e-6);
        // 1 mg at 60 degrees
        let [tilt, heading] = of(0.0, 9.78e-3, LATITUDE).alignment();
        assert!((tilt - SQRT_3 * 1e-3).abs() < 1e-8);
        assert!((heading / tilt - SQRT_3).abs() < 1e-6);
        // at a pole there is no heading, and no heading is worse than the opposite one
        let [_, heading] = of(gyro, 0.0, core::f64::consts::FRAC_PI_2).alignment();
        assert_eq!(heading, 2.0);
    }
}
