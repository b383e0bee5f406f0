//! Temperature of the sensor block: first-order heating by its own power, ambient drift, and the
//! difference across it.
//!
//! ```text
//! dT/dt = (ambient(t) + self_heating - T) / tau           T(0) = ambient(0)
//! dG/dt = (d^2 / (2 D) dT/dt - G) / tau_G,                tau_G = d^2 / (pi^2 D)
//! ```
//!
//! T is relative to the calibration temperature. Heat enters at one face. While the whole block
//! warms at dT/dt, the heated face is warmer than the free one by d^2/(2D) dT/dt (steady solution
//! of the heat equation for a slab of thickness d). That difference G builds up with the slowest
//! mode of the slab, tau_G. The test compares with the heat equation, solved in slices.

use super::spec::BlockSpec;
use super::world::History;
use crate::inertial::session::Temperature;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Diffusivity of Zerodur, m2/s: conductivity 1.46 W/(m K) over density 2530 kg/m3 and heat
/// capacity 820 J/(kg K) (Schott).
pub const DIFFUSIVITY: f64 = 1.46 / (2530.0 * 820.0);

/// The sensor block at one turn-on.
#[derive(Debug, Clone)]
pub struct Block {
    ambient: f64,
    ramp: f64, // K/s
    self_heating: f64,
    time: f64,
    gradient_gain: f64, // K per K/s
    gradient_time: f64,
    now: Temperature,
}

impl Block {
    /// Starts at the ambient temperature, plus `left` of its own heating from before. Offset and
    /// ramp of the ambient are drawn from `turn_on`; `outside` K comes from the scenario.
    #[must_use]
    pub fn new(spec: &BlockSpec, turn_on: &mut ChaCha8Rng, outside: f64, left: f64) -> Self {
        let mut draw = |sigma: f64| -> f64 {
            let z: f64 = StandardNormal.sample(turn_on);
            z * sigma
        };
        let ambient = draw(spec.ambient_offset_k);
        let ramp = draw(spec.ambient_ramp_kph) / 3600.0;
        let thickness = 1e-3 * spec.thickness_mm;
        let diffusion = thickness * thickness / DIFFUSIVITY;
        Self {
            ambient,
            ramp,
            self_heating: spec.self_heating_k,
            time: spec.heating_time_s,
            gradient_gain: diffusion / 2.0,
            gradient_time: diffusion / (std::f64::consts::PI * std::f64::consts::PI),
            now: Temperature {
                offset: ambient + outside + spec.self_heating_k * left,
                rate: spec.self_heating_k * (1.0 - left) / spec.heating_time_s,
                gradient: 0.0,
            },
        }
    }

    /// Present temperature.
    #[must_use]
    pub fn now(&self) -> Temperature {
        self.now
    }

    /// Remaining self-heating of the block after a history, K.
    #[must_use]
    pub fn heated(&self, history: &History) -> f64 {
        self.self_heating * history.left(self.time)
    }

    /// Ambient temperature that was drawn for this turn-on, `t` seconds after power-on, K.
    #[must_use]
    pub fn ambient(&self, t: f64) -> f64 {
        self.ambient + self.ramp * t
    }

    /// Advances by `dt` seconds to the time `t` after power-on, with `outside` K added to the
    /// ambient. This is exact for a constant target.
    pub fn step(&mut self, t: f64, dt: f64, outside: f64) {
        let target = self.ambient(t) + self.self_heating + outside;
        self.now.offset = target + (self.now.offset - target) * (-dt / self.time).exp();
        self.now.rate = (target - self.now.offset) / self.time;
        let steady = self.gradient_gain * self.now.rate;
        let keep = if self.gradient_time > 0.0 {
            (-dt / self.gradient_time).exp()
        } else {
            0.0
        };
        self.now.gradient = steady + (self.now.gradient - steady) * keep;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn block(spec: &BlockSpec) -> Block {
        Block::new(spec, &mut ChaCha8Rng::seed_from_u64(3), 0.0, 0.0)
    }

    #[test]
    fn it_heats_exponentially_and_follows_the_ambient_late() {
        let spec = BlockSpec {
            self_heating_k: 20.0,
            ..BlockSpec::default()
        };
        let mut warm = block(&spec);
        for t in 1..=900 {
            warm.step(f64::from(t), 1.0, 0.0);
        }
        assert!((warm.now().offset - 20.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-9);
        assert!((warm.now().rate - 20.0 / 900.0 * (-1.0f64).exp()).abs() < 1e-9);
        let mut ramp = block(&BlockSpec {
            ambient_ramp_kph: 6.0,
            ..BlockSpec::default()
        });
        for t in 1..=20_000 {
            ramp.step(f64::from(t), 1.0, 0.0);
        }
        // finally the block lags the ambient by rate times time constant
        let lag = ramp.ramp * 20_000.0 - ramp.now().offset;
        assert!(
            (lag / (ramp.ramp * 900.0) - 1.0).abs() < 2e-3 && ramp.ramp != 0.0,
            "{lag}"
        );
    }

    #[test]
    fn the_gradient_is_that_of_the_heat_equation() {
        let spec = BlockSpec {
            self_heating_k: 20.0,
            ..BlockSpec::default()
        };
        let (mut fast, slices) = (block(&spec), 40);
        // a slab of 40 slices; the flow into the heated face raises the mean temperature as in the
        // block model
        let thickness = 1e-3 * spec.thickness_mm;
        let dx = thickness / slices as f64;
        let dt = 0.2 * dx * dx / DIFFUSIVITY;
        let mut slab = vec![0.0; slices];
        let (mut t, mut worst, mut peak) = (0.0, 0.0_f64, 0.0_f64);
        let mut next = 1.0;
        while t < 3600.0 {
            let rate = 20.0 / 900.0 * (-t / 900.0_f64).exp();
            let mut change = vec![0.0; slices];
            for i in 0..slices - 1 {
                let flow = DIFFUSIVITY * (slab[i] - slab[i + 1]) / (dx * dx) * dt;
                change[i] -= flow;
                change[i + 1] += flow;
            }
            change[0] += rate * thickness / dx * dt;
            slab.iter_mut().zip(&change).for_each(|(x, c)| *x += c);
            t += dt;
            if t >= next {
                fast.step(next, 1.0, 0.0);
                next += 1.0;
                let across = slab[0] - slab[slices - 1];
                peak = peak.max(across);
                worst = worst.max((across - fast.now().gradient).abs());
            }
        }
        // the higher modes, which the fast model leaves out, matter only in the first minutes
        assert!(
            peak > 10.0 && worst < 0.2 * peak,
            "peak {peak} K, off by at most {worst} K"
        );
    }
}
