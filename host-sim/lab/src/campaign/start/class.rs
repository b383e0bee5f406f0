//! The classes: a sensor, a vehicle, a location, and the expected result.

use host_core::error::Error;
use host_core::simulator::truth::{
    Aircraft, City, HandHeld, Ship, Standing, Traffic, Train, Vehicle,
};
use host_unit::around::Kind;
use serde::Serialize;

/// A class of trials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Class {
    /// Its name.
    pub name: &'static str,
    /// Description, in a few words.
    pub about: &'static str,
    /// The expected result.
    pub goal: Goal,
    /// Preset of the sensor.
    pub unit: &'static str,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// The configured kind of vehicle.
    pub configured: Kind,
    /// Latitude of the start, deg.
    pub latitude_deg: f64,
    /// Standstill before the journey, s.
    pub standstill_s: f64,
}

/// The expected result of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Goal {
    /// It starts, and its heading is as good as it claims.
    Start,
    /// The heading cannot be known, or the configuration is wrong: better no start than a wrong
    /// one.
    Trap,
}

/// Time of the journey after the standstill, s.
pub const JOURNEY_S: f64 = 600.0;
/// Standstill of the land vehicles that have one, s: somewhat longer than the usual alignment.
const STANDSTILL_S: f64 = 120.0;
const MID: f64 = 47.0;

const TOWN: City = City {
    reverse_first: false,
    stops: true,
    turns: true,
    calm_stops: false,
};
const SEA: Ship = Ship {
    wave_height_m: 1.5,
    wave_period_s: 7.0,
    speed_mps: 6.0,
    current_mps: 0.5,
    turns: true,
};
const FLIGHT: Aircraft = Aircraft {
    speed_mps: 60.0,
    bank_deg: 30.0,
    wind_mps: 10.0,
    climbs: true,
};

const QUEUES: Traffic = Traffic {
    queue_share: 0.7,
    creep_mps: 1.0,
    creep_s: 20.0,
    stop_s: 15.0,
    departure_s: 60.0,
    speed_mps: 12.0,
};
const RAILWAY: Train = Train {
    speed_mps: 40.0,
    radius_m: 1500.0,
    cant_mm: 150.0,
    stop_every_s: 480.0,
};
const SURVEY: HandHeld = HandHeld {
    speed_mps: 1.3,
    step_hz: 1.8,
    step_g: 0.3,
    swing_deg: 20.0,
    pauses: true,
};
const PARKED: Standing = Standing {
    rock_deg: 0.02,
    sway_mps: 0.002,
};

/// A car that stands, then drives on the road.
const fn road(name: &'static str, unit: &'static str, latitude_deg: f64) -> Class {
    Class {
        name,
        about: "a car stands for 120 s, then drives",
        goal: Goal::Start,
        unit,
        vehicle: Vehicle::Road,
        configured: Kind::Land,
        latitude_deg,
        standstill_s: STANDSTILL_S,
    }
}

/// A vehicle that moves from the start.
const fn moving(
    name: &'static str,
    about: &'static str,
    unit: &'static str,
    vehicle: Vehicle,
    configured: Kind,
) -> Class {
    Class {
        name,
        about,
        goal: Goal::Start,
        unit,
        vehicle,
        configured,
        latitude_deg: MID,
        standstill_s: 0.0,
    }
}

const fn trap(class: Class) -> Class {
    Class {
        goal: Goal::Trap,
        ..class
    }
}

/// All classes.
pub const CLASSES: [Class; 21] = [
    road("laser-0", "medium", 0.0),
    road("laser-47", "medium", 47.0),
    road("laser-75", "medium", 75.0),
    road("laser-85", "medium", 85.0),
    road("tactical", "hg1700", MID),
    road("stim300", "stim300", MID),
    road("mems", "icm-42688", MID),
    moving(
        "ship-laser",
        "a ship turns in waves of 1.5 m and a current of 0.5 m/s",
        "medium",
        Vehicle::Ship(SEA),
        Kind::Ship,
    ),
    moving(
        "ship-stim300",
        "the same ship",
        "stim300",
        Vehicle::Ship(SEA),
        Kind::Ship,
    ),
    moving(
        "air-stim300",
        "an aircraft turns with up to 30 deg of bank in a wind of 10 m/s",
        "stim300",
        Vehicle::Aircraft(FLIGHT),
        Kind::Air,
    ),
    moving(
        "air-mems",
        "the same aircraft",
        "icm-42688",
        Vehicle::Aircraft(FLIGHT),
        Kind::Air,
    ),
    moving(
        "city-mems",
        "a car in a town stands for seconds only and slips in corners",
        "icm-42688",
        Vehicle::City(TOWN),
        Kind::Land,
    ),
    moving(
        "city-reverse",
        "the same car reverses out of a parking place first",
        "icm-42688",
        Vehicle::City(City {
            reverse_first: true,
            ..TOWN
        }),
        Kind::Land,
    ),
    moving(
        "city-rolling",
        "the same car never stands",
        "icm-42688",
        Vehicle::City(City {
            stops: false,
            ..TOWN
        }),
        Kind::Land,
    ),
    moving(
        "traffic-mems",
        "a car stands and creeps in queues for most of the time",
        "icm-42688",
        Vehicle::Traffic(QUEUES),
        Kind::Land,
    ),
    moving(
        "train-stim300",
        "a train at 40 m/s from the first sample on, with curves and stations",
        "stim300",
        Vehicle::Train(RAILWAY),
        Kind::Land,
    ),
    trap(moving(
        "hand-held",
        "somebody walks with the device and swings it, configured as a land vehicle",
        "icm-42688",
        Vehicle::HandHeld(SURVEY),
        Kind::Land,
    )),
    trap(moving(
        "standing",
        "a parked car that wind and people rock",
        "icm-42688",
        Vehicle::Standing(PARKED),
        Kind::Land,
    )),
    trap(moving(
        "straight",
        "a car drives straight on at constant speed from the first sample to the last",
        "icm-42688",
        Vehicle::City(City {
            reverse_first: false,
            stops: false,
            turns: false,
            calm_stops: false,
        }),
        Kind::Land,
    )),
    trap(moving(
        "ship-adrift",
        "a ship without way is carried by a current of 1.5 m/s",
        "stim300",
        Vehicle::Ship(Ship {
            speed_mps: 0.0,
            current_mps: 1.5,
            turns: false,
            ..SEA
        }),
        Kind::Ship,
    )),
    trap(moving(
        "air-as-land",
        "an aircraft in a wind of 15 m/s, configured as a land vehicle",
        "stim300",
        Vehicle::Aircraft(Aircraft {
            wind_mps: 15.0,
            ..FLIGHT
        }),
        Kind::Land,
    )),
];

/// The classes with these names, in the order of [`CLASSES`]; all without a name, or with `all`.
///
/// # Errors
/// An unknown name.
pub fn chosen(names: &[String]) -> Result<Vec<Class>, Error> {
    if matches!(names, [all] if all == "all") {
        return chosen(&[]);
    }
    for name in names {
        if !CLASSES.iter().any(|class| class.name == name) {
            let known = CLASSES.map(|class| class.name);
            return Err(Error::unknown("class", name, &known));
        }
    }
    let wanted = |class: &&Class| names.is_empty() || names.iter().any(|name| name == class.name);
    Ok(CLASSES.iter().filter(wanted).copied().collect())
}
