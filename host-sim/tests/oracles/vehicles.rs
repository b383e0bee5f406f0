//! The simulator's vehicles against the ECEF reference, which shares no formula with them: its
//! equations have neither north-east-down axes nor Euler angles nor transport rate.

use super::ecef::EcefReference;
use host_sim::inertial::earth::Geodetic;
use host_sim::simulator::truth::{Aircraft, City, Journey, Ship, Vehicle};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// 10 min on perfect increments without vibration end within 5 mm, 0.1 mm/s and 0.1 urad of the
/// journey, at any latitude: rate and specific force contain the rotation of the Earth, gravity and
/// the vehicle's own motion.
#[test]
fn the_reference_follows_ship_aircraft_and_car() {
    for vehicle in [
        Vehicle::Ship(Ship::default()),
        Vehicle::Aircraft(Aircraft::default()),
        Vehicle::City(City::default()),
    ] {
        for (seed, lat) in [(1, 0.0), (2, 0.82), (3, 1.48)] {
            let journey = Journey {
                start: Geodetic {
                    lat,
                    lon: -1.2,
                    h: 300.0,
                },
                heading: 2.0,
                standstill_s: 0.0,
                drive_s: 600.0,
                segments: None,
                vibration: 0.0,
                dt: 0.005,
                epochs_per_s: 1,
            };
            let truth = vehicle.truth(&journey, &mut ChaCha8Rng::seed_from_u64(seed));
            let mut reference = EcefReference::new(&truth.epochs[0]);
            reference.run(&truth.increments, truth.dt);
            let (got, want) = (reference.nav(), truth.epochs[truth.epochs.len() - 1]);
            let position = got.position.ned_from(&want.position).norm();
            let velocity = (got.velocity - want.velocity).norm();
            let attitude = got.q_bn.angle_to(&want.q_bn);
            println!("{vehicle:?} {lat}: {position:.1e} m {velocity:.1e} m/s {attitude:.1e} rad");
            assert!(position < 5e-2, "{vehicle:?} {lat}: {position}");
            assert!(velocity < 1e-3, "{vehicle:?} {lat}: {velocity}");
            assert!(attitude < 1e-6, "{vehicle:?} {lat}: {attitude}");
        }
    }
}
