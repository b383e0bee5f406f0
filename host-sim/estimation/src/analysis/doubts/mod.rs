//! Doubts about a recording before it is replayed: contradictions between its samples, its fixes
//! and its header or the assumed class of sensor. The rules at rest are those of the device
//! ([`firmware::plausibility`]). A recording also has fixes along the whole drive, so that its
//! gyros can be compared with the changes of course, its positions with its velocities, and a drive
//! without a rest with gravity.
//!
//! A contradiction does not say which of two statements is wrong. So the mistakes that people make
//! are fitted, in the order of one table (`mistakes`), and the one that explains most is reported.

mod ahead;
mod change;
mod evidence;
mod heading;
mod measure;
mod mistakes;
mod north;
mod outside;
mod rests;
mod signs;
mod slope;
mod standstill;
mod stuck;
mod table;
#[cfg(test)]
mod tests;
mod turning;

use crate::learning::teacher::Assumptions;
use change::Change;
use evidence::Evidence;
use firmware::configuration::{Triad, VehicleKind};
use firmware::plausibility::Expected;
use host_core::inertial::sins::Increment;
use host_core::inertial::units::{DEG_PER_H, DEG_PER_SQRT_H, UG_PER_SQRT_HZ};
use host_io::recordings::generic::NamedUnit;
use host_io::recordings::record::Record;
use host_unit::{Unit, presets};
pub use north::finds_north;
use rests::Rests;
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// Metres of a degree of latitude.
const DEGREE_M: f64 = 111_200.0;
/// The axes of the vehicle.
const AXES: [&str; 3] = ["forward", "right", "down"];
/// Noise or bias that differs from the assumed class by more than this factor is reported.
const FACTOR: f64 = 5.0;
/// Sway of a standing vehicle by people, wind and engine: standard deviations of angle, rad, and
/// velocity, m/s (assumed, as in [`firmware::align`]). It hides the noise of good sensors.
const SWAY: [f64; 2] = [1.4e-4, 1.4e-2];
/// A stated rate that is off by more than this share is reported.
const RATE_SHARE: f64 = 0.02;

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

    /// A remedy where no unit fits.
    fn unfit(&self) -> String {
        match self.named {
            Some(_) => {
                "check the unit, and the range that the sensor is set to; no unit that the header \
                           may name fits"
                    .into()
            }
            None => "check that the file is in the units of its format".into(),
        }
    }
}

/// The statements of a recording about its fixes.
#[derive(Debug, Clone, PartialEq)]
pub struct FixFields {
    /// The offset of the clocks.
    pub time: Field,
    /// Unit of the times.
    pub time_unit: Field,
    /// Unit of latitude and longitude.
    pub position: Field,
    /// Unit of the height.
    pub height: Field,
    /// Unit of the velocity.
    pub velocity: Field,
    /// Name of the field of the order of the velocity. For north, east and down: the number of the
    /// column that is said to hold it, and its sign.
    pub order: (String, Option<[(usize, f64); 3]>),
}

impl Default for FixFields {
    /// Fields of a format that has no choice of units.
    fn default() -> Self {
        Self {
            time: Field::fixed("time offset"),
            time_unit: Field::fixed("times of the fixes"),
            position: Field::fixed("positions of the fixes"),
            height: Field::fixed("heights of the fixes"),
            velocity: Field::fixed("velocities of the fixes"),
            order: ("velocities of the fixes".into(), None),
        }
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
    /// Fixes.
    pub fixes: FixFields,
}

impl Says {
    /// Whether they are those of a header file, not of a command's options.
    fn is_header(&self) -> bool {
        self.file.extension().is_some_and(|end| end == "toml")
    }
}

/// An offset of the clocks that the data contradict.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeDoubt {
    /// What is added to the times of the fixes, s.
    pub stated_s: f64,
    /// What fits best, s.
    pub best_s: f64,
    /// Standard deviation of `best_s`, s.
    pub sigma_s: f64,
}

impl TimeDoubt {
    /// The contradiction, as the rest of a sentence.
    fn problem(&self) -> String {
        format!(
            "is {} s, and samples and fixes match best at {:.3} s (standard deviation {:.3} s)",
            self.stated_s, self.best_s, self.sigma_s
        )
    }
}

/// The class of sensor that is assumed.
#[derive(Debug, Clone, Copy)]
pub struct Class<'a> {
    /// The assumptions of this class.
    pub assumed: &'a Assumptions,
    /// Whether the user has named it.
    pub given: bool,
}

/// All doubts about a recording. `clock` compares the clocks of samples and fixes: the offset that
/// the data contradict, if they do.
#[must_use]
pub fn doubts(
    record: &Record,
    says: &Says,
    class: Class<'_>,
    clock: &dyn Fn(&Record) -> Option<TimeDoubt>,
) -> Vec<Warning> {
    let expected = expected(class.assumed);
    let mut evidence = Evidence::of(record);
    let warning = |(field, problem, remedy)| Warning {
        file: says.file.clone(),
        field,
        problem,
        remedy,
    };
    let first = outside::times(&evidence, says).or_else(|| outside::exchanged(&evidence, says));
    if let Some(doubt) = first {
        return vec![warning(doubt)];
    }
    let jumps = outside::jumps(&mut evidence.fixes, says);
    let held = outside::held(&evidence, says);
    let fewer = outside::thin(&mut evidence.fixes);
    let near = (jumps.is_some() || fewer).then(|| Record {
        fixes: evidence.fixes.clone(),
        ..record.clone()
    });
    let record = near.as_ref().unwrap_or(record);
    let again = |change: &Change| {
        let mut changed = record.clone();
        let fixes = record.fixes.iter();
        changed.fixes = fixes.map(|fix| change.fix(fix)).collect();
        let sample = |s: Increment| Increment {
            dtheta: change.rate(&s.dtheta),
            dv: change.force(&s.dv),
        };
        changed.samples = record.samples.each().map(sample).collect();
        clock(&changed)
    };
    let rests = Rests::of(&evidence, &expected);
    let sheet = sheet(&rests, &expected, class);
    let mut found: Vec<Doubt> = jumps
        .into_iter()
        .chain(held)
        .chain(stuck::doubt(record, says))
        .chain(rate(says, evidence.rate_hz))
        .chain(north::doubt(&evidence, &expected, says))
        .collect();
    let mistakes = table::doubts(&evidence, &expected, says, clock(record), &again);
    if mistakes.is_empty() {
        // else the fixes may be what is wrong
        found.extend(standstill::doubt(&evidence, says));
        found.extend(heading::doubt(&evidence, &expected, says));
    }
    found.extend(mistakes);
    if !class.given {
        // without a datasheet, a missing one is more likely than a wrong unit
        let is_rate = |doubt: &Doubt| doubt.0 == says.gyro.name && doubt.1.contains("at rest");
        found.retain(|doubt| !is_rate(doubt));
    }
    found.extend(sheet);
    found.into_iter().map(warning).collect()
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

fn rate(says: &Says, rate_hz: f64) -> Option<Doubt> {
    let (field, stated) = says.rate.as_ref()?;
    let off = rate_hz / stated - 1.0;
    (off.abs() > RATE_SHARE).then(|| {
        let problem = format!("says {stated} samples a second, the time stamps {rate_hz:.1}");
        (field.clone(), problem, format!("give {rate_hz:.0}"))
    })
}

/// Compares bias and noise at rest with the datasheet, for a class that the user has not named.
fn sheet(rests: &Rests<'_>, expected: &Expected, class: Class<'_>) -> Option<Doubt> {
    let noise = rests.noise()?;
    let (bias, seconds) = rests.bias()?;
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
