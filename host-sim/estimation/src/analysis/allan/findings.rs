//! The results of an Allan analysis with notes for the reader, and their JSON.

use super::fit::{POOR_FIT, analyse};
use super::gravity::{self, Mean};
use super::{Analysis, Column, Series};
use host_core::error::Error;
use host_core::simulator::imu::ImuSpec;
use host_core::words::counted;
use rayon::prelude::*;
use serde::Serialize;

/// Largest number of samples of the columns that are analysed at the same time. Each sample takes
/// 24 bytes: its increment, its integral, and a copy of either.
const SAMPLES_AT_ONCE: usize = 1 << 24;

/// The results of a run. Serialised, they are the `--json` format.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// File or preset.
    pub source: String,
    /// One for each column.
    pub analyses: Vec<Analysis>,
    /// Q, N, B, K, R of the simulated gyros and accelerometers, in the units of the coefficients.
    /// `None` for recordings.
    pub configured: Option<[[Option<f64>; 5]; 2]>,
    /// Notes for the reader.
    pub notes: Vec<String>,
}

/// The five noises of a specification, in the units of the coefficients. Its Gauss-Markov drift of
/// sigma and T is, well below T, a random walk of `K = sigma sqrt(2 / T)`. It has no R.
/// The residual of dither after stripping is a spectral line, and none of the five noises. The fit
/// cannot distinguish it from Q, so with it the Q of the gyros is `None`; see [`dither_note`].
pub(super) fn configured(spec: &ImuSpec) -> [[Option<f64>; 5]; 2] {
    let (g, a) = (&spec.gyro, &spec.accel);
    let lsb = host_core::simulator::imu::Imu::lsb(spec);
    let root_12 = 12.0_f64.sqrt(); // the rounding error of a pulse is uniform and white
    let drift = |sigma: f64, time_s: f64| sigma * (2.0 * 3600.0 / time_s).sqrt();
    let (drift_g, drift_a) = (
        drift(g.bias_drift_dph, g.bias_drift_time_s),
        drift(a.bias_drift_ug, a.bias_drift_time_s),
    );
    let present = |b: f64| (b > 0.0).then_some(b);
    [
        [
            (g.dither.strip_residual_arcsec == 0.0).then_some(g.pulse_arcsec / root_12),
            Some(g.total_angle_random_walk_dpsqrth()),
            present(g.bias_instability_dph),
            Some(g.rate_random_walk_dphpsqrth.hypot(drift_g)),
            None,
        ],
        [
            Some(lsb.mps / root_12),
            Some(a.velocity_random_walk_ugpsqrthz),
            present(a.bias_instability_ug),
            Some(a.acceleration_random_walk_ugpsqrth.hypot(drift_a)),
            None,
        ],
    ]
}

/// A note about the dither of a simulated gyro, which is not one of the five noises.
fn dither_note(spec: &ImuSpec) -> Option<String> {
    let dither = &spec.gyro.dither;
    (dither.strip_residual_arcsec > 0.0).then(|| {
        format!(
            "the angle of the gyros also contains the dither that stripping leaves, \
             {} arcsec at about {} Hz. It is a spectral line and appears as a part of Q or the \
             misfit. So the configured Q of the gyros is left empty; the pulse alone has {:.3e} \
             arcsec",
            dither.strip_residual_arcsec,
            dither.frequency_hz,
            spec.gyro.pulse_arcsec / 12.0_f64.sqrt()
        )
    })
}

/// A note about pulses so coarse that their rounding is noise at long times only.
fn rounding_note(analyses: &[Analysis]) -> Option<String> {
    let coarse = |a: &&Analysis| a.fitted_from_s * a.rate_hz > 1.5;
    let named = |a: &Analysis| format!("{} ({:.3} s)", a.column, a.fitted_from_s);
    let columns: Vec<String> = analyses.iter().filter(coarse).map(named).collect();
    (!columns.is_empty()).then(|| {
        format!(
            "Noise moves these outputs by less than a pulse within the time in brackets: {}. At \
             shorter times the rounding to pulses is regular and no noise, so the coefficients are \
             fitted from that time on",
            columns.join(", ")
        )
    })
}

/// A note about curves that are not a sum of the five noises.
fn misfit_note(analyses: &[Analysis]) -> Option<String> {
    let poor = |a: &&Analysis| a.misfit > POOR_FIT;
    let named = |a: &Analysis| format!("{} ({:.0} %)", a.column, 100.0 * a.misfit);
    let columns: Vec<String> = analyses.iter().filter(poor).map(named).collect();
    (!columns.is_empty()).then(|| {
        format!(
            "These curves depart from the sum of the five noises by the share in brackets: {}. \
             Possible causes are sway, vibration, temperature, or pulses so coarse that their \
             rounding is not noise. The intervals of the coefficients allow for it",
            columns.join(", ")
        )
    })
}

/// A note about samples far from their neighbours: those left out, or those that stay.
fn outliers_note(analyses: &[Analysis], left_out: bool) -> Option<String> {
    let named = |a: &Analysis| {
        let outliers = a.outliers.filter(|it| it.left_out == left_out)?;
        let samples = counted(outliers.count, "sample");
        let (first, farthest) = (outliers.first_s, outliers.farthest);
        Some(format!(
            "{} ({samples}, the first at {first:.3} s, the farthest by {farthest:.0})",
            a.column
        ))
    };
    let columns: Vec<String> = analyses.iter().filter_map(named).collect();
    let end = if left_out {
        "They are left out: bit errors and knocks are no noise"
    } else {
        "So many are not left out, and the coefficients contain them: the recording was disturbed, \
         or not at rest. Cut it to the part at rest"
    };
    (!columns.is_empty()).then(|| {
        format!(
            "Samples are more than ten standard deviations of the noise from their neighbours in \
             {}. {end}",
            columns.join(", ")
        )
    })
}

/// The mean output of a sensor.
fn mean(series: &Series) -> Mean {
    let sum: f64 = series.increments.iter().sum();
    Mean {
        kind: series.kind,
        value: sum / series.increments.len().max(1) as f64 * series.rate_hz,
        rate_hz: series.rate_hz,
    }
}

impl Findings {
    /// Analyses `columns` from `source`, simulated with `spec` if there is one.
    ///
    /// # Errors
    /// No column changes enough to have an Allan deviation, or one cannot be read again; the
    /// sensors of a recording show that its columns are in other units.
    pub fn of(source: String, columns: Vec<Column>, spec: Option<&ImuSpec>) -> Result<Self, Error> {
        let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
        let samples = columns.iter().map(Column::len).max().unwrap_or(0);
        let at_once = (SAMPLES_AT_ONCE / samples.max(1)).max(1);
        let mut found: Vec<(Mean, Option<Analysis>)> = Vec::new();
        let mut waiting = columns.into_iter();
        while found.len() < names.len() {
            let group: Vec<Column> = waiting.by_ref().take(at_once).collect();
            let all = group.into_par_iter().map(|column| {
                let series = column.series()?;
                Ok((mean(&series), analyse(series)))
            });
            found.extend(all.collect::<Result<Vec<_>, Error>>()?);
        }
        let (means, analyses): (Vec<Mean>, Vec<Option<Analysis>>) = found.into_iter().unzip();
        let doubts = match spec {
            None => [
                gravity::check(&source, &means)?,
                gravity::check_rate(&source, &means)?,
            ],
            Some(_) => [None, None],
        };
        if analyses.iter().all(Option::is_none) {
            return Err(Error::Option {
                option: source,
                problem: "no column changes enough to have an Allan deviation".into(),
                remedy: "check that the recording holds sensor output and not a constant".into(),
            });
        }
        let pairs = names.iter().zip(&analyses);
        let constant = pairs.filter(|(_, analysis)| analysis.is_none());
        let constant =
            constant.map(|(column, _)| format!("{column} hardly ever changes and is left out"));
        let mut notes: Vec<String> = doubts.into_iter().flatten().chain(constant).collect();
        notes.extend(spec.and_then(dither_note));
        let analyses: Vec<Analysis> = analyses.into_iter().flatten().collect();
        notes.extend(rounding_note(&analyses));
        notes.extend(outliers_note(&analyses, true));
        notes.extend(outliers_note(&analyses, false));
        notes.extend(misfit_note(&analyses));
        Ok(Self {
            source,
            analyses,
            configured: spec.map(configured),
            notes,
        })
    }

    /// The same findings, with the noises of a datasheet for comparison.
    #[must_use]
    pub fn beside(self, spec: &ImuSpec) -> Self {
        Self {
            configured: Some(configured(spec)),
            ..self
        }
    }

    /// JSON text that ends with a line break.
    ///
    /// # Errors
    /// [`Error::BadResult`] for a number that JSON cannot hold.
    pub fn json(&self) -> Result<String, Error> {
        let bad = |item: &str, problem: String| Error::BadResult {
            item: item.to_owned(),
            field: "coefficients",
            problem,
        };
        for analysis in &self.analyses {
            if analysis
                .coefficients
                .iter()
                .any(|c| !(c.value.is_finite() && c.high.is_finite()))
            {
                return Err(bad(&analysis.column, "are not finite".to_owned()));
            }
        }
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|error| bad(&self.source, error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::at_rest;
    use super::*;

    /// Findings of a minute of a simulated IMU.
    fn findings() -> Findings {
        let spec = ImuSpec::preset("tactical").unwrap();
        let columns = at_rest(&spec, 60, 1).unwrap().into_iter();
        Findings {
            source: "a < b".into(),
            analyses: columns
                .filter_map(|c| analyse(c.series().unwrap()))
                .collect(),
            configured: Some(configured(&spec)),
            notes: vec!["note".into()],
        }
    }

    #[test]
    fn columns_of_the_same_finding_share_a_note() {
        let mut analyses = findings().analyses;
        analyses.truncate(3);
        for (analysis, misfit) in analyses.iter_mut().zip([0.4, 0.0, 0.25]) {
            analysis.misfit = misfit;
            analysis.fitted_from_s = (1.0 + 100.0 * misfit) / analysis.rate_hz;
        }
        let note = misfit_note(&analyses).expect("two are poor");
        assert!(
            note.contains("dtheta_x_rad (40 %), dtheta_z_rad (25 %)."),
            "{note}"
        );
        let note = rounding_note(&analyses).expect("two are coarse");
        assert!(
            note.contains("dtheta_x_rad (0.") && !note.contains("dtheta_y_rad"),
            "{note}"
        );
        assert_eq!(misfit_note(&analyses[1..2]), None);
        assert_eq!(rounding_note(&analyses[1..2]), None);
    }

    #[test]
    fn the_json_holds_curves_and_coefficients() {
        let findings = findings();
        let json: serde_json::Value = serde_json::from_str(&findings.json().unwrap()).unwrap();
        let first = &json["analyses"][0];
        assert_eq!(first["column"], "dtheta_x_rad");
        assert_eq!(first["kind"], "gyro");
        let n = &first["coefficients"][1];
        assert_eq!(
            (&n["symbol"], &n["unit"]),
            (&"N".into(), &"deg/sqrt(h)".into())
        );
        assert_eq!(
            n["value"].as_f64(),
            Some(findings.analyses[0].coefficients[1].value)
        );
        assert!(first["curve"].as_array().unwrap().len() > 20);
        let mut bad = findings;
        bad.analyses[0].coefficients[2].high = f64::NAN;
        assert!(
            bad.json()
                .unwrap_err()
                .to_string()
                .contains("'dtheta_x_rad'")
        );
    }
}
