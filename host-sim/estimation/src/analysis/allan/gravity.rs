//! Whether the accelerometers of a recording at rest measure gravity, and its gyros hardly a
//! rotation. If they do not, the columns are not in the units that their names or their header say,
//! and all noises are wrong.

use super::Kind;
use host_core::error::Error;
use host_core::inertial::units::{DEG, G0};

/// Distance of the mean specific force from gravity that is no fault, as a share.
const SHARE: f64 = 0.05;
/// Largest mean rate at rest: the bias of poor gyros, rad/s.
const STILL: f64 = 20.0 * DEG;
/// Sizes of rates at rest, deg/h, that are the Earth's and a bias.
const EARTH_DPH: std::ops::RangeInclusive<f64> = 5.0..=45.0;

/// Mean of one axis of a sensor, and its kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    pub(super) kind: Kind,
    /// rad/s or m/s2.
    pub(super) value: f64,
    pub(super) rate_hz: f64,
}

/// Checks the means of all sensors of a recording. Returns a note if the force is not gravity and
/// nothing explains it. Without three accelerometers there is nothing to check.
///
/// # Errors
/// The force is what a known mistake makes of gravity.
pub(super) fn check(source: &str, means: &[Mean]) -> Result<Option<String>, Error> {
    let accels = means.iter().filter(|mean| mean.kind == Kind::Accel);
    let [x, y, z] = accels.collect::<Vec<_>>()[..] else {
        return Ok(None);
    };
    let force = x.value.hypot(y.value).hypot(z.value);
    let is_gravity = |force: f64| (force / G0 - 1.0).abs() < SHARE;
    if is_gravity(force) {
        return Ok(None);
    }
    let rate = x.rate_hz;
    let known = [
        (
            1.0 / rate,
            "the columns hold rates (rad/s, m/s2), not increments: name them so",
        ),
        (
            rate,
            "the columns hold increments (rad, m/s), not rates: name them so",
        ),
        (G0, "the accelerometers are in g, not in m/s2"),
        (1.0 / G0, "the accelerometers are in m/s2, not in g"),
        (1e-3 * G0, "the accelerometers are in mg, not in m/s2"),
        (1e-3, "the accelerometers are in mg, not in g"),
        (
            G0 / rate,
            "the columns hold rates in g, not increments in m/s: name them so",
        ),
        (1e3, "the times are in ms, not in s"),
        (1e6, "the times are in us, not in s"),
        (1e9, "the times are in ns, not in s"),
    ];
    let problem =
        format!("has a mean specific force of {force:.3} m/s2 at rest instead of gravity");
    match known.iter().find(|(factor, _)| is_gravity(force * factor)) {
        Some((factor, cause)) => Err(Error::Option {
            option: source.to_owned(),
            problem,
            remedy: format!("{cause} (then it is {:.3} m/s2)", force * factor),
        }),
        None => Ok(Some(format!(
            "the recording {problem}, so its units, or that it is at rest, are doubtful"
        ))),
    }
}

/// Checks the mean rate of a recording at rest. Returns a note if no gyro at rest shows it and
/// nothing explains it. Without three gyros there is nothing to check.
///
/// # Errors
/// The rate is that of the Earth in deg/h, taken as rad/s.
pub(super) fn check_rate(source: &str, means: &[Mean]) -> Result<Option<String>, Error> {
    let gyros = means.iter().filter(|mean| mean.kind == Kind::Gyro);
    let [x, y, z] = gyros.collect::<Vec<_>>()[..] else {
        return Ok(None);
    };
    let rate = x.value.hypot(y.value).hypot(z.value);
    if rate <= STILL {
        return Ok(None);
    }
    let problem = format!("has a mean rate of {:.1} deg/s at rest", rate / DEG);
    if EARTH_DPH.contains(&rate) {
        return Err(Error::Option {
            option: source.to_owned(),
            problem,
            remedy: format!("the gyros are in deg/h, not in rad/s (then it is {rate:.1} deg/h)"),
        });
    }
    Ok(Some(format!(
        "the recording {problem}, so the units of the gyros, or that it is at rest, are doubtful"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_that_no_gyro_has_at_rest_is_reported() {
        let checked = |rate: [f64; 3]| {
            let mean = |value| Mean {
                kind: Kind::Gyro,
                value,
                rate_hz: 100.0,
            };
            check_rate("rest.csv", &rate.map(mean))
        };
        assert_eq!(checked([5.0 * DEG, 0.0, -3.0 * DEG]).unwrap(), None);
        let why = checked([9.0, -3.0, 12.0]).unwrap_err().to_string();
        let expected = "remedy: the gyros are in deg/h, not in rad/s (then it is 15.3 deg/h)";
        assert!(why.ends_with(expected), "{why}");
        let note = checked([0.0, 0.0, 1.0]).unwrap().unwrap();
        assert!(note.contains("57.3 deg/s"), "{note}");
    }

    fn checked(force: [f64; 3], rate_hz: f64) -> Result<Option<String>, Error> {
        let mean = |value| Mean {
            kind: Kind::Accel,
            value,
            rate_hz,
        };
        check("rest.csv", &force.map(mean))
    }

    #[test]
    fn only_gravity_passes_and_known_mistakes_are_named() {
        let down = [0.3, -0.2, -9.79];
        assert_eq!(checked(down, 100.0).unwrap(), None);
        for (factor, part) in [
            (100.0, "hold rates (rad/s, m/s2), not increments"),
            (0.01, "hold increments (rad, m/s), not rates"),
            (1.0 / G0, "in g, not in m/s2"),
            (G0, "in m/s2, not in g"),
            (1e-3, "the times are in ms"),
            (1e-9, "the times are in ns"),
        ] {
            let why = checked(down.map(|f| f * factor), 100.0)
                .unwrap_err()
                .to_string();
            let start = why.starts_with("rest.csv: has a mean specific force of");
            assert!(start && why.contains(part), "{factor}: {why}");
        }
        let note = checked([0.0, 0.0, -4.5], 100.0).unwrap().unwrap();
        assert!(note.contains("4.500 m/s2"), "{note}");
        // two axes cannot show it
        let two = [9.8, 0.0].map(|value| Mean {
            kind: Kind::Accel,
            value,
            rate_hz: 100.0,
        });
        assert_eq!(check("rest.csv", &two).unwrap(), None);
    }
}
