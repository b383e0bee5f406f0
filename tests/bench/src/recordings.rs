//! Recorded files, a simulated drive, and a check of error messages.

use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use std::path::{Path, PathBuf};

/// A file called `name` with `bytes`, in a temporary folder, which is returned too.
pub fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).expect("a writable file");
    (dir, path)
}

/// Whether all values are finite.
pub fn finite(samples: &[Increment]) -> bool {
    let mut values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
    values.all(|x| x.is_finite())
}

/// Folder with recorded data: `LRNN_DATA` if it is set, else `../shared/data` beside the project.
/// `None` if that folder does not exist.
pub fn data_dir() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("LRNN_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// A recorded file, if it is there; otherwise prints that the test is skipped.
pub fn recorded(name: &str) -> Option<PathBuf> {
    let path = data_dir().map(|dir| dir.join(name)).filter(|p| p.is_file());
    if path.is_none() {
        println!("skipped: no {name} in ../shared/data or LRNN_DATA");
    }
    path
}

/// The recorded session of a MEMS unit beside a fibre-optic gyro, if its files are there.
pub fn fog_mems() -> Option<Session> {
    let (mems, fog) = ("fog-mems-mems.csv.gz", "fog-mems-fog.csv.gz");
    let session = host_io::recordings::fog_mems::session(&recorded(mems)?, &recorded(fog)?);
    Some(session.expect("a good recording"))
}

/// The message of an error, from the name of the file on. Asserts that it has a remedy.
pub fn message(error: &Error) -> String {
    let text = error.to_string();
    assert!(text.contains("; remedy: "), "{text}");
    let start = text.find("/in.").map_or(0, |at| at + 1);
    text[start..].to_owned()
}

/// A simulated drive with a medium laser gyro at 100 Hz: `still` seconds at rest, then `drive`
/// seconds on a road.
pub fn simulated(still: f64, drive: f64, seed: u64) -> Session {
    let mut imu = ImuSpec::preset("medium").expect("a preset");
    imu.rate_hz = 100;
    let config = SessionConfig {
        start: Geodetic {
            lat: 0.8,
            lon: 0.2,
            h: 200.0,
        },
        ..SessionConfig::new(&imu, [still, drive], [seed, seed, seed])
    };
    simulate(&config).0
}
