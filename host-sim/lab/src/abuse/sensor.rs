//! The sensor: the faults of a case in its errors and in its samples. The navigation computer gets
//! the same samples, with and without the corrections of the device.

use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG_PER_H, UG};
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::imu::world::StartName;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Stream of random numbers of the faults.
const CHANCE: u64 = 42;

/// Faults of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Factor of its white noise, relative to the datasheet.
    Noise(f64),
    /// Additional biases, which change their sign in the middle of the span: deg/h and ug, 1 sigma.
    Inverted([f64; 2]),
    /// Step of its biases, with a random sign for each axis: deg/h and ug.
    Step([f64; 2]),
    /// Drift of its biases in an hour: deg/h and ug.
    Drift([f64; 2]),
    /// Its biases oscillate with these amplitudes and this period: deg/h, ug, s.
    Swings([f64; 3]),
    /// The vertical gyro (deg/s) and the forward accelerometer (g) saturate at this.
    Saturates([f64; 2]),
    /// An axis (0 to 5, gyros first) keeps its value.
    Stuck(usize),
    /// Rates below this, deg/s, are 0.
    DeadBand(f64),
    /// Values are rounded to this rate, deg/s, and specific force, g.
    Coarse([f64; 2]),
    /// An axis (0 to 5) has the wrong sign.
    Negated(usize),
    /// Spikes: their share of the samples, and their size in deg/s for gyros and in mg for
    /// accelerometers.
    Spikes([f64; 2]),
    /// Bias of the gyros by specific force, deg/h/g.
    GSensitivity(f64),
    /// Scale factors are off by this share.
    Scale(f64),
    /// Delay of the accelerometers, samples.
    LateAccel(usize),
    /// The next drive begins with the sensor still warm.
    HotRestart,
}

impl Fault {
    /// Whether it changes the samples, of this drive or of the next one.
    pub(super) fn acts(self, next: bool) -> bool {
        next || self != Self::HotRestart
    }

    /// Whether its effect is permanent: the next drive has the biases of the end of this one.
    pub(super) fn stays(self) -> bool {
        matches!(self, Self::Inverted(_) | Self::Step(_))
    }

    /// Applies it to the simulated sensor of the learning drive or the next one.
    pub(super) fn on_spec(self, spec: &mut ImuSpec, next: bool) {
        match self {
            Self::Noise(factor) => {
                spec.gyro.angle_random_walk_dpsqrth *= factor;
                spec.accel.velocity_random_walk_ugpsqrthz *= factor;
            }
            Self::GSensitivity(size) => spec.gyro.g_sensitivity_dphpg += size,
            Self::HotRestart if next => spec.world.power.start = StartName::Hot,
            _ => {}
        }
    }

    /// Applies it to the increments of a drive, `dt` s each, within a span. `seed` is the unit's,
    /// so that errors of the unit are the same in all its drives.
    pub(super) fn on_samples(self, all: &mut [Increment], dt: f64, span: [f64; 2], seed: u64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(CHANCE);
        let mut three = || Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
        let drawn: [Vector3<f64>; 2] = [three(), three()];
        let [from, to] = span.map(|s| ((s / dt).round() as usize).min(all.len()));
        let middle = from.midpoint(to);
        let of = |[gyro, accel]: [f64; 2], shape: &dyn Fn(&Vector3<f64>) -> Vector3<f64>| {
            let [g, a] = &drawn;
            Increment {
                dtheta: shape(g) * (gyro * DEG_PER_H * dt),
                dv: shape(a) * (accel * UG * dt),
            }
        };
        let signs = |x: &Vector3<f64>| x.map(f64::signum);
        match self {
            Self::Inverted(sigmas) => {
                let bias = of(sigmas, &|x| *x);
                for (k, one) in all.iter_mut().enumerate() {
                    add(one, &bias, if k < middle { 1.0 } else { -1.0 });
                }
            }
            Self::Step(sizes) => {
                let bias = of(sizes, &signs);
                all[from..].iter_mut().for_each(|one| add(one, &bias, 1.0));
            }
            Self::Drift(per_hour) => {
                let bias = of(per_hour, &signs);
                for (k, one) in all[from..].iter_mut().enumerate() {
                    add(one, &bias, k as f64 * dt / 3600.0);
                }
            }
            Self::Swings([gyro, accel, period]) => {
                let bias = of([gyro, accel], &signs);
                for (k, one) in all[from..to].iter_mut().enumerate() {
                    let phase = std::f64::consts::TAU * k as f64 * dt / period;
                    add(one, &bias, phase.sin());
                }
            }
            Self::LateAccel(by) => {
                for k in (from.max(by)..to).rev() {
                    all[k].dv = all[k - by].dv;
                }
            }
            Self::Stuck(axis) => {
                let frozen = all.get(from).copied().unwrap_or_default();
                for one in &mut all[from..to] {
                    *component(one, axis) = *component(&mut { frozen }, axis);
                }
            }
            _ => all[from..to]
                .iter_mut()
                .for_each(|one| self.on_one(one, dt, &mut rng)),
        }
    }

    /// A fault that acts on each sample independently.
    fn on_one(self, one: &mut Increment, dt: f64, rng: &mut ChaCha8Rng) {
        let rate = |deg_s: f64| deg_s.to_radians() * dt;
        let force = |g: f64| g * 9.8 * dt;
        let round = |x: f64, step: f64| (x / step).round() * step;
        match self {
            Self::Saturates([deg_s, g]) => {
                one.dtheta.z = one.dtheta.z.clamp(-rate(deg_s), rate(deg_s));
                one.dv.x = one.dv.x.clamp(-force(g), force(g));
            }
            Self::DeadBand(below) => {
                one.dtheta
                    .apply(|x| *x = if x.abs() < rate(below) { 0.0 } else { *x });
            }
            Self::Coarse([deg_s, g]) => {
                one.dtheta.apply(|x| *x = round(*x, rate(deg_s)));
                one.dv.apply(|x| *x = round(*x, force(g)));
            }
            Self::Negated(axis) => *component(one, axis) *= -1.0,
            Self::Spikes([share, size]) if rng.random_bool(share.clamp(0.0, 1.0)) => {
                let axis = rng.random_range(0..6);
                let spike = if axis < 3 {
                    rate(size)
                } else {
                    force(1e-3 * size)
                };
                let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                *component(one, axis) += sign * spike;
            }
            Self::Scale(by) => {
                one.dtheta *= 1.0 + by;
                one.dv *= 1.0 + by;
            }
            _ => {} // faults of the simulated sensor
        }
    }
}

fn add(to: &mut Increment, bias: &Increment, factor: f64) {
    to.dtheta += bias.dtheta * factor;
    to.dv += bias.dv * factor;
}

/// An axis: 0 to 2 gyros, 3 to 5 accelerometers.
fn component(of: &mut Increment, axis: usize) -> &mut f64 {
    match axis {
        0..3 => &mut of.dtheta[axis],
        _ => &mut of.dv[(axis - 3).min(2)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.01;

    fn constant() -> Vec<Increment> {
        let one = Increment {
            dtheta: Vector3::new(1e-4, -2e-4, 3e-3),
            dv: Vector3::new(0.2, 0.1, -0.098),
        };
        vec![one; 1000]
    }

    fn with(fault: Fault) -> Vec<Increment> {
        let mut all = constant();
        fault.on_samples(&mut all, DT, [2.0, 6.0], 7);
        all
    }

    /// A fault changes the samples in its span as described, and none outside it.
    #[test]
    fn faults_act_in_their_span() {
        let clean = constant();
        for fault in [
            Fault::Saturates([5.0, 1.0]),
            Fault::DeadBand(1.5),
            Fault::Coarse([0.5, 0.05]),
            Fault::Negated(4),
            Fault::Spikes([0.5, 3.0]),
            Fault::Scale(0.01),
            Fault::Swings([1.0, 100.0, 7.0]),
        ] {
            let all = with(fault);
            assert_eq!(all[..200], clean[..200], "{fault:?}");
            assert_eq!(all[600..], clean[600..], "{fault:?}");
            assert_ne!(all[200..600], clean[200..600], "{fault:?}");
        }
        let inverted = with(Fault::Inverted([1.0, 100.0]));
        let [first, last] = [0, 999].map(|k| inverted[k].dtheta - clean[k].dtheta);
        assert!((first + last).norm() < 1e-18 && first.norm() > 0.0);
        let step = with(Fault::Step([2.0, 0.0]));
        let by = (step[500].dtheta - clean[500].dtheta) / DT / DEG_PER_H;
        assert!(by.iter().all(|x| (x.abs() - 2.0).abs() < 1e-6), "{by}");
        assert_eq!(step[150], clean[150]);
        let saturated = with(Fault::Saturates([5.0, 1.0]))[300];
        assert!((saturated.dtheta.z - 5.0_f64.to_radians() * DT).abs() < 1e-12);
        assert_eq!(with(Fault::DeadBand(1.5))[300].dtheta.x, 0.0);
        assert_eq!(with(Fault::Negated(4))[300].dv.y, -0.1);
    }

    #[test]
    fn a_stuck_axis_keeps_its_value() {
        let mut all = constant();
        all.iter_mut()
            .enumerate()
            .for_each(|(k, one)| one.dtheta.z = k as f64);
        Fault::Stuck(2).on_samples(&mut all, DT, [2.0, 6.0], 7);
        assert!((200..600).all(|k| all[k].dtheta.z == 200.0));
        assert_eq!((all[199].dtheta.z, all[600].dtheta.z), (199.0, 600.0));
    }
}
