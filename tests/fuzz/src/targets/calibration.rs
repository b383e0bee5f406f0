//! Any text as a calibration of another tool: it is read or refused with a message, and what was
//! read is the same after writing it in the same form.

use host_io::recordings::calibration::{Triad, kalibr, read, sm, tk};

/// Whether the calibration was read.
pub fn run(input: &[u8]) -> bool {
    let found = match read(&crate::file("calibration", input)) {
        Ok(found) => found,
        Err(error) => return crate::refused(&error),
    };
    let (accel, gyro) = (found.accel.as_ref(), found.gyro.as_ref());
    let text = match (found.tool, accel, &found.noise) {
        ("imu_tk", Some(accel), _) => tk::write(accel),
        ("imu_calib", Some(accel), _) => sm::write(accel),
        ("Kalibr", _, Some(noise)) => kalibr::write(accel, gyro, noise, "fuzz"),
        _ => return true,
    };
    let again = read(&crate::file("again", text.as_bytes())).expect("our own text");
    let same = |a: Option<&Triad>, b: Option<&Triad>| match (a, b) {
        (Some(a), Some(b)) => {
            let size = 1.0 + a.bias.amax();
            (a.matrix - b.matrix).amax() < 1e-9 && (a.bias - b.bias).amax() < 1e-9 * size
        }
        (a, b) => a.is_none() == b.is_none(),
    };
    assert!(same(accel, again.accel.as_ref()), "{found:?} {again:?}");
    assert!(same(gyro, again.gyro.as_ref()), "{found:?} {again:?}");
    true
}
