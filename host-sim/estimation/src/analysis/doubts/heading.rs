//! A heading that is stated for the start, against the courses of the fixes. Only what turns as its
//! course does points where it goes; a ship in a current and what flies sideways do not.

use super::evidence::Evidence;
use super::measure::AS_ONE;
use super::turning::{self, courses};
use super::{Doubt, Says};
use firmware::plausibility::Expected;
use host_core::inertial::units::DEG;

/// The courses of so many seconds of motion are compared; later ones have more drift of the gyros.
const FIRST_S: f64 = 60.0;
/// Least number of courses.
const COURSES: usize = 10;
/// Smallest difference that is reported: rad, and standard deviations of heading and gyros.
const LEAST: f64 = 20.0 * DEG;
const SIGMAS: f64 = 3.0;
/// Length of the mean of the directions from which on they are one direction.
const ONE_WAY: f64 = 0.95;

/// A heading is stated, and the vehicle goes another way.
pub(super) fn doubt(evidence: &Evidence, expected: &Expected, says: &Says) -> Option<Doubt> {
    let (at, [heading, sigma]) = evidence.heading?;
    let (_, together) = turning::factor(evidence)?;
    if together < AS_ONE {
        return None;
    }
    let courses = courses(&evidence.fixes);
    let mut fast = courses.iter().filter(|course| course.is_fast());
    let first = fast.next()?.time;
    let before = evidence.turned(at).unwrap_or(0.0);
    let headings = courses
        .iter()
        .filter(|course| course.is_fast() && course.time <= first + FIRST_S)
        .filter_map(|course| {
            let [n, e] = course.velocity;
            Some(e.atan2(n) - (evidence.turned(course.time)? - before))
        });
    let (count, north, east) = headings.fold((0usize, 0.0, 0.0), |(count, n, e), angle| {
        (count + 1, n + angle.cos(), e + angle.sin())
    });
    let one_way = f64::hypot(north, east) > ONE_WAY * count as f64;
    let course = east.atan2(north);
    let off = (course - heading).sin().atan2((course - heading).cos());
    let drift = f64::from(expected.gyro.bias_turn_on) * (first + FIRST_S - at);
    let most = LEAST.max(SIGMAS * sigma.hypot(drift));
    (count >= COURSES && one_way && off.abs() > most).then(|| {
        let degrees = |angle: f64| (angle / DEG).round().rem_euclid(360.0);
        let field = match says.is_header() {
            true => "start.heading_deg",
            false => "heading at the start",
        };
        let problem = format!(
            "says {} deg, and by the course of the fixes, with the gyros' rotation since then, the \
             vehicle pointed to {} deg",
            degrees(heading),
            degrees(course)
        );
        let remedy = match (off.abs() - std::f64::consts::PI).abs() < LEAST {
            false => format!("give {}, clockwise from north", degrees(course)),
            true => format!(
                "give {}, or turn the axes about down by 180 deg if that heading is right",
                degrees(course)
            ),
        };
        (field.into(), problem, remedy)
    })
}
