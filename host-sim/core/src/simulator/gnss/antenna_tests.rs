//! Latency and lever arm of the receiver against closed forms.

use super::antenna::Path;
use super::*;
use crate::inertial::earth::Geodetic;
use crate::simulator::truth::{City, DriveConfig, Journey, Segment, Vehicle};
use rand::SeedableRng;

const DT: f64 = 0.01;
/// Speed of the drives of one closed form, m/s.
const SPEED: f64 = 12.0;
const START: Geodetic = Geodetic {
    lat: 0.8,
    lon: 0.1,
    h: 100.0,
};

/// Twenty seconds to reach the speed, then 60 s in which the heading turns by `turn_deg`.
fn drive(turn_deg: f64) -> Truth {
    let segments = [
        Segment {
            speed_mps: Some(SPEED),
            ..Segment::hold(20.0)
        },
        Segment {
            turn_deg,
            ..Segment::hold(60.0)
        },
    ];
    let config = DriveConfig {
        segments: &segments,
        start: START,
        heading: 0.4,
        dt: DT,
        vibration: 0.0,
    };
    Truth::new(&config, &mut ChaCha8Rng::seed_from_u64(1))
}

/// A receiver whose noise does not count.
fn quiet() -> GnssSpec {
    GnssSpec {
        horizontal_m: 1e-9,
        vertical_m: 1e-9,
        velocity_mps: 1e-9,
        ..GnssSpec::default()
    }
}

fn fixes(spec: &GnssSpec, truth: &Truth) -> Vec<(f64, Option<Fix>)> {
    spec.of_drive(truth, &mut ChaCha8Rng::seed_from_u64(7))
}

/// At constant speed a fix that comes late by T is behind by v T, along the track; on a straight
/// line its velocity is the same.
#[test]
fn a_late_fix_is_behind_by_speed_times_latency() {
    let truth = drive(0.0);
    for latency_s in [0.1, 0.25, 1.0, 2.37] {
        let spec = GnssSpec {
            latency_s: Some(latency_s),
            ..quiet()
        };
        let late = fixes(&spec, &truth);
        for (k, (time, fix)) in late.iter().enumerate().skip(30) {
            let (fix, at) = (fix.unwrap(), truth.epochs[k]);
            assert_eq!(*time, k as f64);
            let behind = at.position.ned_from(&fix.position);
            let want = at.velocity * latency_s;
            // the road is straight and the Earth is round: v^2 T^2 / 2 R is 63 um
            assert!((behind - want).norm() < 1e-4, "{latency_s} {k}: {behind}");
            assert!((fix.velocity - at.velocity).norm() < 1e-4);
        }
        // what would have been valid before power-on is not there
        let first = late.iter().position(|(_, fix)| fix.is_some()).unwrap();
        assert_eq!(first, latency_s.ceil() as usize);
    }
}

/// In a turn at rate w the antenna at arm r moves by w x r faster than the IMU, and its position is
/// off by r in body axes.
#[test]
fn an_antenna_on_an_arm_moves_by_the_rate_times_the_arm() {
    let truth = drive(240.0);
    let arm = [2.0, -1.5, -1.0];
    let spec = GnssSpec {
        lever_arm_m: Some(arm),
        ..quiet()
    };
    let mut most = 0.0_f64;
    for (k, (_, fix)) in fixes(&spec, &truth).into_iter().enumerate() {
        let (fix, at) = (fix.unwrap(), truth.epochs[k]);
        let off = at
            .q_bn
            .inverse_transform_vector(&fix.position.ned_from(&at.position));
        assert!((off - Vector3::from(arm)).norm() < 1e-6, "{k}: {off}");
        // of the heading's quintic: w = turn / T * 30 u^2 (1 - u)^2
        let u = ((k as f64 - 20.0) / 60.0).max(0.0);
        let rate = 240.0_f64.to_radians() / 60.0 * 30.0 * (u * (1.0 - u)).powi(2);
        let level = at.q_bn * Vector3::from(arm);
        let want = Vector3::new(0.0, 0.0, rate).cross(&level);
        let got = fix.velocity - at.velocity;
        // the car also rolls in a turn, at up to 5 mrad/s, while the turn begins and ends
        assert!((got - want).xy().norm() < 6e-3, "{k}: {got} {want}");
        most = most.max(got.norm());
    }
    assert!(most > 0.3, "{most}");
}

/// The states between epochs are those of the same drive with an epoch at each sample.
#[test]
fn states_between_epochs_are_on_the_drive() {
    let journey = |epochs_per_s| Journey {
        start: START,
        heading: 1.0,
        standstill_s: 0.0,
        drive_s: 60.0,
        segments: None,
        vibration: 1.0,
        dt: DT,
        epochs_per_s,
    };
    let city = Vehicle::City(City::default());
    let truth = |n| city.truth(&journey(n), &mut ChaCha8Rng::seed_from_u64(3));
    let (coarse, fine) = (truth(1), truth(100));
    let mut path = Path::new(&coarse);
    let mut worst = [0.0_f64; 3];
    for sample in (0..6000).step_by(7) {
        let (got, want) = (path.at(f64::from(sample)), fine.epochs[sample as usize]);
        let off = [
            got.position.ned_from(&want.position).norm(),
            (got.velocity - want.velocity).norm(),
            got.q_bn.angle_to(&want.q_bn),
        ];
        worst = std::array::from_fn(|i| worst[i].max(off[i]));
        // within a sample, between its ends
        let (before, after) = (want, fine.epochs[sample as usize + 1]);
        let half = path.at(f64::from(sample) + 0.5);
        let middle = 0.5 * after.position.ned_from(&before.position);
        let got = half.position.ned_from(&before.position);
        assert!((got - middle).norm() < 2e-3, "{sample}: {got} {middle}");
    }
    let [position, velocity, attitude] = worst;
    println!("{worst:?}");
    assert!(
        position < 1e-3 && velocity < 3e-3 && attitude < 1e-4,
        "{worst:?}"
    );
}

/// Without the keys each fix is that of the epoch itself, bit for bit, and assumed values have no
/// effect.
#[test]
fn without_the_keys_fixes_are_prompt_and_at_the_imu() {
    let truth = drive(90.0);
    let assumed_antenna = AntennaPrior {
        age_s: [0.1, 0.1],
        lever_arm_m: [1.0, 2.0, 3.0],
        lever_arm_sigma_m: 0.5,
    };
    let spec = GnssSpec {
        assumed_antenna,
        ..GnssSpec::default()
    };
    let plain = spec.fixes(&truth.epochs, 1.0, &mut ChaCha8Rng::seed_from_u64(7));
    let got: Vec<_> = fixes(&spec, &truth)
        .into_iter()
        .map(|(_, fix)| fix)
        .collect();
    assert_eq!(got, plain);
    assert_eq!(spec.antenna_prior(), AntennaPrior::default());
    // the assumed latency changes the age of the fix, and nothing else
    let late = GnssSpec {
        latency_s: Some(0.0),
        ..spec
    };
    let claims = |fix: Option<Fix>| Some(Fix { age_s: 0.1, ..fix? });
    let want: Vec<_> = plain.into_iter().map(claims).collect();
    let got: Vec<_> = fixes(&late, &truth)
        .into_iter()
        .map(|(_, fix)| fix)
        .collect();
    assert_eq!(got, want);
}

/// More fixes a second are on the same drive: where both rates have one, at the same position.
#[test]
fn a_faster_receiver_has_fixes_between() {
    let truth = drive(90.0);
    let fast = GnssSpec {
        rate_hz: 8,
        ..quiet()
    };
    let (fast, slow) = (fixes(&fast, &truth), fixes(&quiet(), &truth));
    assert_eq!((fast.len(), slow.len()), (80 * 8 + 1, 81));
    for (k, (time, fix)) in fast.iter().enumerate() {
        assert_eq!(*time, k as f64 / 8.0);
        if k % 8 == 0 {
            let other = slow[k / 8].1.unwrap();
            assert!(fix.unwrap().position.ned_from(&other.position).norm() < 1e-6);
        }
    }
    let step = |k: usize| {
        let [a, b] = [k, k + 1].map(|k| fast[k].1.unwrap().position);
        b.ned_from(&a).norm()
    };
    assert!((200..640).all(|k| (step(k) - SPEED / 8.0).abs() < 1e-3));
}

/// In a burst that covers the whole drive, the fix is shifted where the car is slow and only there.
#[test]
fn multipath_in_streets_spares_the_open_road() {
    let segments = [
        Segment::hold(20.0),
        Segment {
            speed_mps: Some(25.0),
            ..Segment::hold(40.0)
        },
        Segment::hold(20.0),
    ];
    let config = DriveConfig {
        segments: &segments,
        start: START,
        heading: 0.4,
        dt: DT,
        vibration: 0.0,
    };
    let truth = Truth::new(&config, &mut ChaCha8Rng::seed_from_u64(1));
    let multipath = Multipath {
        mean_interval_s: 1e-6,
        mean_length_s: 1e9,
        in_streets: true,
        ..Multipath::default()
    };
    let spec = GnssSpec {
        multipath,
        ..quiet()
    };
    let mut shifted = [0, 0];
    for (k, (_, fix)) in fixes(&spec, &truth).into_iter().enumerate().skip(1) {
        let at = truth.epochs[k];
        let off = fix.unwrap().position.ned_from(&at.position).norm() > 0.1;
        assert_eq!(off, at.velocity.norm() < 15.0, "{k}");
        shifted[usize::from(off)] += 1;
    }
    assert!(shifted.iter().all(|n| *n > 25), "{shifted:?}");
}
