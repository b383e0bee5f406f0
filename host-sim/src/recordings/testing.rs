//! What tests of recordings share.

use crate::error::Error;
use crate::inertial::earth::Geodetic;
use crate::inertial::session::Session;
use crate::inertial::sins::Increment;
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::ImuSpec;
use crate::simulator::session::{SessionConfig, simulate};
use std::path::{Path, PathBuf};

/// A file called `name` with `bytes`, and the temporary folder that it lives in.
pub(crate) fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// Whether all of these are numbers.
pub(crate) fn finite(samples: &[Increment]) -> bool {
    let mut values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
    values.all(|x| x.is_finite())
}

/// Folder with recorded data: `LRNN_DATA` if it is set, else `../shared/data` beside the project.
/// `None` if that folder does not exist.
pub(crate) fn data_dir() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("LRNN_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A recorded file, if it is there; otherwise prints that the test is skipped.
pub(crate) fn recorded(name: &str) -> Option<PathBuf> {
    let path = data_dir().map(|dir| dir.join(name)).filter(|p| p.is_file());
    if path.is_none() {
        println!("skipped: no {name} in ../shared/data or LRNN_DATA");
    }
    path
}

/// The message of an error from the name of the file on. It must have a remedy.
pub(crate) fn message(error: &Error) -> String {
    let text = error.to_string();
    assert!(text.contains("; remedy: "), "{text}");
    let start = text.find("/in.").map_or(0, |at| at + 1);
    text[start..].to_owned()
}

/// A simulated drive with a medium laser gyro at 100 Hz: `still` seconds at rest, then `drive`
/// seconds on a road.
pub(crate) fn simulated(still: f64, drive: f64, seed: u64) -> Session {
    let mut imu = ImuSpec::preset("medium").unwrap();
    imu.rate_hz = 100;
    let config = SessionConfig {
        imu: &imu,
        gnss: &GnssSpec::default(),
        start: Geodetic {
            lat: 0.8,
            lon: 0.2,
            h: 200.0,
        },
        heading: 1.0,
        standstill_s: still,
        drive_s: drive,
        segments: None,
        vibration: 1.0,
        unit: seed,
        turn_on: seed,
        drive: seed,
    };
    simulate(&config).0
}
