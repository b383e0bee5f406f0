use super::*;
use crate::sample::Lsb;
use core::f64::consts::PI;
use earth::Local;

pub(crate) const LSB: Lsb = Lsb {
    rad: 1e-7,
    mps: 1e-5,
};
const NOISE: Noise = Noise {
    gyro: 1e-6,
    accel: 1e-4,
};
pub(crate) const SAMPLE_S: f64 = 0.005;

pub(crate) fn state(latitude: f64, velocity: V) -> State {
    State {
        position: Position {
            latitude,
            longitude: 0.3,
            height: 200.0,
        },
        velocity,
        q_bn: [1.0, 0.0, 0.0, 0.0],
    }
}

fn navigator(state: State) -> Navigator {
    Navigator::new(Config::new(LSB, SAMPLE_S, NOISE), state).unwrap()
}

/// Samples of a body that keeps its attitude to north, east and down and its velocity. The
/// remainder of rounding to counts is carried to the next sample.
#[derive(Default)]
pub(crate) struct Steady {
    due: [V; 2],
}

impl Steady {
    pub(crate) fn sample(&mut self, at: &State) -> Counts {
        let here = Local::at(at.position.latitude, at.position.height);
        let v = at.velocity;
        let east = v[1] / here.n_h;
        let omega_en = [east, -v[0] / here.m_h, -east * here.sin / here.cos];
        let omega_in = add(here.omega_ie(), omega_en);
        let coriolis = cross(add(here.omega_ie(), omega_in), v);
        let force = add(coriolis, [0.0, 0.0, -here.g]);
        let mut whole = |k: usize, rate: V, lsb: f64| -> [i32; 3] {
            core::array::from_fn(|i| {
                self.due[k][i] += rate[i] * SAMPLE_S / lsb;
                let count = self.due[k][i].round();
                self.due[k][i] -= count;
                count as i32
            })
        };
        Counts {
            dtheta: whole(0, omega_in, LSB.rad),
            dv: whole(1, force, LSB.mps),
        }
    }
}

/// 2^-80 in a fixed-point sum without rounding.
fn exactly(x: f64) -> i128 {
    (x * (1_u128 << 80) as f64) as i128
}

/// Over 24 h at 200 Hz position is the sum of its increments to far less than a millimetre; the
/// reference adds them up in 128-bit integers. Velocity and height are held by corrections each
/// second, as fixes do.
#[test]
fn a_day_of_rounding_is_below_a_millimetre() {
    for (latitude, longitude, velocity, limit) in [
        (0.8, 0.3, [0.0; 3], 1e-5),
        (0.8, 0.3, [-1.5, 25.0, 0.0], 1e-4),
        (0.0, 3.1, [1.5, 25.0, 0.0], 1e-4),
        (-1.396, 2.0, [-1.5, 25.0, 0.0], 1e-4),
    ] {
        let mut start = state(latitude, velocity);
        start.position.longitude = longitude;
        let mut device = navigator(start);
        let mut steady = Steady { due: [[0.0; 3]; 2] };
        let p = start.position;
        let mut exact = [p.latitude, p.longitude, p.height].map(exactly);
        let mut worst = 0.0_f64;
        for _ in 0..86_400 {
            let samples: [Counts; 10] = core::array::from_fn(|_| steady.sample(&device.state()));
            let at = device.state().position;
            let radius = Local::at(at.latitude, at.height).m_h;
            for _ in 0..20 {
                let before = device.state();
                samples.iter().for_each(|sample| device.sample(sample));
                let (v0, v1) = (before.velocity, device.state().velocity);
                let tau = 10.0 * SAMPLE_S;
                let here = Local::at(
                    before.position.latitude + v0[0] * (0.5 * tau / radius),
                    before.position.height - v0[2] * (0.5 * tau),
                );
                let moved = scale(add(v0, v1), 0.5 * tau);
                exact[0] += exactly(moved[0] / here.m_h);
                exact[1] += exactly(moved[1] / (here.n_h * here.cos));
                exact[2] -= exactly(moved[2]);
            }
            let State {
                position: p,
                velocity: v,
                ..
            } = device.state();
            let here = Local::at(p.latitude, p.height);
            let off = |got: f64, exact: i128| (exactly(got) - exact) as f64 / (1_u128 << 80) as f64;
            let metres = [
                off(p.latitude, exact[0]) * here.m_h,
                wrapped(off(p.longitude, exact[1])) * here.n_h * here.cos,
                off(p.height, exact[2]),
            ];
            worst = metres.iter().fold(worst, |w, m| w.max(m.abs()));
            let dv: [f32; 3] = core::array::from_fn(|i| (v[i] - velocity[i]) as f32);
            assert!(device.feed_back(&[0.0, 0.0, 0.0, dv[0], dv[1], dv[2], 0.0, 0.0, 0.0]));
        }
        assert_eq!(device.faults(), Faults::default());
        let far = device.state().position.ned_from(&start.position);
        assert!(velocity[1] == 0.0 || far[0].abs() > 1e5, "{far:?}");
        println!("24 h at {latitude} {velocity:?} m/s: {worst:e} m");
        assert!(worst < limit, "{velocity:?}: {worst} m");
    }
}

/// 24 h of pieces with a constant turn of body and navigation frame, against the one turn that they
/// are together.
#[test]
fn a_day_of_rounding_leaves_the_attitude() {
    let (phi, zeta) = ([3e-3, -2e-3, 4e-2], [2e-6, -1e-6, 3e-6]);
    let start = renormalised(renormalised([0.8, 0.36, -0.48, 0.0]));
    let mut q = start.map(|x| fixed::from_f64(x, ANGLE));
    let [body, frame] = [phi, zeta].map(|v| v.map(|x| fixed::from_f64(x, ANGLE)));
    let [phi, zeta] = [body, frame].map(|v| v.map(|x| fixed::to_f64(x, ANGLE)));
    let pieces = 1_728_000;
    for _ in 0..pieces {
        q = solution::turned(q, body, frame);
    }
    let q = q.map(|x| fixed::to_f64(x, ANGLE));
    let n = f64::from(pieces);
    let whole = product(
        product(vector::from_rotvec(scale(zeta, -n)), start),
        vector::from_rotvec(scale(phi, n)),
    );
    let [w, x, y, z] = whole;
    let [_, a, b, c] = product([w, -x, -y, -z], q);
    let off = 2.0 * libm::sqrt(a * a + b * b + c * c);
    println!("24 h of turns: {off:e} rad");
    assert!(off < 1e-9, "{off:e} rad");
}

/// After a long way without fixes the estimate is tens of kilometres off. What the innovation finds
/// is taken out to the centimetre, however far it is.
#[test]
fn a_correction_of_many_kilometres_leaves_nothing() {
    for latitude in [-1.2, 0.1, 0.8, 1.3] {
        for off in [[3e4, -8e4, 500.0], [-9e4, 9e4, -2000.0], [5e3, 0.0, 0.0]] {
            let mut estimate = state(latitude, [30.0, 10.0, 0.0]);
            let fix = Fix {
                position: estimate.position,
                velocity: estimate.velocity,
                ..Fix::EMPTY
            };
            estimate.position = estimate.position.displaced(off);
            let mut navigator = navigator(estimate);
            let Innovation { position, velocity } = navigator.innovation(&fix, 0.0);
            let ([a, b, c], [d, e, f]) = (velocity, position);
            assert!(navigator.feed_back(&[0.0, 0.0, 0.0, a, b, c, d, e, f]));
            let left = navigator.state().position.ned_from(&fix.position);
            // f32 holds 90 km to 8 mm
            let all = left.iter().all(|left| left.abs() < 0.01);
            assert!(all, "{latitude} {off:?}: {left:?}");
        }
    }
}

#[test]
fn feedback_takes_out_what_innovation_finds() {
    // close to the date line, to both sides of which the error reaches
    let mut at = state(-0.4, [3.0, -2.0, 0.5]);
    at.position.longitude = PI - 1e-6;
    let mut device = navigator(at);
    let error = [1e-3, -2e-3, 3e-3, 0.5, -0.25, 0.125, 12.0, -30.0, 4.0];
    assert!(device.feed_back(&error.map(|e: f32| -e)));
    assert!(device.state().position.longitude > 0.0);
    let fix = Fix {
        position: at.position,
        velocity: at.velocity,
        ..Fix::EMPTY
    };
    let found = device.innovation(&fix, 0.0);
    for i in 0..3 {
        assert!((found.velocity[i] - error[3 + i]).abs() < 1e-5, "{found:?}");
        assert!((found.position[i] - error[6 + i]).abs() < 1e-3, "{found:?}");
    }
    assert!(device.feed_back(&error));
    let found = device.innovation(&fix, 0.0);
    assert!(found.position.iter().all(|x| x.abs() < 1e-3), "{found:?}");
    let east = Fix {
        position: at.position.displaced([0.0, 40.0, 0.0]),
        velocity: at.velocity,
        ..Fix::EMPTY
    };
    assert!(east.position.longitude < 0.0);
    let found = device.innovation(&east, 0.0);
    assert!((found.position[1] + 40.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn an_old_fix_is_compared_with_where_one_was() {
    let start = state(0.8, [10.0, 0.0, 0.0]);
    let mut device = navigator(start);
    // 2 m/s2 to the north
    let mut sample = Steady { due: [[0.0; 3]; 2] }.sample(&start);
    sample.dv[0] += (2.0 * SAMPLE_S / LSB.mps) as i32;
    for _ in 0..20 {
        device.sample(&sample);
    }
    let fix = Fix {
        position: start.position,
        velocity: start.velocity,
        ..Fix::EMPTY
    };
    let found = device.innovation(&fix, 0.1);
    for x in found.position.iter().chain(&found.velocity) {
        assert!(x.abs() < 2e-3, "{found:?}");
    }
    assert!(device.innovation(&fix, f32::NAN).position[0].is_finite());
    assert!(device.innovation(&fix, -3.0).position[0] > 1.0);
}

/// An estimate given to the navigator and the same error added to the samples leave the same
/// solution.
#[test]
fn estimates_are_taken_out_of_the_words() {
    let start = state(0.8, [0.0; 3]);
    let (mut clean, mut wrong) = (navigator(start), navigator(start));
    let error = [50, -30, 20]; // counts a sample
    let rate = error.map(|e| (f64::from(e) * LSB.rad / SAMPLE_S) as f32);
    let force = error.map(|e| (f64::from(e) * LSB.mps / SAMPLE_S) as f32);
    assert!(wrong.set_estimate(rate, force));
    let sample = Steady { due: [[0.0; 3]; 2] }.sample(&start);
    let off = Counts {
        dtheta: core::array::from_fn(|i| sample.dtheta[i] + error[i]),
        dv: core::array::from_fn(|i| sample.dv[i] + error[i]),
    };
    for _ in 0..12_000 {
        clean.sample(&sample);
        wrong.sample(&off);
    }
    let apart = wrong.state().position.ned_from(&clean.state().position);
    assert!(apart.iter().all(|x| x.abs() < 1e-3), "{apart:?}");
}

#[test]
fn a_transition_starts_anew_and_counts_a_piece_in_progress() {
    let mut device = navigator(state(0.8, [0.0; 3]));
    for _ in 0..23 {
        device.sample(&Counts::default());
    }
    let first = device.take_transition();
    assert!((first.time - 0.115).abs() < 1e-6);
    let none = device.take_transition();
    assert!(none.time == 0.0 && none.gamma == [[0.0; 6]; 9] && none.q == [[0.0; 9]; 9]);
    for (i, row) in none.phi.iter().enumerate() {
        assert!(
            row.iter()
                .enumerate()
                .all(|(j, x)| *x == f32::from(u8::from(i == j)))
        );
    }
}

/// For every input the solution stays finite and the faults report what was wrong.
#[test]
fn nothing_poisons_the_solution() {
    let start = state(0.8, [0.0; 3]);
    let finite_all = |device: &mut Navigator| {
        let t = device.take_transition();
        let State {
            position: p,
            velocity: v,
            q_bn: q,
        } = device.state();
        assert!(
            [p.latitude, p.longitude, p.height]
                .iter()
                .chain(&v)
                .chain(&q)
                .all(|x| x.is_finite())
        );
        assert!(
            t.phi
                .as_flattened()
                .iter()
                .chain(t.q.as_flattened())
                .all(|x| x.is_finite())
        );
        assert!(t.gamma.as_flattened().iter().all(|x| x.is_finite()));
    };
    let mut device = navigator(start);
    for bad in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX] {
        assert!(!device.set_estimate([bad, 0.0, 0.0], [0.0; 3]));
        assert!(!device.set_estimate([0.0; 3], [0.0, bad, 0.0]));
        for i in 0..9 {
            let mut error = [0.0; 9];
            error[i] = bad;
            assert!(!device.feed_back(&error), "{i} {bad}");
        }
    }
    assert_eq!(device.faults().inputs, 4 * 11);
    assert_eq!(device.state(), start);
    for extreme in [i32::MAX, i32::MIN, i32::MIN + 1] {
        device.sample(&Counts {
            dtheta: [extreme; 3],
            dv: [extreme; 3],
        });
    }
    assert_eq!(device.faults().samples, 3);
    finite_all(&mut device);
    // as much as is believed, for half an hour: away with it
    for k in 0..360_000 {
        device.sample(&Counts {
            dtheta: [4_900_000, -3_000_000, 100 * (k % 7)],
            dv: [900_000, -900_000, 900_000],
        });
    }
    finite_all(&mut device);
    assert!(device.faults().lost);
    let stopped = device.state();
    device.sample(&Counts::default());
    assert!(device.state() == stopped && device.take_transition().time == 0.0);
    // over the pole
    let mut device = navigator(state(1.5705, [50.0, 0.0, 0.0]));
    let sample = Steady { due: [[0.0; 3]; 2] }.sample(&device.state());
    for _ in 0..200_000 {
        device.sample(&sample);
    }
    finite_all(&mut device);
    assert!(device.faults().lost);
}

#[test]
fn wrong_configurations_name_the_parameter() {
    let good = Config::new(LSB, SAMPLE_S, NOISE);
    assert_eq!(good.piece_samples, 10);
    assert_eq!(Config::new(LSB, f64::NAN, NOISE).piece_samples, 1);
    let start = state(0.8, [0.0; 3]);
    let of = |config: Config, state: State| Navigator::new(config, state).err();
    assert_eq!(of(good, start), None);
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let lsb = |rad, mps| Config {
            lsb: Lsb { rad, mps },
            ..good
        };
        assert_eq!(of(lsb(bad, 1e-5), start), Some(ConfigError::Lsb));
        assert_eq!(of(lsb(1e-7, bad), start), Some(ConfigError::Lsb));
        assert_eq!(
            of(
                Config {
                    sample_s: bad,
                    ..good
                },
                start
            ),
            Some(ConfigError::SamplePeriod)
        );
    }
    assert_eq!(
        of(
            Config {
                piece_samples: 0,
                ..good
            },
            start
        ),
        Some(ConfigError::PieceSamples)
    );
    for bad in [-1e-9, f32::NAN, f32::INFINITY] {
        let noise = Noise { gyro: bad, ..NOISE };
        assert_eq!(
            of(Config { noise, ..good }, start),
            Some(ConfigError::Noise)
        );
    }
    let error = Some(ConfigError::State);
    assert_eq!(of(good, state(0.5 * PI, [0.0; 3])), error);
    assert_eq!(of(good, state(f64::NAN, [0.0; 3])), error);
    assert_eq!(of(good, state(0.8, [0.0, 2e4, 0.0])), error);
    assert_eq!(
        of(
            good,
            State {
                q_bn: [0.0; 4],
                ..start
            }
        ),
        error
    );
    assert_eq!(
        of(
            good,
            State {
                q_bn: [f64::NAN; 4],
                ..start
            }
        ),
        error
    );
}
