//! The device's navigator (`firmware::nav`) compared with the f64 navigator of the desktop, over
//! the same counts.

use super::ecef::EcefReference;
use firmware::fix::Position;
use firmware::nav::{self, Navigator, State, Transition};
use firmware::sample::{Counts, Lsb};
use host_core::inertial::counts::quantise;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::{Block, Linearised, Noise, Prior};
use host_core::inertial::sins::{Increment, NavState, Sins};
use host_core::inertial::units::{ARCSEC, DEG_PER_H, UG};
use host_core::simulator::truth::{DriveConfig, Truth, random_drive};
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const LSB: Lsb = Lsb {
    rad: 0.1 * ARCSEC,
    mps: 125.0 * UG,
};
const NOISE: Noise = Noise {
    gyro: 1.4e-6,
    accel: 2e-4,
};

const START: Geodetic = Geodetic {
    lat: 0.55,
    lon: 1.9,
    h: 100.0,
};

fn drive(seconds: f64, dt: f64, seed: u64) -> Truth {
    drive_from(START, seconds, dt, seed)
}

fn drive_from(start: Geodetic, seconds: f64, dt: f64, seed: u64) -> Truth {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let segments = random_drive(seconds, &mut rng);
    let config = DriveConfig {
        segments: &segments,
        start,
        heading: 0.4,
        dt,
        vibration: 1.0,
    };
    Truth::new(&config, &mut rng)
}

fn device_state(nav: &NavState) -> State {
    let q = nav.q_bn.quaternion();
    State {
        position: Position {
            latitude: nav.position.lat,
            longitude: nav.position.lon,
            height: nav.position.h,
        },
        velocity: nav.velocity.into(),
        q_bn: [q.w, q.i, q.j, q.k],
    }
}

fn desktop_state(state: &State) -> NavState {
    let Position {
        latitude,
        longitude,
        height,
    } = state.position;
    let [w, x, y, z] = state.q_bn;
    NavState {
        position: Geodetic {
            lat: latitude,
            lon: longitude,
            h: height,
        },
        velocity: Vector3::from(state.velocity),
        q_bn: UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)),
    }
}

fn navigator(nav: &NavState, dt: f64) -> Navigator {
    let noise = nav::Noise {
        gyro: NOISE.gyro as f32,
        accel: NOISE.accel as f32,
    };
    Navigator::new(nav::Config::new(LSB, dt, noise), device_state(nav)).unwrap()
}

/// The increment of a sample without the errors.
fn corrected(counts: &Counts, errors: &[[f32; 3]; 2], dt: f64) -> Increment {
    let [gyro, accel] = errors.map(|e| Vector3::from(e.map(f64::from)) * dt);
    Increment {
        dtheta: Vector3::from(counts.dtheta.map(f64::from)) * LSB.rad - gyro,
        dv: Vector3::from(counts.dv.map(f64::from)) * LSB.mps - accel,
    }
}

/// Largest differences of position (m), velocity (m/s) and attitude (rad) over a drive, compared
/// every second.
fn differences(seconds: f64, dt: f64, errors: [[f32; 3]; 2], seed: u64) -> [f64; 3] {
    let truth = drive(seconds, dt, seed);
    let counts = quantise(&truth.increments, &LSB).unwrap();
    let mut sins = Sins::new(truth.epochs[0]);
    let mut device = navigator(&truth.epochs[0], dt);
    assert!(device.set_estimate(errors[0], errors[1]));
    let mut greatest = [0.0_f64; 3];
    for second in counts.chunks_exact(truth.samples_per_epoch) {
        for increment in second {
            sins.step(&corrected(increment, &errors, dt), dt);
            device.sample(increment);
        }
        let nav = desktop_state(&device.state());
        let now = [
            nav.position.ned_from(&sins.nav.position).norm(),
            (nav.velocity - sins.nav.velocity).norm(),
            nav.q_bn.angle_to(&sins.nav.q_bn),
        ];
        for (g, n) in greatest.iter_mut().zip(now) {
            *g = g.max(n);
        }
    }
    assert_eq!(device.faults(), nav::Faults::default());
    greatest
}

#[test]
fn twenty_two_minutes_free_inertial_end_at_the_same_place() {
    let errors = [
        [0.3, -0.4, 0.2].map(|e| (e * DEG_PER_H) as f32),
        [300.0, -500.0, 200.0].map(|e| (e * UG) as f32),
    ];
    for (dt, errors) in [
        (0.005, [[0.0; 3]; 2]),
        (0.005, errors),
        (0.01, [[0.0; 3]; 2]),
        (0.0005, [[0.0; 3]; 2]),
    ] {
        let got = differences(1320.0, dt, errors, 7);
        println!("{dt} {got:?}");
        assert!(got[0] < 0.05 && got[1] < 1e-3 && got[2] < 1e-7, "{got:?}");
    }
}

/// 22 min from the equator to 80 deg, in both hemispheres and over the date line, against the
/// navigator of the desktop and against the one in ECEF, which shares no formula with either.
#[test]
fn every_place_is_navigated_alike() {
    let deg = std::f64::consts::PI / 180.0;
    let dt = 0.005;
    for (lat, lon, seed) in [
        (0.0, 179.9999, 11),
        (45.0, -179.9999, 12),
        (-45.0, 20.0, 13),
        (80.0, 179.9999, 14),
        (-80.0, -60.0, 15),
    ] {
        let start = Geodetic {
            lat: lat * deg,
            lon: lon * deg,
            h: 100.0,
        };
        let truth = drive_from(start, 1320.0, dt, seed);
        let counts = quantise(&truth.increments, &LSB).unwrap();
        let increments: Vec<Increment> = counts
            .iter()
            .map(|counts| corrected(counts, &[[0.0; 3]; 2], dt))
            .collect();
        let mut sins = Sins::new(truth.epochs[0]);
        let mut ecef = EcefReference::new(&truth.epochs[0]);
        let mut device = navigator(&truth.epochs[0], dt);
        let mut longitudes = [f64::MAX, f64::MIN];
        for (increment, counts) in increments.iter().zip(&counts) {
            sins.step(increment, dt);
            device.sample(counts);
            let now = sins.nav.position.lon.rem_euclid(std::f64::consts::TAU);
            longitudes = [longitudes[0].min(now), longitudes[1].max(now)];
        }
        ecef.run(&increments, dt);
        assert_eq!(device.faults(), nav::Faults::default());
        let nav = desktop_state(&device.state());
        let apart = [&sins.nav, &ecef.nav()].map(|other| {
            [
                nav.position.ned_from(&other.position).norm(),
                (nav.velocity - other.velocity).norm(),
                nav.q_bn.angle_to(&other.q_bn),
            ]
        });
        let between = sins.nav.position.ned_from(&ecef.nav().position).norm();
        println!(
            "{lat} {lon}: sins {:?}, ecef {:?}, between {between}",
            apart[0], apart[1]
        );
        if lon.abs() > 179.0 {
            let half = std::f64::consts::PI;
            assert!(
                longitudes[0] < half && longitudes[1] > half,
                "{longitudes:?}"
            );
        }
        for [position, velocity, attitude] in apart {
            assert!(
                position < 0.05 && velocity < 1e-3 && attitude < 1e-6,
                "{apart:?}"
            );
        }
    }
}

/// The linearisation over one block and then another.
fn composed(first: &Block, then: &Block) -> Block {
    Block {
        phi: then.phi * first.phi,
        gamma: then.phi * first.gamma + then.gamma,
        q: then.phi * first.q * then.phi.transpose() + then.q,
        time: first.time + then.time,
    }
}

/// Largest element of a 3 x 3 block.
fn greatest(of: impl Fn(usize, usize) -> f64) -> f64 {
    (0..9).map(|k| of(k / 3, k % 3).abs()).fold(0.0, f64::max)
}

/// Largest differences of Phi and Gamma, by the largest element of the 3 x 3 block, and of Q by the
/// product of the standard deviations.
fn relative(got: &Transition, want: &Block) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for row in [0, 3, 6] {
        for column in [0, 3, 6] {
            let off = |i: usize, j: usize| {
                f64::from(got.phi[row + i][column + j]) - want.phi[(row + i, column + j)]
            };
            let whole = greatest(|i, j| want.phi[(row + i, column + j)]);
            worst[0] = worst[0].max(greatest(off) / whole);
            let off = |i: usize, j: usize| {
                let scale = want.q[(row + i, row + i)] * want.q[(column + j, column + j)];
                (f64::from(got.q[row + i][column + j]) - want.q[(row + i, column + j)])
                    / scale.sqrt()
            };
            worst[2] = worst[2].max(greatest(off));
        }
        for column in [0, 3] {
            let off = |i: usize, j: usize| {
                f64::from(got.gamma[row + i][column + j]) - want.gamma[(row + i, column + j)]
            };
            let whole = greatest(|i, j| want.gamma[(row + i, column + j)]);
            // the reference does not model the effect of an acceleration on the attitude within a
            // sample: half a sample of a second or more
            let share = if (row, column) == (0, 3) { 0.1 } else { 1.0 };
            worst[1] = worst[1].max(share * greatest(off) / whole);
        }
    }
    worst
}

/// The reference linearises over each sample separately. Its usual interval of a second is
/// compared, too.
#[test]
fn transitions_are_those_of_the_desktop() {
    let dt = 0.005;
    let truth = drive(200.0, dt, 5);
    let counts = quantise(&truth.increments, &LSB).unwrap();
    let prior = Prior {
        gyro_bias: 1.0,
        accel_bias: 1.0,
        walk_per_hour: 0.0,
        scale: [0.0; 2],
        misalignment: [0.0; 2],
    };
    for seconds in [1, 10] {
        let mut sins = Sins::new(truth.epochs[0]);
        let mut device = navigator(&truth.epochs[0], dt);
        let mut fine = Linearised::new(&prior, NOISE);
        let mut usual = Linearised::new(&prior, NOISE);
        let mut worst = [[0.0_f64; 3]; 2];
        for increments in counts.chunks_exact(seconds * truth.samples_per_epoch) {
            let mut want: Option<Block> = None;
            for increment in increments {
                let corrected = corrected(increment, &[[0.0; 3]; 2], dt);
                sins.step(&corrected, dt);
                usual.accumulate(&sins.nav, &corrected, dt);
                fine.accumulate(&sins.nav, &corrected, dt);
                let next = fine.take(&sins.nav);
                want = Some(want.map_or(next.clone(), |before| composed(&before, &next)));
                device.sample(increment);
            }
            let (want, got, usual) = (
                want.unwrap(),
                device.take_transition(),
                usual.take(&sins.nav),
            );
            assert!((f64::from(got.time) - want.time).abs() < 1e-5);
            let usual = Transition {
                phi: std::array::from_fn(|i| std::array::from_fn(|j| usual.phi[(i, j)] as f32)),
                gamma: std::array::from_fn(|i| std::array::from_fn(|j| usual.gamma[(i, j)] as f32)),
                q: std::array::from_fn(|i| std::array::from_fn(|j| usual.q[(i, j)] as f32)),
                time: usual.time as f32,
                ..Transition::ZEROED
            };
            for (worst, of) in worst.iter_mut().zip([&got, &usual]) {
                for (w, r) in worst.iter_mut().zip(relative(of, &want)) {
                    *w = w.max(r);
                }
            }
        }
        println!(
            "{seconds} s: device {:?}, desktop's usual way {:?}",
            worst[0], worst[1]
        );
        assert!(worst[0].iter().all(|w| *w < 1e-3), "{seconds} s: {worst:?}");
    }
}
