//! The vehicles of the simulator by name, and their true journeys.

use super::aircraft::Flight;
use super::city::Car;
use super::hand_held::Walk;
use super::random_drive;
use super::ship::Hull;
use super::standing::Parked;
use super::train::Cars;
use super::{
    Aircraft, City, DriveConfig, HandHeld, Segment, Ship, Standing, Traffic, Train, Truth,
};
use crate::inertial::earth::Geodetic;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Names of the vehicles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VehicleName {
    /// A car on town streets and country roads, which stops for up to half a minute.
    #[default]
    Road,
    /// A car in a town, which stands for seconds.
    City,
    /// A ship in waves, which never stands.
    Ship,
    /// An aircraft, which stands on the runway only.
    Aircraft,
    /// A car that creeps in queues.
    Traffic,
    /// A train, which stops at stations.
    Train,
    /// A device in the hand of somebody who walks.
    HandHeld,
    /// A vehicle that never moves.
    Standing,
}

impl VehicleName {
    /// The names as they are written.
    pub const NAMES: [(&'static str, Self); 8] = [
        ("road", Self::Road),
        ("city", Self::City),
        ("ship", Self::Ship),
        ("aircraft", Self::Aircraft),
        ("traffic", Self::Traffic),
        ("train", Self::Train),
        ("hand-held", Self::HandHeld),
        ("standing", Self::Standing),
    ];
}

impl std::fmt::Display for VehicleName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = Self::NAMES.iter().find(|(_, vehicle)| vehicle == self);
        f.pad(name.map_or("road", |(name, _)| name))
    }
}

/// A vehicle with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Vehicle {
    /// A car on a road.
    Road,
    /// A car in a town.
    City(City),
    /// A ship.
    Ship(Ship),
    /// An aircraft.
    Aircraft(Aircraft),
    /// A car in traffic.
    Traffic(Traffic),
    /// A train.
    Train(Train),
    /// A walking survey.
    HandHeld(HandHeld),
    /// A vehicle that never moves.
    Standing(Standing),
}

/// Start, duration and settings of a journey.
#[derive(Debug, Clone, Copy)]
pub struct Journey<'a> {
    /// Start position.
    pub start: Geodetic,
    /// Heading at the start, rad.
    pub heading: f64,
    /// Standstill before the journey, s; a ship has none and is under way in that time too.
    pub standstill_s: f64,
    /// Time after the standstill, s. A road with `segments` lasts as long as these.
    pub drive_s: f64,
    /// The segments of a road. A random drive if `None`. Other vehicles ignore them.
    pub segments: Option<&'a [Segment]>,
    /// Scale of the vibration: 1 is a passenger car on an ordinary road, 0 none. The steps of a
    /// hand-held device do not depend on it.
    pub vibration: f64,
    /// Sample period, s. One second is a whole number of samples.
    pub dt: f64,
    /// Epochs a second, >= 1. The samples of a second are a multiple of them.
    pub epochs_per_s: u32,
}

impl Vehicle {
    /// Whether it goes through streets between houses.
    #[must_use]
    pub fn is_car(&self) -> bool {
        matches!(self, Vehicle::Road | Vehicle::City(_) | Vehicle::Traffic(_))
    }

    /// Whether it has wheels on the ground while it moves.
    #[must_use]
    pub const fn rolls(&self) -> bool {
        matches!(
            self,
            Self::Road | Self::City(_) | Self::Traffic(_) | Self::Train(_)
        )
    }

    /// Whether it stands before it goes.
    #[must_use]
    pub fn stands(&self) -> bool {
        !matches!(self, Vehicle::Ship(_))
    }

    /// The true journey.
    #[must_use]
    pub fn truth(&self, journey: &Journey<'_>, rng: &mut ChaCha8Rng) -> Truth {
        let Journey {
            start,
            heading,
            standstill_s,
            vibration,
            dt,
            epochs_per_s,
            ..
        } = *journey;
        let all = standstill_s + journey.drive_s;
        let times = [standstill_s, all];
        let scales = [heading, vibration];
        let of = |motion: &mut dyn super::Motion| Truth::of(motion, start, dt, epochs_per_s);
        match self {
            Vehicle::Road => {
                let segments = road(journey, rng);
                let config = DriveConfig {
                    segments: &segments,
                    start,
                    heading,
                    dt,
                    vibration,
                };
                of(&mut super::Road::new(&config, rng))
            }
            Vehicle::City(city) => of(&mut Car::new(city, times, scales, dt, rng)),
            Vehicle::Ship(ship) => of(&mut Hull::new(ship, all, scales, dt, rng)),
            Vehicle::Aircraft(aircraft) => of(&mut Flight::new(aircraft, times, scales, dt, rng)),
            Vehicle::Traffic(traffic) => of(&mut traffic.car(times, scales, dt, rng)),
            Vehicle::Train(train) => of(&mut Cars::new(train, times, scales, dt, rng)),
            Vehicle::HandHeld(walk) => of(&mut Walk::new(walk, times, heading, dt, rng)),
            Vehicle::Standing(standing) => of(&mut Parked::new(standing, all, scales, dt, rng)),
        }
    }
}

/// The segments of a road journey, with the standstill.
fn road(journey: &Journey<'_>, rng: &mut ChaCha8Rng) -> Vec<Segment> {
    let stands = journey.standstill_s > 0.0;
    let mut segments: Vec<Segment> = stands
        .then(|| Segment::hold(journey.standstill_s))
        .into_iter()
        .collect();
    match journey.segments {
        Some(given) => segments.extend_from_slice(given),
        None => segments.extend(random_drive(journey.drive_s, rng)),
    }
    segments
}
