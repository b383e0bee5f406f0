//! Scenarios of simulations: a named one or a TOML file.

use crate::Unit;
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::world::{Ambient, Power};
use host_core::simulator::imu::{ImuSpec, World};
use host_core::simulator::truth::{
    Aircraft, City, HandHeld, Segment, Ship, Standing, Traffic, Train, VehicleName,
};
use host_core::simulator::wheels::WheelSpec;
use network::NetworkSpec;
use serde::Deserialize;
use std::path::{Path, PathBuf};

pub mod network;

mod receiver;
mod vehicle;
mod world;

/// One of the two sessions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSpec {
    /// Standstill for alignment, s, 90 to 7200. All vehicles but the car on the road may have
    /// 0; a ship has none and is under way in that time.
    pub standstill_s: u32,
    /// Length of a random drive, s, 120 to 28800; ignored when segments are given.
    pub drive_s: u32,
    /// The drive, segment by segment.
    pub segment: Vec<Segment>,
}

impl Default for DriveSpec {
    fn default() -> Self {
        Self {
            standstill_s: 300,
            drive_s: 1320,
            segment: Vec::new(),
        }
    }
}

impl DriveSpec {
    /// Length of the drive, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        if self.segment.is_empty() {
            f64::from(self.drive_s)
        } else {
            self.segment.iter().map(|s| s.duration_s).sum()
        }
    }
}

/// A scenario file. Every key has a default, so a file contains only what differs from the scenario
/// `medium`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Name, for report and JSON.
    pub name: String,
    /// Unit: a preset's name, or a unit file, relative to the scenario file.
    #[serde(rename = "unit")]
    pub unit_name: String,
    /// Start: latitude, deg, -80 to 80.
    pub latitude_deg: f64,
    /// Start: longitude, deg, -180 to 180.
    pub longitude_deg: f64,
    /// Start: height, m, -500 to 9000.
    pub height_m: f64,
    /// Heading at the start, deg, -360 to 360.
    pub heading_deg: f64,
    /// Road vibration: 1 is a passenger car on an ordinary road; 0 to 10.
    pub vibration: f64,
    /// Vehicle.
    #[serde(rename = "vehicle")]
    pub vehicle_name: VehicleName,
    /// Parameters of a city car, if it is the vehicle.
    pub city: City,
    /// Parameters of a ship.
    pub ship: Ship,
    /// Parameters of an aircraft.
    pub aircraft: Aircraft,
    /// Parameters of a car in traffic.
    pub traffic: Traffic,
    /// Parameters of a train.
    pub train: Train,
    /// Parameters of a hand-held device.
    #[serde(rename = "hand-held")]
    pub hand_held: HandHeld,
    /// Parameters of a vehicle that never moves.
    pub standing: Standing,
    /// Temperature of the air around the unit.
    pub ambient: Ambient,
    /// Start of the unit (cold, warm or hot), and its age.
    pub power: Power,
    /// Receiver.
    pub gnss: GnssSpec,
    /// Wheels whose speed is reported; without this table it is not.
    pub wheels: Option<WheelSpec>,
    /// Session to learn from.
    pub learn: DriveSpec,
    /// Session to be judged on.
    pub test: DriveSpec,
    /// Networks and their training.
    pub network: NetworkSpec,
    /// The unit of that name.
    #[serde(skip)]
    unit: Unit,
    /// The keys that the file gives.
    #[serde(skip)]
    given: Vec<String>,
    /// Path of the file, for errors.
    #[serde(skip)]
    source: PathBuf,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "medium".into(),
            unit_name: "medium".into(),
            unit: Unit::default(),
            latitude_deg: 28.2, // Changsha
            longitude_deg: 112.9,
            height_m: 60.0,
            heading_deg: 35.0,
            vibration: 1.0,
            vehicle_name: VehicleName::default(),
            city: City::default(),
            ship: Ship::default(),
            aircraft: Aircraft::default(),
            traffic: Traffic::default(),
            train: Train::default(),
            hand_held: HandHeld::default(),
            standing: Standing::default(),
            ambient: Ambient::default(),
            power: Power::default(),
            gnss: GnssSpec::default(),
            wheels: None,
            learn: DriveSpec {
                drive_s: 1800,
                ..DriveSpec::default()
            },
            test: DriveSpec::default(),
            network: NetworkSpec::default(),
            given: Vec::new(),
            source: PathBuf::from("built-in scenario"),
        }
    }
}

/// Names of the built-in scenarios: the default one with each preset.
#[must_use]
pub fn names() -> Vec<&'static str> {
    host_core::simulator::imu::PRESETS
        .iter()
        .map(|(name, _)| *name)
        .collect()
}

impl Scenario {
    /// A built-in scenario by name, or a file (anything that ends in `.toml` or has a path
    /// separator).
    ///
    /// # Errors
    /// Unknown name; missing or unreadable file; unknown key, wrong type or value out of range,
    /// with file, line and key.
    pub fn load(name: &str) -> Result<Self, Error> {
        let path = Path::new(name);
        if path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
            || path.components().count() > 1
        {
            return Self::read(path);
        }
        if !names().contains(&name) {
            return Err(Error::unknown("scenario", name, &names()));
        }
        Ok(Self {
            name: name.to_string(),
            unit_name: name.to_string(),
            unit: Unit::load(name)?,
            ..Self::default()
        })
    }

    /// Replaces the unit.
    pub fn set_unit(&mut self, name: &str, unit: Unit) {
        (self.unit_name, self.unit) = (name.to_owned(), unit);
    }

    fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::reading(path, e))?;
        Self::parse(path, &text)
    }

    /// The scenario of a text. `path` is named in errors, and units are looked for beside it.
    ///
    /// # Errors
    /// As [`Scenario::load`] of a file.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let mut scenario: Self = crate::text::parse(path, text, remedy)?;
        scenario.source = path.to_path_buf();
        let keys: toml::Table = toml::from_str(text).unwrap_or_default();
        scenario.given = keys.keys().cloned().collect();
        scenario.unit = Unit::load_beside(&scenario.unit_name, path)?;
        if scenario.name == "medium" {
            // a file without a name gets its file name
            scenario.name = path
                .file_stem()
                .map_or_else(|| "scenario".into(), |s| s.to_string_lossy().into_owned());
        }
        scenario.check()?;
        Ok(scenario)
    }

    /// Checks that the file gives none of these keys, which `command` would ignore.
    ///
    /// # Errors
    /// The first one that is given.
    pub fn gives_none_of(&self, keys: &[&str], command: &str) -> Result<(), Error> {
        let given = keys.iter().find(|key| self.given.iter().any(|g| g == *key));
        given.map_or(Ok(()), |key| {
            let problem = format!("is given, but `{command}` does not use it");
            Err(self.bad(key, problem, "leave it out"))
        })
    }

    /// Checks the ranges of all values.
    fn check(&self) -> Result<(), Error> {
        if self.name.is_empty()
            || !self
                .name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c))
        {
            return Err(self.bad(
                "name",
                format!("is '{}'", self.name),
                "use letters, digits, '-', '_' and '.'",
            ));
        }
        let n = &self.network;
        let ranges = [
            ("latitude_deg", self.latitude_deg, -80.0, 80.0),
            ("longitude_deg", self.longitude_deg, -180.0, 180.0),
            ("height_m", self.height_m, -500.0, 9000.0),
            ("heading_deg", self.heading_deg, -360.0, 360.0),
            ("vibration", self.vibration, 0.0, 10.0),
            (
                "learn: length of the drive, s",
                self.learn.duration_s(),
                120.0,
                28_800.0,
            ),
            (
                "test: length of the drive, s",
                self.test.duration_s(),
                120.0,
                28_800.0,
            ),
            ("network.window_s", f64::from(n.window_s), 1.0, 120.0),
            ("network.passes", f64::from(n.passes), 1.0, 10_000.0),
            ("network.first_step", n.first_step, 1e-9, 1e3),
            ("network.weight_sigma", n.weight_sigma, 1e-6, 100.0),
            ("network.correlation_s", n.correlation_s, 1.0, 1e5),
            ("network.held_back", n.held_back, 0.05, 0.5),
        ];
        self.in_ranges(&ranges)?;
        for (key, drive) in [("learn", &self.learn), ("test", &self.test)] {
            self.check_standstill(key, drive)?;
            self.check_segments(key, drive)?;
        }
        if let Some(wheels) = &self.wheels {
            self.in_ranges(&[
                ("wheels.scale_percent", wheels.scale_percent, -20.0, 20.0),
                ("wheels.noise_mps", wheels.noise_mps, 0.0, 10.0),
                ("wheels.resolution_mps", wheels.resolution_mps, 0.0, 10.0),
                ("wheels.least_mps", wheels.least_mps, 0.0, 10.0),
                ("wheels.slip_percent", wheels.slip_percent, 0.0, 10.0),
                ("wheels.spells_per_h", wheels.spells_per_h, 0.0, 3600.0),
                ("wheels.spell_s", wheels.spell_s, 1.0, 60.0),
            ])?;
        }
        self.check_receiver()?;
        self.check_world()?;
        self.check_vehicle()
    }

    fn in_ranges(&self, ranges: &[(&str, f64, f64, f64)]) -> Result<(), Error> {
        for &(key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                let remedy = format!("give a number from {low} to {high}");
                return Err(self.bad(key, format!("is {value}"), &remedy));
            }
        }
        Ok(())
    }

    fn check_segments(&self, key: &str, drive: &DriveSpec) -> Result<(), Error> {
        for (k, s) in drive.segment.iter().enumerate() {
            let fields = [
                ("duration_s", s.duration_s, 0.1, 28_800.0),
                ("speed_mps", s.speed_mps.unwrap_or(0.0), 0.0, 100.0),
                ("turn_deg", s.turn_deg, -3600.0, 3600.0),
                ("grade_percent", s.grade_percent.unwrap_or(0.0), -30.0, 30.0),
            ];
            for (field, value, low, high) in fields {
                if !(low..=high).contains(&value) {
                    let key = format!("{key}.segment[{k}].{field}");
                    return Err(self.bad(
                        &key,
                        format!("is {value}"),
                        &format!("give a number from {low} to {high}"),
                    ));
                }
            }
        }
        Ok(())
    }

    /// Start position.
    #[must_use]
    pub fn start(&self) -> Geodetic {
        Geodetic {
            lat: self.latitude_deg.to_radians(),
            lon: self.longitude_deg.to_radians(),
            h: self.height_m,
        }
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &Unit {
        &self.unit
    }

    /// Number of samples of the learning drive and the judged one.
    #[must_use]
    pub fn samples(&self) -> f64 {
        let seconds = |of: &DriveSpec| f64::from(of.standstill_s) + of.duration_s();
        let both = seconds(&self.learn) + seconds(&self.test);
        both * f64::from(self.imu_spec().rate_hz)
    }

    /// The errors of the simulated IMU, and its environment.
    #[must_use]
    pub fn imu_spec(&self) -> ImuSpec {
        ImuSpec {
            world: World {
                ambient: self.ambient.clone(),
                power: self.power,
            },
            ..self.unit.simulated()
        }
    }

    /// The error of a standstill that gives no attitude.
    #[must_use]
    pub fn no_attitude(&self) -> Error {
        self.bad(
            "standstill_s",
            "gives no attitude".into(),
            "let the vehicle stand longer before it drives",
        )
    }

    fn bad(&self, key: &str, problem: String, remedy: &str) -> Error {
        Error::Scenario {
            file: self.source.clone(),
            line: None,
            key: key.to_string(),
            problem,
            remedy: remedy.to_string(),
        }
    }
}

/// The remedy for a faulty key.
fn remedy(key: &str) -> String {
    let remedy = match key.split('.').next() {
        Some("preset") => "write unit = \"NAME\" or unit = \"FILE.toml\" instead",
        Some("imu") => {
            "write these tables into a unit file as [simulation], and unit = \"FILE.toml\" here; \
             `host-sim unit show medium` has an example"
        }
        _ => "docs/scenario.toml has all keys with their units",
    };
    remedy.into()
}

#[cfg(test)]
mod tests;
