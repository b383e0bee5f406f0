//! Any bytes as a recorded NovAtel log, with the checksums repaired where a message stands.

use firmware::wire::ImuFormat;
use host_core::inertial::axes::Axes;
use host_io::recordings::novatel;

/// Whether samples were read.
pub fn run(input: &[u8]) -> bool {
    let path = crate::file("in.gps", &crate::repaired(ImuFormat::Novatel, input));
    let recording = match novatel::read(&path) {
        Ok(recording) => recording,
        Err(error) => return crate::refused(&error),
    };
    let axes = Axes::RIGHT_FORWARD_UP;
    let record = novatel::record(&recording, axes, None);
    if let Ok(record) = &record {
        crate::finite(record);
    }
    let _ = novatel::session(&recording, axes, None);
    let _ = novatel::log(&recording, axes, None);
    record.is_ok()
}
