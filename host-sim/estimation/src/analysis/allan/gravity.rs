//! Whether the accelerometers of a recording at rest measure gravity. If they do not, the columns
//! are not in the units that their names or their header say, and all noises are wrong.

use super::Kind;
use host_core::error::Error;
use host_core::inertial::units::G0;

/// Distance of the mean specific force from gravity that is no fault, as a share.
const SHARE: f64 = 0.05;

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

#[cfg(test)]
mod tests {
    use super::*;

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
