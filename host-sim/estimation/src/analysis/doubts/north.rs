//! A standstill on which the gyros cannot find north. The heading of every scheme then is a matter
//! of luck, and so are all errors after it.

use super::evidence::Evidence;
use super::{Doubt, Says};
use crate::learning::teacher::Assumptions;
use firmware::plausibility::Expected;
use host_core::inertial::earth::OMEGA_IE;
use host_core::inertial::units::{DEG, DEG_PER_H};

/// Largest standard deviation of a heading from a standstill, rad: twice that of the device, which
/// goes on to look for a better one.
const FINDS: f64 = 0.2;
/// A heading that is known by so much, rad, is not known at all.
const ANY: f64 = 60.0 * DEG;

/// Standard deviation of the heading from a standstill of so many seconds, rad: bias and noise of
/// the gyros against the Earth's rotation about the axis that points north.
fn sigma(expected: &Expected, seconds: f64, lat_deg: f64) -> f64 {
    let bias = f64::from(expected.gyro.bias_turn_on);
    let noise = f64::from(expected.gyro.white_noise) / seconds.sqrt();
    bias.hypot(noise) / (OMEGA_IE * lat_deg.to_radians().cos())
}

/// Whether gyros of this class find north in a standstill of so many seconds at this latitude.
#[must_use]
pub fn finds_north(assumed: &Assumptions, seconds: f64, lat_deg: f64) -> bool {
    sigma(&super::expected(assumed), seconds, lat_deg) <= FINDS
}

/// A standstill is declared, and the gyros do not find north in it.
pub(super) fn doubt(evidence: &Evidence, expected: &Expected, says: &Says) -> Option<Doubt> {
    let [begin, end] = evidence.declared?;
    let fix = evidence.fixes.iter().find(|fix| fix.has_position())?;
    let bias = f64::from(expected.gyro.bias_turn_on);
    let sigma = sigma(expected, end - begin, fix.lat_deg);
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
        let field = super::standstill::field(says);
        let heading = match field {
            "--standstill-s" => "--heading",
            _ => "heading_deg",
        };
        let remedy = format!(
            "leave it out: then the attitude is found in motion, with {heading} if you know it; or \
             give roll, pitch and heading"
        );
        (field.to_owned(), problem, remedy)
    })
}
