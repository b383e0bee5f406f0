//! From what logs show to the numbers of a unit file, each with its source and the margin that it
//! has.
//!
//! A static log shows one unit, at rest. What it cannot show is taken from a preset: the one that
//! was named, else the nearest by noise ([`nearest`]).

use super::super::allan::{Analysis, Coefficient, Kind};
use super::laws::upper;
use super::{LogResults, OfLog, Scatter};
use host_core::inertial::units::{DEG_PER_H, G0, UG};
use host_unit::{Unit, presets};
use serde::Serialize;

/// Degrees between neighbouring Allan deviations and the bias instability: sqrt(2 ln 2 / pi).
const FLOOR: f64 = 0.664;
/// Degrees of freedom that the preset counts for, beside what a few logs show of the turn-ons.
const LENT: usize = 3;
/// A force off gravity counts from so many standard deviations of gravity on.
const SEEN: f64 = 2.0;

/// A number of the unit file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    /// Its key, such as `gyro.bias_turn_on_dph`.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Value in the file.
    pub value: f64,
    /// What the logs themselves show, without any margin.
    pub measured: Option<f64>,
    /// Value of the preset.
    pub preset: f64,
    /// Source and margin, for the comment beside it.
    pub source: String,
}

/// The numbers of a unit file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sheet {
    /// The preset beside which they stand.
    pub preset: String,
    /// The numbers.
    pub numbers: Vec<Number>,
}

/// Numbers of a triad, and where they stand in the file and in SI.
struct Triad<'a> {
    kind: Kind,
    keys: [&'static str; 3],
    units: [&'static str; 3],
    /// Values of the preset: white noise, in run, turn-on.
    preset: [f64; 3],
    si: f64,
    of: &'a LogResults,
    name: &'a str,
}

/// The preset whose noise is nearest to the logs'.
#[must_use]
pub fn nearest(shown: &LogResults) -> &'static str {
    let noise = [Kind::Gyro, Kind::Accel].map(|kind| seen(shown, kind, "N").map(|(_, c)| c.value));
    let far = |name: &&str| {
        let unit = Unit::preset(name).unwrap_or_default();
        let sheet = [
            unit.gyro.angle_random_walk_dpsqrth,
            unit.accel.velocity_random_walk_ugpsqrthz,
        ];
        let each = noise.iter().zip(sheet);
        each.filter_map(|(found, sheet)| Some((found.as_ref()? / sheet).ln().abs()))
            .sum::<f64>()
    };
    let mut names = presets::names();
    names.sort_by(|a, b| far(a).total_cmp(&far(b)));
    names.first().copied().unwrap_or("medium")
}

/// The numbers that the logs show, and those of the preset for what they cannot.
#[must_use]
pub fn sheet(shown: &LogResults, name: &str, unit: &Unit) -> Sheet {
    let (g, a) = (&unit.gyro, &unit.accel);
    let gyro = Triad {
        kind: Kind::Gyro,
        keys: [
            "gyro.angle_random_walk_dpsqrth",
            "gyro.bias_in_run_dph",
            "gyro.bias_turn_on_dph",
        ],
        units: ["deg/sqrt(h)", "deg/h", "deg/h"],
        preset: [
            g.angle_random_walk_dpsqrth,
            g.bias_in_run_dph,
            g.bias_turn_on_dph,
        ],
        si: DEG_PER_H,
        of: shown,
        name,
    };
    let accel = Triad {
        kind: Kind::Accel,
        keys: [
            "accel.velocity_random_walk_ugpsqrthz",
            "accel.bias_in_run_ug",
            "accel.bias_turn_on_ug",
        ],
        units: ["ug/sqrt(Hz)", "ug", "ug"],
        preset: [
            a.velocity_random_walk_ugpsqrthz,
            a.bias_in_run_ug,
            a.bias_turn_on_ug,
        ],
        si: UG,
        of: shown,
        name,
    };
    let numbers = [&gyro, &accel].into_iter().flat_map(Triad::numbers);
    Sheet {
        preset: name.to_owned(),
        numbers: numbers.collect(),
    }
}

/// The axis on which a noise is seen most.
fn seen<'a>(
    shown: &'a LogResults,
    kind: Kind,
    symbol: &str,
) -> Option<(&'a Analysis, &'a Coefficient)> {
    coefficients(shown, kind, symbol)
        .filter(|(_, c)| c.is_seen())
        .max_by(|a, b| a.1.value.total_cmp(&b.1.value))
}

fn coefficients<'a>(
    shown: &'a LogResults,
    kind: Kind,
    symbol: &str,
) -> impl Iterator<Item = (&'a Analysis, &'a Coefficient)> {
    let analyses = shown.noise.analyses.iter().filter(move |a| a.kind == kind);
    analyses.filter_map(move |a| Some((a, a.coefficients.iter().find(|c| c.symbol == symbol)?)))
}

impl Triad<'_> {
    fn numbers(&self) -> [Number; 3] {
        [self.turn_on(), self.in_run(), self.white()]
    }

    fn number(&self, i: usize, value: f64, measured: Option<f64>, source: String) -> Number {
        Number {
            key: self.keys[i],
            unit: self.units[i],
            value: three(value.max(1e-6)),
            measured,
            preset: self.preset[i],
            source,
        }
    }

    /// Largest upper end over the axes of a noise.
    fn high(&self, symbol: &str) -> f64 {
        let all = coefficients(self.of, self.kind, symbol).map(|(_, c)| c.high);
        all.fold(0.0, f64::max)
    }

    fn white(&self) -> Number {
        let high = self.high("N");
        match seen(self.of, self.kind, "N") {
            Some((of, c)) => self.number(
                0,
                high,
                Some(c.value),
                format!(
                    "measured: {} on the noisiest axis in {} at rest; upper end of 95 %",
                    short(c.value),
                    lasting(of.duration_s)
                ),
            ),
            None if high > 0.0 && high < self.preset[0] => self.number(
                0,
                high,
                None,
                "measured: not seen apart from the rest, so the upper end of 95 %".into(),
            ),
            None => self.assumed(0, "not seen apart from the rest"),
        }
    }

    fn in_run(&self) -> Number {
        let floor = seen(self.of, self.kind, "B").map(|(_, c)| FLOOR * c.value);
        let walk = seen(self.of, self.kind, "K");
        if let Some((of, c)) = walk {
            let value = self.high_seen("K").max(floor.unwrap_or_default());
            let source = format!(
                "measured: walk of {} in an hour on the worst axis in {} at rest; \
                 upper end of 95 %",
                short(c.value),
                lasting(of.duration_s)
            );
            return self.number(1, value, Some(c.value), source);
        }
        let high = self.high("K");
        let preset = self.preset[1];
        let least = floor.unwrap_or_default();
        match floor {
            Some(floor) if floor > preset.min(high) => self.number(
                1,
                floor,
                Some(floor),
                "measured: least Allan deviation; a walk is not seen".into(),
            ),
            _ if high < preset => self.number(
                1,
                high.max(least),
                None,
                format!(
                    "measured: a walk is not seen, so the upper end of 95 %: {}",
                    short(high)
                ),
            ),
            _ => self.assumed(1, &format!("a walk is not seen below {}", short(high))),
        }
    }

    /// Largest upper end over the axes on which a noise is seen.
    fn high_seen(&self, symbol: &str) -> f64 {
        let all = coefficients(self.of, self.kind, symbol).filter(|(_, c)| c.is_seen());
        all.map(|(_, c)| c.high).fold(0.0, f64::max)
    }

    /// The bias: what this unit has, what is new at a power-on, and what the temperature changes.
    fn turn_on(&self) -> Number {
        let (law, scatter) = match self.kind {
            Kind::Gyro => (&self.of.gyro_law, self.of.gyro_scatter),
            Kind::Accel => (&self.of.accel_law, self.of.accel_scatter),
        };
        let logs = self.of.logs.len();
        let largest = self.of.logs.iter().filter_map(|log| self.largest(log));
        let largest = largest.reduce(f64::max);
        let half = law.as_ref().map_or(0.0, |law| {
            let [least, most] = law.range_degc;
            0.5 * (most - least) * law.per_k.amax() / self.si
        });
        let mut says = vec![];
        if let Some(largest) = largest {
            says.push(format!(
                "{} is the largest in {}",
                short(largest),
                counted(logs)
            ));
        }
        if half > 0.0 {
            says.push(format!("{} by temperature", short(half)));
        }
        let others = self.unknown(scatter, &mut says);
        if largest.is_none() && half == 0.0 {
            let why = match self.kind {
                Kind::Gyro => "the Earth's rotation hides it without a site (--latitude)",
                Kind::Accel => "gravity hides it (see six-position)",
            };
            return self.assumed(2, why);
        }
        let value = largest.unwrap_or_default().hypot(half).hypot(others);
        let source = format!("measured: root of squares: {}", says.join(", "));
        self.number(2, value, largest, source)
    }

    /// What is new at a power-on, or of the preset for what nothing shows; `says` gets its words.
    fn unknown(&self, scatter: Option<Scatter>, says: &mut Vec<String>) -> f64 {
        let preset = self.preset[2];
        let Some(scatter) = scatter else {
            says.push(format!("{} of preset {}", short(preset), self.name));
            return preset;
        };
        let new = with_preset(&scatter, preset * self.si) / self.si;
        says.push(format!("{} new at a power-on (95 %)", short(new)));
        if self.kind == Kind::Accel && preset > new {
            let name = self.name;
            says.push(format!(
                "{} across gravity, as preset {name}",
                short(preset)
            ));
            return preset;
        }
        new
    }

    /// The largest bias that a log shows.
    fn largest(&self, log: &OfLog) -> Option<f64> {
        match self.kind {
            Kind::Gyro => {
                let all = log.gyro_bias.iter().map(|b| b.abs() / self.si);
                all.reduce(f64::max)
            }
            Kind::Accel => {
                let [off, sigma] = log.above_gravity;
                (off.abs() > SEEN * sigma && off.abs() < 0.05 * G0).then_some(off.abs() / self.si)
            }
        }
    }

    fn assumed(&self, i: usize, why: &str) -> Number {
        let source = format!("assumed: as preset {}; {why}", self.name);
        self.number(i, self.preset[i], None, source)
    }
}

/// What is new at a power-on, at 95 %. A few logs cannot tell it alone: the preset counts as
/// [`LENT`] degrees of freedom more.
fn with_preset(scatter: &Scatter, preset: f64) -> f64 {
    let degrees = scatter.degrees as f64;
    let squares = degrees * scatter.sigma.powi(2) + LENT as f64 * preset.powi(2);
    (squares / (degrees + LENT as f64)).sqrt() * upper(scatter.degrees + LENT)
}

fn counted(logs: usize) -> String {
    match logs {
        1 => "one power-on".into(),
        n => format!("{n} power-ons"),
    }
}

fn lasting(seconds: f64) -> String {
    match seconds {
        s if s < 600.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// A number to three figures.
pub fn three(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A number to three figures as text.
fn short(value: f64) -> String {
    three(value).to_string()
}
