//! Vibration of suspension and road. It has a few modes. Each is a sinusoid in heave, roll, pitch
//! and yaw with amplitudes and phases of its own, so that the axes cause coning and sculling as in
//! a car.

use super::NODES;
use super::dual::Dual;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Share of the road vibration that remains at standstill, from engine and people (assumed).
pub(super) const IDLE: f64 = 0.04;
/// Speed at which the vibration has half its full amplitude, m/s (assumed).
pub(super) const ROAD_SPEED: f64 = 8.0;

/// The part of one mode in one degree of freedom: `amplitude * sin(omega t + phase)` = `s sin + c
/// cos`.
#[derive(Debug, Clone, Copy, Default)]
struct Share {
    s: f64,
    c: f64,
}

impl Share {
    fn new(amplitude: f64, phase: f64) -> Self {
        Self {
            s: amplitude * phase.cos(),
            c: amplitude * phase.sin(),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Mode {
    omega: f64,
    heave: Share,
    rotation: [Share; 3],
    // sine and cosine at the present base time
    sin: f64,
    cos: f64,
}

/// Value and time derivative of the four degrees of freedom at full road amplitude.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shake {
    /// Vertical velocity (down), m/s, and its derivative, m/s2.
    pub heave: [f64; 2],
    /// Roll, pitch, yaw angle, rad.
    pub angle: [f64; 3],
    /// Their rates, rad/s.
    pub rate: [f64; 3],
}

/// Frequencies in Hz with vertical acceleration amplitude in m/s2 and angular amplitude in rad, 1
/// sigma of the draw. The values are assumed, of the size found on passenger cars: body bounce and
/// pitch near 1.5 Hz, wheel hop near 11 Hz, engine near 24 Hz.
const BANDS: [(f64, f64, f64); 8] = [
    (0.35, 0.03, 2.0e-3),
    (1.1, 0.35, 2.5e-3),
    (1.7, 0.45, 2.0e-3),
    (2.9, 0.25, 6.0e-4),
    (5.2, 0.25, 1.5e-4),
    (10.5, 0.50, 4.0e-5),
    (13.0, 0.30, 2.0e-5),
    (24.0, 0.08, 4.0e-6),
];

/// The vibration of one vehicle on one road.
#[derive(Debug, Clone)]
pub struct Vibration {
    modes: Vec<Mode>,
}

impl Vibration {
    /// Draws the modes' frequencies, amplitudes and phases.
    #[must_use]
    pub fn new(rng: &mut ChaCha8Rng, scale: f64) -> Self {
        let modes = BANDS
            .iter()
            .map(|&(hz, accel, angle)| {
                let omega = std::f64::consts::TAU * hz * rng.random_range(0.9..1.1);
                let mut share = |amplitude: f64| {
                    let a = amplitude * rng.random_range(0.6..1.4) * scale;
                    Share::new(a, rng.random_range(0.0..std::f64::consts::TAU))
                };
                let heave = share(accel / omega);
                let rotation = [share(angle), share(angle), share(0.3 * angle)];
                Mode {
                    omega,
                    heave,
                    rotation,
                    sin: 0.0,
                    cos: 1.0,
                }
            })
            .collect();
        Self { modes }
    }

    /// Sets the base time to `t` s. [`Self::at`] gives values shortly after it.
    pub fn rebase(&mut self, t: f64) {
        for m in &mut self.modes {
            (m.sin, m.cos) = (m.omega * t).sin_cos();
        }
    }

    /// Advances the base time by that of the rotor. Rounding errors accumulate by 1e-16 a call, so
    /// `rebase` must be called about every second.
    pub fn turn(&mut self, rotor: &[(f64, f64)]) {
        for (m, (rs, rc)) in self.modes.iter_mut().zip(rotor) {
            (m.sin, m.cos) = (m.sin * rc + m.cos * rs, m.cos * rc - m.sin * rs);
        }
    }

    /// The change of phase of every mode over `tau` s. It is computed in advance for the quadrature
    /// nodes and for a whole sample period.
    #[must_use]
    pub fn rotor(&self, tau: f64) -> Vec<(f64, f64)> {
        self.modes
            .iter()
            .map(|m| (m.omega * tau).sin_cos())
            .collect()
    }

    /// Values at the base time plus the time of the rotor.
    #[must_use]
    pub fn at(&self, rotor: &[(f64, f64)]) -> Shake {
        let mut out = Shake::default();
        for (m, (rs, rc)) in self.modes.iter().zip(rotor) {
            let s = m.sin * rc + m.cos * rs;
            let c = m.cos * rc - m.sin * rs;
            out.heave[0] += m.heave.s * s + m.heave.c * c;
            out.heave[1] += m.omega * (m.heave.s * c - m.heave.c * s);
            for i in 0..3 {
                let a = &m.rotation[i];
                out.angle[i] += a.s * s + a.c * c;
                out.rate[i] += m.omega * (a.s * c - a.c * s);
            }
        }
        out
    }
}

/// The vibration at the sample times and quadrature nodes of a motion.
#[derive(Debug, Clone)]
pub(super) struct Shaker {
    vibration: Vibration,
    /// From the start of a sample to its start, and to the quadrature nodes.
    rotors: [Vec<(f64, f64)>; 4],
    /// Over a whole sample.
    sample: Vec<(f64, f64)>,
}

impl Shaker {
    /// Draws a vibration of this scale for samples of `dt` s.
    pub(super) fn new(rng: &mut ChaCha8Rng, scale: f64, dt: f64) -> Self {
        let vibration = Vibration::new(rng, scale);
        let [a, b, c] = NODES;
        Self {
            rotors: [0.0, a * dt, b * dt, c * dt].map(|tau| vibration.rotor(tau)),
            sample: vibration.rotor(dt),
            vibration,
        }
    }

    /// The next sample starts at `t`. At a whole second the rounding errors end.
    pub(super) fn begin(&mut self, t: f64, second: bool) {
        if second {
            self.vibration.rebase(t);
        } else {
            self.vibration.turn(&self.sample);
        }
    }

    /// Values at the sample's start (0) or a node (1 to 3).
    pub(super) fn at(&self, node: usize) -> Shake {
        self.vibration.at(&self.rotors[node])
    }

    /// Values at a speed over ground, m/s, >= 0: nearly none at rest.
    pub(super) fn riding(&self, node: usize, speed: Dual) -> Ride {
        let shake = self.at(node);
        // speed / (speed + ROAD_SPEED)
        let below = (speed.value + ROAD_SPEED).recip();
        let road = Dual::new(speed.value * below, ROAD_SPEED * below * below * speed.rate);
        let share = road * (1.0 - IDLE) + Dual::from(IDLE);
        Ride {
            heave: Dual::new(shake.heave[0], shake.heave[1]) * share,
            angle: [0, 1, 2].map(|i| Dual::new(shake.angle[i], shake.rate[i]) * share),
        }
    }
}

/// Vertical velocity (down), m/s, and roll, pitch, yaw angle, rad.
pub(super) struct Ride {
    pub(super) heave: Dual,
    pub(super) angle: [Dual; 3],
}
