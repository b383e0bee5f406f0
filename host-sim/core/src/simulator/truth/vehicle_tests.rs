//! The kinematics of the vehicles. The navigator and differences of positions judge them; none of
//! the formulas that make the motion is used here.

use super::tests::closure;
use super::*;
use crate::inertial::rotation::to_euler;
use crate::inertial::sins::Sins;
use crate::inertial::units::{DEG, G0};
use rand::SeedableRng;

const DT: f64 = 0.005;

fn journey(standstill_s: f64, drive_s: f64, vibration: f64, epochs_per_s: u32) -> Journey<'static> {
    Journey {
        start: Geodetic {
            lat: 0.82,
            lon: 0.14,
            h: 400.0,
        },
        heading: 2.1,
        standstill_s,
        drive_s,
        segments: None,
        vibration,
        dt: DT,
        epochs_per_s,
    }
}

fn truth(vehicle: &Vehicle, seed: u64, journey: &Journey<'_>) -> Truth {
    vehicle.truth(journey, &mut ChaCha8Rng::seed_from_u64(seed))
}

fn rolling() -> City {
    City {
        reverse_first: false,
        stops: false,
        turns: true,
        calm_stops: false,
    }
}

fn all() -> [Vehicle; 9] {
    [
        Vehicle::Road,
        Vehicle::City(City::default()),
        Vehicle::City(rolling()),
        Vehicle::Ship(Ship::default()),
        Vehicle::Aircraft(Aircraft::default()),
        Vehicle::Traffic(Traffic::default()),
        Vehicle::Train(Train::default()),
        Vehicle::HandHeld(HandHeld::default()),
        Vehicle::Standing(Standing::default()),
    ]
}

/// Velocity in NED from the positions before and after.
fn difference(epochs: &[NavState], k: usize) -> Vector3<f64> {
    epochs[k + 1].position.ned_from(&epochs[k - 1].position) / (2.0 * DT)
}

/// The central difference of the positions 5 ms before and after is the velocity to the square of
/// the step times a sixth of the jerk, which is below 100 m/s3.
#[test]
fn velocity_is_the_derivative_of_position() {
    for vehicle in all() {
        let truth = truth(&vehicle, 3, &journey(0.0, 120.0, 0.0, 200));
        assert_eq!(truth.epochs.len(), 24_001, "{vehicle:?}");
        for k in 1..truth.epochs.len() - 1 {
            let off = difference(&truth.epochs, k) - truth.epochs[k].velocity;
            assert!(off.norm() < 5e-4, "{vehicle:?} at {k}: {off:?}");
        }
    }
}

/// Without vibration the perfect increments lead the navigator along the journey: to 20 mm, 1 mm/s
/// and 2 urad after 10 min, Earth rotation and gravity included. The remaining error is the
/// navigator's own coning and sculling.
#[test]
fn increments_integrate_back_to_position_velocity_and_attitude() {
    for vehicle in all() {
        let truth = truth(&vehicle, 4, &journey(0.0, 600.0, 0.0, 1));
        let mut sins = Sins::new(truth.epochs[0]);
        let mut worst = [0.0_f64; 3];
        for (second, end) in truth.increments.chunks(200).zip(&truth.epochs[1..]) {
            second.iter().for_each(|i| sins.step(i, DT));
            let off = [
                sins.nav.position.ned_from(&end.position).norm(),
                (sins.nav.velocity - end.velocity).norm(),
                sins.nav.q_bn.angle_to(&end.q_bn),
            ];
            for (worst, off) in worst.iter_mut().zip(off) {
                *worst = worst.max(off);
            }
        }
        println!("{vehicle:?}: {worst:?}");
        let [position, velocity, attitude] = worst;
        assert!(position < 0.02 && velocity < 1e-3 && attitude < 2e-6);
    }
}

/// As above with vibration, which is harder for coning and sculling than the motion is.
#[test]
fn vibration_keeps_the_closure_of_the_road() {
    for vehicle in all() {
        let truth = truth(&vehicle, 5, &journey(0.0, 600.0, 1.0, 1));
        assert!(closure(&truth).norm() < 1.0, "{vehicle:?}");
    }
}

#[test]
fn the_seed_makes_the_journey() {
    for vehicle in all() {
        let of = |seed| truth(&vehicle, seed, &journey(10.0, 60.0, 1.0, 1)).increments;
        assert_eq!(of(1), of(1), "{vehicle:?}");
        assert_ne!(of(1)[12_000], of(2)[12_000], "{vehicle:?}");
    }
}

/// More epochs a second change no sample.
#[test]
fn epochs_of_another_rate_are_on_the_same_journey() {
    for vehicle in all() {
        let [once, often] = [1, 10].map(|n| truth(&vehicle, 1, &journey(0.0, 60.0, 1.0, n)));
        assert_eq!(once.increments, often.increments);
        let same: Vec<NavState> = often.epochs.iter().copied().step_by(10).collect();
        assert_eq!(once.epochs, same);
    }
}

/// Standard deviation.
fn sigma(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / x.len() as f64).sqrt()
}

#[test]
fn a_ship_rolls_never_stands_and_drifts() {
    let ship = Ship {
        wave_height_m: 2.0,
        current_mps: 1.0,
        ..Ship::default()
    };
    let truth = truth(&Vehicle::Ship(ship), 1, &journey(0.0, 900.0, 1.0, 1));
    let angles: Vec<_> = truth.epochs.iter().map(|e| to_euler(&e.q_bn)).collect();
    let roll = sigma(&angles.iter().map(|a| a.0).collect::<Vec<_>>()) / DEG;
    let pitch = sigma(&angles.iter().map(|a| a.1).collect::<Vec<_>>()) / DEG;
    assert!((1.0..15.0).contains(&roll), "{roll}");
    assert!((0.3..6.0).contains(&pitch), "{pitch}");
    let slowest = truth.epochs.iter().map(|e| e.velocity.xy().norm());
    assert!(slowest.fold(f64::INFINITY, f64::min) > 1.5);
    // on average the ship moves along its heading, less the current
    let drift: Vector3<f64> = truth
        .epochs
        .iter()
        .zip(&angles)
        .map(|(e, (_, _, heading))| {
            let (s, c) = heading.sin_cos();
            let across = e.velocity.y * c - e.velocity.x * s;
            let along = e.velocity.x * c + e.velocity.y * s;
            Vector3::new(across.atan2(along).abs(), 0.0, 0.0)
        })
        .sum::<Vector3<f64>>()
        / truth.epochs.len() as f64;
    assert!((0.03..0.3).contains(&drift.x), "{drift:?}");
    // no net height
    let heights: Vec<f64> = truth.epochs.iter().map(|e| e.position.h - 400.0).collect();
    assert!(heights.iter().all(|h| h.abs() < 5.0));
}

/// In a steady turn without turbulence the specific force stays in the plane of symmetry, and the
/// load is one over the cosine of the bank. The angle of attack turns 3 deg of it forward.
#[test]
fn an_aircraft_turns_with_the_ball_in_the_middle() {
    let aircraft = Aircraft {
        climbs: false,
        ..Aircraft::default()
    };
    let truth = truth(
        &Vehicle::Aircraft(aircraft),
        2,
        &journey(0.0, 900.0, 0.0, 1),
    );
    let mut banked = 0;
    let (mut lateral, mut n) = (0.0, 0.0);
    for (second, epoch) in truth.increments.chunks(200).zip(&truth.epochs) {
        let force = second.iter().map(|i| i.dv).sum::<Vector3<f64>>();
        let (roll, _, _) = to_euler(&epoch.q_bn);
        if roll.abs() > 15.0 * DEG {
            banked += 1;
            let load = force.norm() / G0;
            assert!((load * roll.cos() - 1.0).abs() < 0.12, "{load} {roll}");
        }
        lateral += force.y * force.y;
        n += 1.0;
    }
    assert!(banked > 100, "{banked}");
    assert!((lateral / n).sqrt() < 0.5, "{lateral}");
    let speeds = truth.epochs.iter().map(|e| e.velocity.norm());
    assert!(speeds.clone().fold(f64::INFINITY, f64::min) > 40.0);
    assert!(speeds.fold(0.0, f64::max) < 80.0);
}

#[test]
fn an_aircraft_stands_on_the_runway_and_takes_off() {
    let vehicle = Vehicle::Aircraft(Aircraft::default());
    let truth = truth(&vehicle, 2, &journey(120.0, 300.0, 0.0, 1));
    assert!(
        truth.epochs[..=120]
            .iter()
            .all(|e| e.velocity.norm() < 1e-9)
    );
    assert!(truth.epochs[150].velocity.norm() > 50.0);
    assert!(truth.epochs[180].position.h > 420.0);
}

/// Velocity along the forward axis, m/s.
fn forward(e: &NavState) -> f64 {
    e.q_bn.inverse_transform_vector(&e.velocity).x
}

#[test]
fn a_city_car_reverses_stands_for_seconds_and_slips() {
    for seed in 0..10 {
        let vehicle = Vehicle::City(City::default());
        let truth = truth(&vehicle, seed, &journey(0.0, 600.0, 0.0, 1));
        let first = truth.epochs.iter().find(|e| e.velocity.norm() > 0.8);
        assert!(forward(first.unwrap()) < -0.7, "seed {seed}");
        let mut stationary = 0;
        for e in &truth.epochs {
            stationary = if e.velocity.norm() < 0.05 {
                stationary + 1
            } else {
                0
            };
            assert!(stationary < 15, "seed {seed}");
        }
        let slip = truth.epochs.iter().filter(|e| forward(e) > 3.0).map(|e| {
            let v = e.q_bn.inverse_transform_vector(&e.velocity);
            v.y.atan2(v.x).abs() / DEG
        });
        let most = slip.fold(0.0, f64::max);
        assert!((2.0..12.0).contains(&most), "seed {seed}: {most}");
    }
}

#[test]
fn a_rolling_car_never_stands() {
    for seed in 0..10 {
        let truth = truth(
            &Vehicle::City(rolling()),
            seed,
            &journey(0.0, 600.0, 0.0, 1),
        );
        assert!(truth.epochs.iter().all(|e| forward(e) > 3.0), "seed {seed}");
    }
}

/// The road by this way is the road of a session, sample for sample.
#[test]
fn the_road_is_the_road_of_a_session() {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut segments = vec![Segment::hold(20.0)];
    segments.extend(random_drive(120.0, &mut rng));
    let journey = journey(20.0, 120.0, 1.0, 1);
    let config = DriveConfig {
        segments: &segments,
        start: journey.start,
        heading: journey.heading,
        dt: DT,
        vibration: 1.0,
    };
    let session = Truth::new(&config, &mut rng);
    let vehicle = truth(&Vehicle::Road, 9, &journey);
    assert_eq!(session.increments, vehicle.increments);
    assert_eq!(session.epochs, vehicle.epochs);
}
