//! A standstill on which the gyros cannot find north. The heading of every scheme then is a matter
//! of luck, and so are all errors after it.

use super::evidence::Evidence;
use super::{Doubt, Says};
use firmware::plausibility::Expected;
use host_core::inertial::earth::OMEGA_IE;
use host_core::inertial::units::{DEG, DEG_PER_H};

/// Largest standard deviation of a heading from a standstill, rad: twice that of the device, which
/// goes on to look for a better one.
const FINDS: f64 = 0.2;
/// A heading that is known by so much, rad, is not known at all.
const ANY: f64 = 60.0 * DEG;

/// Bias and noise of the gyros against the Earth's rotation about the axis that points north.
pub(super) fn doubt(evidence: &Evidence, expected: &Expected, says: &Says) -> Option<Doubt> {
    let [begin, end] = evidence.declared?;
    let fix = evidence.fixes.iter().find(|fix| fix.has_position())?;
    let bias = f64::from(expected.gyro.bias_turn_on);
    let noise = f64::from(expected.gyro.white_noise) / (end - begin).sqrt();
    let sigma = bias.hypot(noise) / (OMEGA_IE * fix.lat_deg.to_radians().cos());
    (sigma > FINDS).then(|| {
        let heading = match sigma < ANY {
            true => format!("to {:.0} deg only", sigma / DEG),
            false => "not at all".into(),
        };
        let problem = format!(
            "takes the heading from the Earth's rotation, which gyros with a bias of {:.1} deg/h \
             find {heading}, so that the errors of all rows are mostly those of the heading",
            bias / DEG_PER_H
        );
        let is_header = says.file.extension().is_some_and(|e| e == "toml");
        let [field, heading] = match is_header {
            true => ["start.standstill_s", "heading_deg"],
            false => ["--standstill-s", "--heading"],
        };
        let remedy = format!(
            "leave it out: then the attitude is found in motion, with {heading} if you know it; or \
             give roll, pitch and heading"
        );
        (field.to_owned(), problem, remedy)
    })
}
