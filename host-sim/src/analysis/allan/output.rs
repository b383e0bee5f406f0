//! What an analysis leaves behind: the printed table, the JSON, and a page with the pictures.

use super::fit::POOR_FIT;
use super::{Analysis, Kind, plot};
use crate::error::Error;
use crate::output::write_atomic;
use crate::simulator::imu::ImuSpec;
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};
use maud::{DOCTYPE, PreEscaped, html};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// All that a run found; its serialised form is the `--json` format.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// File or preset.
    pub source: String,
    /// One a column.
    pub analyses: Vec<Analysis>,
    /// Q, N, B, K, R that the simulator was given, gyros and accelerometers, in the units of the coefficients; `None` for recordings.
    pub configured: Option<[[Option<f64>; 5]; 2]>,
    /// What the reader must know.
    pub notes: Vec<String>,
}

/// What a spec says of the five noises, in the units of the coefficients. Its Gauss-Markov drift of sigma and T is, well below T, a
/// random walk of `K = sigma sqrt(2 / T)`; what stripping leaves of the dither is a line ([`dither_note`]); B and R it does not have.
#[must_use]
pub fn configured(spec: &ImuSpec) -> [[Option<f64>; 5]; 2] {
    let (g, a) = (&spec.gyro, &spec.accel);
    let lsb = crate::simulator::imu::Imu::lsb(spec);
    let root_12 = 12.0_f64.sqrt(); // white rounding error of a pulse
    let drift = |sigma: f64, time_s: f64| sigma * (2.0 * 3600.0 / time_s).sqrt();
    let (drift_g, drift_a) = (
        drift(g.bias_drift_dph, g.bias_drift_time_s),
        drift(a.bias_drift_ug, a.bias_drift_time_s),
    );
    [
        [
            Some(g.pulse_arcsec / root_12),
            Some(g.total_angle_random_walk_dpsqrth()),
            None,
            Some(g.rate_random_walk_dphpsqrth.hypot(drift_g)),
            None,
        ],
        [
            Some(lsb.mps / root_12),
            Some(a.velocity_random_walk_ugpsqrthz),
            None,
            Some(a.acceleration_random_walk_ugpsqrth.hypot(drift_a)),
            None,
        ],
    ]
}

/// What the five noises of a simulated gyro do not say.
#[must_use]
pub fn dither_note(spec: &ImuSpec) -> Option<String> {
    let dither = &spec.gyro.dither;
    (dither.strip_residual_arcsec > 0.0).then(|| {
        format!(
            "the gyros' angle also holds what stripping leaves of their dither, {} arcsec at about {} Hz: a line, which is found as a part \
             of Q, N or the misfit",
            dither.strip_residual_arcsec, dither.frequency_hz
        )
    })
}

impl Findings {
    /// Adds a note for every column whose curve is not the five noises.
    pub fn note_misfits(&mut self) {
        let poor = self
            .analyses
            .iter()
            .filter(|analysis| analysis.misfit > POOR_FIT);
        self.notes.extend(poor.map(|analysis| {
            format!(
                "{}: the curve departs by {:.0} % from the sum of the five noises: sway, vibration, temperature, or pulses so coarse \
                 that their rounding is no noise; the intervals of its coefficients allow for that",
                analysis.column,
                100.0 * analysis.misfit
            )
        }));
    }

    fn configured_of(&self, kind: Kind, coefficient: usize) -> Option<f64> {
        self.configured
            .and_then(|both| both[usize::from(kind == Kind::Accel)][coefficient])
    }

    /// Rows of the table: column, noise, value, 95 % interval, unit, configured value.
    fn rows(&self) -> Vec<[String; 6]> {
        let mut rows = vec![];
        for analysis in &self.analyses {
            for (i, c) in analysis.coefficients.iter().enumerate() {
                let (value, interval) = if c.is_seen() {
                    (
                        figures(c.value),
                        format!("{} to {}", figures(c.low), figures(c.high)),
                    )
                } else {
                    ("not seen".to_owned(), format!("below {}", figures(c.high)))
                };
                rows.push([
                    if i == 0 {
                        analysis.column.clone()
                    } else {
                        String::new()
                    },
                    format!("{} {}", c.symbol, c.name),
                    value,
                    interval,
                    c.unit.to_owned(),
                    self.configured_of(analysis.kind, i)
                        .map_or_else(|| "-".to_owned(), figures),
                ]);
            }
        }
        rows
    }

    fn header(&self) -> Vec<&'static str> {
        let mut header = vec!["column", "noise", "value", "95 % interval", "unit"];
        if self.configured.is_some() {
            header.push("configured");
        }
        header
    }

    /// The table as text, without a final line break.
    #[must_use]
    pub fn table(&self) -> String {
        let header = self.header();
        let mut table = Table::new();
        table
            .load_preset(presets::UTF8_FULL_CONDENSED)
            .set_content_arrangement(ContentArrangement::Disabled)
            .set_header(header.clone());
        for row in self.rows() {
            table.add_row(row.into_iter().take(header.len()).enumerate().map(
                |(i, text)| match i {
                    2 | 5 => Cell::new(text).set_alignment(CellAlignment::Right),
                    _ => Cell::new(text),
                },
            ));
        }
        let mut text = table.to_string();
        for analysis in &self.analyses {
            if let Some(least) = analysis
                .curve
                .iter()
                .min_by(|a, b| a.deviation.total_cmp(&b.deviation))
            {
                text += &format!(
                    "\n{}: {:.0} s at {} Hz; least deviation {} {} at {} s; misfit {:.0} %",
                    analysis.column,
                    analysis.duration_s,
                    analysis.rate_hz,
                    figures(least.deviation),
                    analysis.unit,
                    figures(least.tau_s),
                    100.0 * analysis.misfit
                );
            }
        }
        text
    }

    /// JSON text with a final line break.
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

    /// Writes `index.html` and a PNG and an SVG of each kind of sensor into `dir`; returns the path of the page.
    ///
    /// # Errors
    /// [`Error::Drawing`], [`Error::Unwritable`].
    pub fn write(&self, dir: &Path) -> Result<PathBuf, Error> {
        let mut pictures = vec![];
        for (kind, file) in [
            (Kind::Gyro, "allan-gyro.png"),
            (Kind::Accel, "allan-accel.png"),
        ] {
            let analyses: Vec<&Analysis> = self
                .analyses
                .iter()
                .filter(|analysis| analysis.kind == kind)
                .collect();
            if !analyses.is_empty() {
                pictures.push((
                    file,
                    plot::svg(&analyses, file)?,
                    plot::png(&analyses, file)?,
                ));
            }
        }
        for (file, svg, png) in &pictures {
            write_atomic(&dir.join(file), png)?;
            write_atomic(&dir.join(file).with_extension("svg"), svg.as_bytes())?;
        }
        let page = dir.join("index.html");
        write_atomic(&page, self.page(&pictures).as_bytes())?;
        Ok(page)
    }

    fn page(&self, pictures: &[(&str, String, Vec<u8>)]) -> String {
        let header = self.header();
        let markup = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { "Allan deviation of " (self.source) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { "Allan deviation of " (self.source) }
                    @if !self.notes.is_empty() { ul { @for note in &self.notes { li { (note) } } } }
                    @for (file, svg, _) in pictures {
                        figure {
                            (PreEscaped(svg))
                            figcaption {
                                "Points: overlapping Allan deviation with 95 % intervals. Lines: the sum of the fitted noises. "
                                a href=(file) { (file) }
                            }
                        }
                    }
                    table {
                        thead { tr { @for name in &header { th { (name) } } } }
                        tbody { @for row in self.rows() { tr { @for text in row.iter().take(header.len()) { td { (text) } } } } }
                    }
                    p { "Coefficients as in IEEE 647 and 952: variance = 3 Q" sup { "2" } "/\u{3c4}" sup { "2" } " + N" sup { "2" } "/\u{3c4} + B"
                        sup { "2" } " 2 ln 2/\u{3c0} + K" sup { "2" } " \u{3c4}/3 + R" sup { "2" } " \u{3c4}" sup { "2" } "/2." }
                }
            }
        };
        markup.into_string()
    }
}

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#1c2430;background:#fff}\
figure{margin:1rem 0}svg{width:100%;height:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
td,th{padding:.15rem .8rem;text-align:left;border-bottom:1px solid #d8dce2}";

/// A number to four figures.
fn figures(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-3..1e5).contains(&size) {
        return format!("{value:.3e}");
    }
    let digits = if size == 0.0 {
        0
    } else {
        (3 - size.log10().floor() as i32).max(0) as usize
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::super::{analyse, at_rest};
    use super::*;

    #[test]
    fn numbers_have_four_figures() {
        let texts = [0.0, 0.00512345, 1.0, 98765.4, 123.456, 4.2e-9, 7.0e7].map(figures);
        assert_eq!(
            texts,
            [
                "0", "0.005123", "1.000", "98765", "123.5", "4.200e-9", "7.000e7"
            ]
        );
    }

    fn findings() -> Findings {
        let spec = ImuSpec::preset("tactical").unwrap();
        let series = at_rest(&spec, 60, 1);
        Findings {
            source: "a < b".into(),
            analyses: series.iter().filter_map(analyse).collect(),
            configured: Some(configured(&spec)),
            notes: vec!["note".into()],
        }
    }

    #[test]
    fn the_table_has_a_line_a_noise_and_fits() {
        let mut findings = findings();
        let text = findings.table();
        println!("{text}");
        assert_eq!(text.matches("N random walk").count(), 6);
        assert!(text.contains("configured") && text.contains("0.1250"));
        assert!(text.lines().all(|line| line.chars().count() <= 110));
        findings.configured = None;
        assert!(!findings.table().contains("configured"));
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

    #[test]
    fn the_page_stands_alone_with_its_pictures() {
        let dir = tempfile::tempdir().unwrap();
        let mut findings = findings();
        let page = findings.write(&dir.path().join("new")).unwrap();
        let text = std::fs::read_to_string(&page).unwrap();
        assert!(text.contains("a &lt; b") && text.matches("<svg").count() == 2);
        for name in ["allan-gyro", "allan-accel"] {
            let png = std::fs::read(page.with_file_name(format!("{name}.png"))).unwrap();
            let info = png::Decoder::new(std::io::Cursor::new(png))
                .read_info()
                .unwrap();
            assert_eq!((info.info().width, info.info().height), (1920, 1120));
            let svg = std::fs::read_to_string(page.with_file_name(format!("{name}.svg"))).unwrap();
            assert!(svg.contains("Allan deviation") && svg.matches("<circle").count() > 60);
        }
        findings.analyses.truncate(1);
        findings.write(&dir.path().join("gyro")).unwrap();
        assert!(!dir.path().join("gyro/allan-accel.png").exists());
    }
}
