//! From the errors of the accelerometers to the numbers of a unit file.
//!
//! These are standard deviations around zero, because the device's learner begins there: each is
//! the root of the squares of the largest error and of what is not known of it, so that errors and
//! limits of this sensor are within what the file says.

use super::super::standing::{Number, three};
use super::{Fit, PRIOR};
use host_core::inertial::units::{PPM, UG};
use host_unit::Unit;
use host_unit::triads::MRAD;

/// Pairs of axes.
pub const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// The three values of a number of the unit file.
struct Three {
    key: &'static str,
    unit: &'static str,
    preset: f64,
    si: f64,
    /// Whether the rests showed it, value and standard deviation.
    all: Vec<(bool, [f64; 2])>,
    /// What gravity cannot show, in units of the file.
    besides: f64,
}

impl Three {
    fn number(&self, name: &str) -> Number {
        let shown = self.all.iter().filter(|(shown, _)| *shown);
        let size = |[value, sigma]: &[f64; 2]| (value / self.si).hypot(sigma / self.si);
        let largest = shown.map(|(_, of)| size(of)).fold(0.0, f64::max);
        let hidden = self.all.iter().filter(|(shown, _)| !shown).count();
        let besides = match hidden {
            0 => self.besides,
            _ => self.preset,
        };
        let of_preset = format!("with {} of {name}", three(besides));
        let more = match (hidden, besides > 0.0) {
            (0, false) => String::new(),
            (0, true) => format!("; {of_preset} for what gravity does not show"),
            (n, _) => format!("; {n} of 3 not shown by the rests, so {of_preset}"),
        };
        Number {
            key: self.key,
            unit: self.unit,
            value: three(largest.hypot(besides).max(1e-6)),
            measured: (hidden == 0).then_some(largest),
            preset: self.preset,
            source: format!("measured: largest of three with its sigma{more}"),
        }
    }
}

/// The numbers of the accelerometers. `unit` gives those that the rests do not show.
#[must_use]
pub fn numbers(fit: &Fit, unit: &Unit, name: &str) -> Vec<Number> {
    let a = &unit.accel;
    let bias = (0..3).map(|i| (fit.shows_bias(i), [fit.bias[i], fit.bias_sigma[i]]));
    let scale = (0..3).map(|i| (fit.shows_scale(i), [fit.map[i][i], fit.map_sigma[i][i]]));
    // half of what is between two axes belongs to each
    let skew = PAIRS.map(|pair| (fit.shows_skew(pair), fit.skew(pair).map(|x| 0.5 * x)));
    let rotation_hidden = fit.map_sigma[0][1] > 0.5 * PRIOR[0];
    let all = [
        Three {
            key: "accel.bias_turn_on_ug",
            unit: "ug",
            preset: a.bias_turn_on_ug,
            si: UG,
            all: bias.collect(),
            besides: 0.0,
        },
        Three {
            key: "accel.scale_ppm",
            unit: "ppm",
            preset: a.scale_ppm,
            si: PPM,
            all: scale.collect(),
            besides: 0.0,
        },
        Three {
            key: "accel.misalignment_mrad",
            unit: "mrad",
            preset: a.misalignment_mrad,
            si: MRAD,
            all: skew.to_vec(),
            besides: if rotation_hidden {
                a.misalignment_mrad
            } else {
                0.0
            },
        },
    ];
    all.map(|three| three.number(name)).into()
}

/// The scale factor of the gyros, if turns showed one of an axis.
#[must_use]
pub fn gyro_scale(scales: &[Option<[f64; 2]>; 3], unit: &Unit, name: &str) -> Option<Number> {
    let shown = scales.iter().flatten();
    let sizes = shown.map(|[value, sigma]| (value / PPM).hypot(sigma / PPM));
    let largest = sizes.reduce(f64::max)?;
    let preset = unit.gyro.scale_ppm;
    let whole = scales.iter().all(Option::is_some);
    let (value, more) = match whole {
        true => (largest, String::new()),
        false => (
            largest.hypot(preset),
            format!("; not of all axes, so with {} of {name}", three(preset)),
        ),
    };
    Some(Number {
        key: "gyro.scale_ppm",
        unit: "ppm",
        value: three(value),
        measured: whole.then_some(largest),
        preset,
        source: format!("measured: largest by turns with its sigma{more}"),
    })
}
