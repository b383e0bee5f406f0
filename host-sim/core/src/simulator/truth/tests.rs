use super::*;
use crate::inertial::sins::Sins;
use rand::SeedableRng;

fn drive(seed: u64, minutes: f64, dt: f64) -> Truth {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let segments = random_drive(minutes * 60.0, &mut rng);
    let start = Geodetic {
        lat: 0.49,
        lon: 1.97,
        h: 60.0,
    };
    Truth::new(
        &DriveConfig {
            segments: &segments,
            start,
            heading: 0.7,
            dt,
            vibration: 1.0,
        },
        &mut rng,
    )
}

/// Perfect increments through the navigator: the horizontal and vertical error at the end.
pub(super) fn closure(truth: &Truth) -> Vector3<f64> {
    let mut sins = Sins::new(truth.epochs[0]);
    for increment in &truth.increments {
        sins.step(increment, truth.dt);
    }
    sins.nav
        .position
        .ned_from(&truth.epochs.last().unwrap().position)
}

#[test]
fn perfect_increments_reproduce_the_drive() {
    for (seed, dt) in [(1, 0.01), (2, 0.01), (3, 0.005), (4, 0.005)] {
        let truth = drive(seed, 22.0, dt);
        let error = closure(&truth);
        println!("seed {seed} dt {dt}: {error:?}");
        assert!(error.norm() < 1.0, "seed {seed} dt {dt}: {error:?}");
    }
}

#[test]
fn velocity_is_the_derivative_of_position_and_increments_integrate_it() {
    let truth = drive(5, 3.0, 0.01);
    assert_eq!(truth.increments.len(), 18_000);
    assert_eq!(truth.epochs.len(), 181);
    // at rest at both ends, moving in between, and away from the start
    assert!(truth.epochs[0].velocity.norm() < 0.05 && truth.epochs[180].velocity.norm() < 0.05);
    assert!(
        truth
            .epochs
            .iter()
            .map(|e| e.velocity.norm())
            .fold(0.0, f64::max)
            > 5.0
    );
    assert!(
        truth.epochs[180]
            .position
            .ned_from(&truth.epochs[0].position)
            .norm()
            > 100.0
    );
}

#[test]
fn same_seed_same_drive_other_seed_other_drive() {
    assert_eq!(
        drive(7, 2.0, 0.01).increments,
        drive(7, 2.0, 0.01).increments
    );
    assert_ne!(
        drive(7, 2.0, 0.01).increments[5000],
        drive(8, 2.0, 0.01).increments[5000]
    );
}

#[test]
fn random_drive_lasts_as_asked_and_ends_at_rest() {
    for seed in 0..50 {
        let segments = random_drive(1320.0, &mut ChaCha8Rng::seed_from_u64(seed));
        let sum: f64 = segments.iter().map(|s| s.duration_s).sum();
        assert!((sum - 1320.0).abs() < 0.06, "seed {seed}: {sum}");
        assert_eq!(segments[segments.len() - 2].speed_mps, Some(0.0));
    }
}
