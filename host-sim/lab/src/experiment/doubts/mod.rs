//! Doubts about a recording before it is replayed: contradictions between its samples and its
//! header or the assumed class of sensor. The rules at rest are those of the device
//! ([`firmware::plausibility`]). A recording also has fixes along the whole drive, so that its
//! gyros can be compared with the changes of course, and a drive without a rest with gravity.

mod observed;
#[cfg(test)]
mod tests;

use crate::learning::teacher::Assumptions;
use firmware::configuration::{Triad, VehicleKind};
use firmware::plausibility::{EARTH, Expected, Means};
use firmware::units::G;
use firmware::wire::command::fault;
use host_core::inertial::units::{DEG_PER_H, DEG_PER_SQRT_H, UG_PER_SQRT_HZ};
use host_io::recordings::generic::NamedUnit;
use host_io::recordings::record::Record;
use host_unit::{Unit, presets};
use nalgebra::Vector3;
use observed::Observed;
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// Noise or bias that differs from the assumed class by more than this factor is reported.
const FACTOR: f64 = 5.0;
/// Sway of a standing vehicle by people, wind and engine: standard deviations of angle, rad, and
/// velocity, m/s (assumed, as in [`firmware::align`]). It hides the noise of good sensors.
const SWAY: [f64; 2] = [1.4e-4, 1.4e-2];
/// A stated rate that is off by more than this share is reported.
const RATE_SHARE: f64 = 0.02;
/// Smallest reported difference between gravity and the mean specific force of a drive without a
/// rest, as a share.
const DRIVE_SHARE: f64 = 0.3;
/// A unit fits if it brings a value this close to the expected one, as a share.
const FITS: f64 = 0.15;
/// Smallest reported ratio of rotation and change of course, as a factor either way.
const TURNING: f64 = 2.5;

/// A doubt: what it is about, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// File that contradicts the samples.
    pub file: PathBuf,
    /// Field of its header, or option of the command.
    pub field: String,
    /// The rest of a sentence that begins with the field.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (
            file,
            Self {
                field,
                problem,
                remedy,
                ..
            },
        ) = (self.file.display(), self);
        write!(f, "{file}: warning: '{field}' {problem}; remedy: {remedy}")
    }
}

/// The field of a recording that states the unit of a triad's values.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name of the field or option.
    pub name: String,
    /// The unit that the file names, if any.
    pub named: Option<NamedUnit>,
    /// All units that it could name.
    pub units: Vec<NamedUnit>,
}

impl Field {
    /// A field of a format that has no choice of units.
    #[must_use]
    pub fn fixed(name: &str) -> Self {
        Self {
            name: name.into(),
            named: None,
            units: Vec::new(),
        }
    }

    /// The units for which `fits` is true of the factor that they change values by, as a remedy.
    fn fitting(&self, fits: impl Fn(f64) -> bool) -> Option<String> {
        let (_, named) = self.named.as_ref()?;
        let fitting = self.units.iter().filter(|(_, unit)| fits(unit / named));
        let names: Vec<_> = fitting.map(|(name, _)| format!("'{name}'")).collect();
        (!names.is_empty()).then(|| format!("the unit {} would fit", names.join(" or ")))
    }

    fn remedy(&self, fits: impl Fn(f64) -> bool) -> String {
        let fitting = self.fitting(fits);
        fitting.unwrap_or_else(|| match self.named {
            Some(_) => "check the unit; none of those that the header may name fits".into(),
            None => "check that the file is in the units of its format".into(),
        })
    }
}

/// The statements of a recording about its samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Says {
    /// The file with these statements.
    pub file: PathBuf,
    /// Gyros.
    pub gyro: Field,
    /// Accelerometers.
    pub accel: Field,
    /// Name of the field of the axes, with an example of right ones.
    pub axes: (String, String),
    /// Name of the field of the rate, and the rate, Hz, if it is stated.
    pub rate: Option<(String, f64)>,
}

/// The class of sensor that is assumed.
#[derive(Debug, Clone, Copy)]
pub struct Class<'a> {
    /// The assumptions of this class.
    pub assumed: &'a Assumptions,
    /// Whether the user has named it.
    pub given: bool,
}

/// All doubts about a recording.
#[must_use]
pub fn doubts(record: &Record, says: &Says, class: Class<'_>) -> Vec<Warning> {
    let expected = expected(class.assumed);
    let observed = Observed::of(record, &expected);
    let warn = |field: &str, problem, remedy| Warning {
        file: says.file.clone(),
        field: field.into(),
        problem,
        remedy,
    };
    let found = [
        rate(says, &observed),
        gravity(says, &observed),
        axes(says, &observed),
        gyros(says, &observed, &expected, class.given),
        sheet(&observed, &expected, class),
    ];
    let found = found.into_iter().flatten();
    found
        .map(|(field, problem, remedy)| warn(&field, problem, remedy))
        .collect()
}

/// Field, problem and remedy.
type Doubt = (String, String, String);

/// The values that the device's plausibility checks expect of an assumed class.
fn expected(assumed: &Assumptions) -> Expected {
    let triad = |bias: f64, noise: f64, scale: f64| Triad {
        bias_turn_on: bias as f32,
        bias_in_run: 0.0,
        white_noise: noise as f32,
        scale: scale as f32,
        misalignment: 0.0,
        g_sensitivity: 0.0,
        range: f32::MAX,
    };
    let Assumptions { prior, noise, .. } = assumed;
    Expected {
        check_rate: false,
        up: [0.0, 0.0, -1.0],
        vehicle: VehicleKind::Land,
        gyro: triad(prior.gyro_bias, noise.gyro, prior.scale[0]),
        accel: triad(prior.accel_bias, noise.accel, prior.scale[1]),
    }
}

fn rate(says: &Says, observed: &Observed) -> Option<Doubt> {
    let (field, stated) = says.rate.as_ref()?;
    let off = observed.rate_hz / stated - 1.0;
    (off.abs() > RATE_SHARE).then(|| {
        let problem = format!(
            "says {stated} samples a second, the time stamps {:.1}",
            observed.rate_hz
        );
        (
            field.clone(),
            problem,
            format!("give {:.0}", observed.rate_hz),
        )
    })
}

fn gravity(says: &Says, observed: &Observed) -> Option<Doubt> {
    let size = |force: [f32; 3]| Vector3::from(force).map(f64::from).norm();
    let (size, when) = match (observed.fault(fault::GRAVITY), observed.drive()) {
        (Some(found), _) => (size(found.means.force), "at rest"),
        (None, Some(force)) if (force.norm() / G - 1.0).abs() > DRIVE_SHARE => {
            (force.norm(), "on the mean of the drive")
        }
        _ => return None,
    };
    let problem = format!("gives a specific force of {size:.3} m/s2 {when} instead of gravity");
    let remedy = says
        .accel
        .remedy(|factor| (size * factor / G - 1.0).abs() < FITS);
    Some((says.accel.name.clone(), problem, remedy))
}

fn axes(says: &Says, observed: &Observed) -> Option<Doubt> {
    let (field, example) = &says.axes;
    let up = |force: &Vector3<f64>| {
        let axis = force.iamax();
        let name = ["forward", "right", "down"][axis];
        match force[axis] < 0.0 {
            true => format!("against the axis called {name}"),
            false => format!("along the axis called {name}"),
        }
    };
    let wrong = observed.fault(fault::AXES);
    let force = match (wrong, observed.drive()) {
        (Some(found), _) => Vector3::from(found.means.force).map(f64::from),
        (None, Some(force)) if -force.z < 0.866 * force.norm() => force,
        _ => {
            let turns_back = observed.turning.is_some_and(|turning| turning < 0.0);
            return turns_back.then(|| {
                let problem = "turns the other way than the course of the fixes".to_owned();
                (
                    field.clone(),
                    problem,
                    format!("check the signs, as in {example}"),
                )
            });
        }
    };
    let problem = format!("makes the specific force point {}, not up", up(&force));
    let remedy = format!("give the axis that points down as the third one, as in {example}");
    Some((field.clone(), problem, remedy))
}

fn gyros(says: &Says, observed: &Observed, expected: &Expected, given: bool) -> Option<Doubt> {
    let turning = observed.turning.map(f64::abs);
    let turns = |factor: f64| turning.is_none_or(|t| ((t * factor).ln()).abs() < TURNING.ln());
    let name = says.gyro.name.clone();
    if !turns(1.0) {
        let turning = turning.unwrap_or_default();
        let problem =
            format!("gives {turning:.3} of the rotation that the course of the fixes has");
        let remedy = says
            .gyro
            .remedy(|factor| (turning * factor - 1.0).abs() < 2.0 * FITS);
        return Some((name, problem, remedy));
    }
    if turning.is_some() {
        return None; // the unit is right, whatever the rate at rest is
    }
    let means = observed.fault(fault::EARTH_RATE)?.means;
    let size = norm(means.rate);
    let problem = format!(
        "gives {:.3} deg/h at rest, where the Earth turns by 15.041 deg/h",
        size / DEG_PER_H
    );
    let scaled = |factor: f64| Means {
        rate: means.rate.map(|w| (f64::from(w) * factor) as f32),
        scatter: means.scatter.map(|w| (f64::from(w) * factor) as f32),
        ..means
    };
    let fits = |factor: f64| {
        scaled(factor).judge(expected) & fault::EARTH_RATE == 0
            && size * factor > 0.1 * f64::from(EARTH)
    };
    // without a datasheet, a missing one is more likely than a wrong unit
    let remedy = says.gyro.fitting(fits);
    let other = || given.then(|| "check the unit, and the bias of the datasheet".into());
    Some((name, problem, remedy.or_else(other)?))
}

fn norm(v: [f32; 3]) -> f64 {
    Vector3::from(v).map(f64::from).norm()
}

/// Compares bias and noise at rest with the datasheet, for a class that the user has not named.
fn sheet(observed: &Observed, expected: &Expected, class: Class<'_>) -> Option<Doubt> {
    let noise = observed.noise()?;
    let (bias, seconds) = observed.bias()?;
    let fits = |sheet: &Expected| {
        let noises = noise.iter().zip([&sheet.gyro, &sheet.accel]).zip(SWAY);
        let quiet = noises.fold(true, |all, ((observed, triad), sway)| {
            all & (*observed <= FACTOR * f64::from(triad.white_noise) + 2.0 * sway)
        });
        let noisy = noise[0] == 0.0 || noise[0] * FACTOR > f64::from(sheet.gyro.white_noise);
        let most = FACTOR * f64::from(sheet.gyro.bias_turn_on) + 2.0 * SWAY[0] / seconds;
        quiet && noisy && bias <= most
    };
    if class.given || fits(expected) {
        return None;
    }
    let of_preset =
        |name: &str| Unit::preset(name).map(|unit| self::expected(&Assumptions::of(&unit)));
    let mut names = presets::names();
    names.retain(|name| of_preset(name).is_some_and(|sheet| fits(&sheet)));
    let remedy = match names.is_empty() {
        true => "give the unit's file; no preset fits".into(),
        false => format!(
            "give the unit's file, or a preset: {} would fit",
            names.join(" or ")
        ),
    };
    let problem = format!(
        "is not given, and at rest the sensors are not of the class assumed: {:.2} deg/h off the \
         Earth's rate, noise {:.2e} deg/sqrt(h) and {:.1} ug/sqrt(Hz)",
        bias / DEG_PER_H,
        noise[0] / DEG_PER_SQRT_H,
        noise[1] / UG_PER_SQRT_HZ
    );
    Some(("--unit".into(), problem, remedy))
}
