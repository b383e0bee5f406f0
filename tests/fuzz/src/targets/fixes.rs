//! Any file of fixes beside a recording: reports of gpsd in JSON, solutions of RTKLIB, the log of a
//! receiver.

use host_io::recordings::record::TimedFix;
use host_io::recordings::{gpsd, receiver, rtklib};

/// Whether fixes were read.
pub fn run(input: &[u8]) -> bool {
    let file = crate::file("fixes.log", input);
    let fixes = if rtklib::is_one(&file) {
        rtklib::read(&file).map(|solutions| solutions.fixes)
    } else if gpsd::is_one(&file) {
        gpsd::read(&file, &|_, _| ()).map(|solutions| solutions.fixes)
    } else {
        receiver::read(&file, None, &|_, _| ()).map(|log| log.fixes)
    };
    match fixes {
        Ok(fixes) => {
            let rises = fixes.windows(2).all(|pair| pair[0].time < pair[1].time);
            assert!(rises && fixes.iter().all(is_sound), "{fixes:?}");
            true
        }
        Err(error) => crate::refused(&error),
    }
}

/// Its numbers are finite, and its standard deviations positive.
fn is_sound(fix: &TimedFix) -> bool {
    let place = [fix.time, fix.lat_deg, fix.lon_deg, fix.height_m];
    let mut numbers = place.iter().chain(&fix.velocity);
    let on_earth = fix.lat_deg.abs() <= 90.0 && fix.lon_deg.abs() <= 360.0;
    numbers.all(|number| number.is_finite()) && on_earth && fix.sigmas.iter().all(|s| *s > 0.0)
}
