//! What to simulate: a named scenario or a TOML file.

use crate::earth::Geodetic;
use crate::gnss::GnssSpec;
use crate::imu::ImuSpec;
use crate::learning::NetworkSpec;
use crate::truth::Segment;
use serde::Deserialize;

/// An IMU by the name of a preset, or spelt out.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum ImuChoice {
    /// Name of a preset.
    Preset(String),
    /// All its numbers.
    Spec(Box<ImuSpec>),
}

/// One of the two sessions.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSpec {
    /// Standstill for alignment, s, 60 to 3600.
    pub standstill_s: u32,
    /// Length of a random drive, s, 120 to 14400; ignored when segments are given.
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

/// A scenario file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Name, for the report.
    pub name: String,
    /// IMU.
    pub imu: ImuChoice,
    /// Start: latitude, deg, -80 to 80.
    pub latitude_deg: f64,
    /// Start: longitude, deg.
    pub longitude_deg: f64,
    /// Start: height, m.
    pub height_m: f64,
    /// Heading at the start, deg.
    pub heading_deg: f64,
    /// Road vibration: 1 is a passenger car on an ordinary road.
    pub vibration: f64,
    /// Receiver.
    pub gnss: GnssSpec,
    /// Session to learn from.
    pub learn: DriveSpec,
    /// Session to be judged on; its drive lasts at least 22 min.
    pub test: DriveSpec,
    /// Networks and their teaching.
    pub network: NetworkSpec,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "medium".into(),
            imu: ImuChoice::Preset("medium".into()),
            latitude_deg: 28.2, // Changsha
            longitude_deg: 112.9,
            height_m: 60.0,
            heading_deg: 35.0,
            vibration: 1.0,
            gnss: GnssSpec::default(),
            learn: DriveSpec {
                drive_s: 1800,
                ..DriveSpec::default()
            },
            test: DriveSpec::default(),
            network: NetworkSpec::default(),
        }
    }
}

/// Names of the built-in scenarios: the default one with each preset.
#[must_use]
pub fn names() -> Vec<String> {
    crate::imu::PRESETS
        .iter()
        .map(|(name, _)| (*name).to_string())
        .collect()
}

impl Scenario {
    /// Start position.
    #[must_use]
    pub fn start(&self) -> Geodetic {
        Geodetic {
            lat: self.latitude_deg.to_radians(),
            lon: self.longitude_deg.to_radians(),
            h: self.height_m,
        }
    }
}
