//! Errors of the accelerometers from rests in several attitudes, for readers of
//! `unit six-position`.

use super::allan::figures;
use super::terminal::fitted;
use super::text::counted;
use comfy_table::{Cell, CellAlignment, Table, presets};
use host_core::inertial::units::{DEG_PER_H, PPM, UG};
use host_estimation::analysis::positions::{Fit, PAIRS, Position, sides};

const AXES: [&str; 3] = ["x", "y", "z"];
const MRAD: f64 = 1e-3;
/// A side counts as visited by a rest within this angle, deg.
const NEAR_DEG: f64 = 45.0;

/// The report as text: the fitted errors, then a line for each rest.
#[must_use]
pub fn text(
    positions: &[Position],
    fit: &Fit,
    gyro: &[[f64; 3]; 2],
    scales: &[Option<[f64; 2]>; 3],
    width: usize,
) -> String {
    let mut text = format!("{}\n\n", fitted(table(fit, gyro, scales), width, [3]));
    for line in lines(positions, fit) {
        text += &format!("{line}\n");
    }
    text
}

fn table(fit: &Fit, gyro: &[[f64; 3]; 2], scales: &[Option<[f64; 2]>; 3]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    table.set_header(["error", "value", "\u{b1} sigma", "unit"]);
    let mut add = |name: String, shown: bool, [value, sigma]: [f64; 2], si: f64, unit: &str| {
        let right = |text: String| Cell::new(text).set_alignment(CellAlignment::Right);
        table.add_row([
            Cell::new(name),
            right(match shown {
                true => figures(value / si),
                false => "not shown".into(),
            }),
            right(figures(sigma / si)),
            Cell::new(unit),
        ]);
    };
    for (i, axis) in AXES.iter().enumerate() {
        let of = [fit.bias[i], fit.bias_sigma[i]];
        add(
            format!("accelerometer bias {axis}"),
            fit.shows_bias(i),
            of,
            UG,
            "ug",
        );
    }
    for (i, axis) in AXES.iter().enumerate() {
        let of = [fit.map[i][i], fit.map_sigma[i][i]];
        add(
            format!("scale factor {axis}"),
            fit.shows_scale(i),
            of,
            PPM,
            "ppm",
        );
    }
    for pair in PAIRS {
        let name = format!("between axes {} and {}", AXES[pair[0]], AXES[pair[1]]);
        add(name, fit.shows_skew(pair), fit.skew(pair), MRAD, "mrad");
    }
    for (i, axis) in AXES.iter().enumerate() {
        let of = [gyro[0][i], gyro[1][i]];
        add(format!("gyro bias {axis}"), true, of, DEG_PER_H, "deg/h");
    }
    for (of, axis) in scales.iter().zip(AXES) {
        if let Some(of) = of {
            add(format!("gyro scale factor {axis}"), true, *of, PPM, "ppm");
        }
    }
    table
}

fn lines(positions: &[Position], fit: &Fit) -> Vec<String> {
    let [before, after] = fit.left.map(|f| f / UG);
    let mut lines = vec![format!(
        "{}. The force differs from gravity by {before:.0} ug before, {after:.0} ug after \
         (rms).",
        counted(positions.len(), "rest")
    )];
    let names = ["+x", "-x", "+y", "-y", "+z", "-z"];
    let far: Vec<&str> = sides(positions)
        .iter()
        .zip(names)
        .filter(|(angle, _)| **angle > NEAR_DEG)
        .map(|(_, name)| name)
        .collect();
    if !far.is_empty() {
        lines.push(format!(
            "No rest has the specific force within {NEAR_DEG} degrees of {}: add rests there.",
            far.join(", ")
        ));
    }
    if !PAIRS.iter().all(|pair| fit.shows_skew(*pair)) {
        lines.push(
            "The angles between axes that are not shown need rests on edges and corners: three or \
             more beside the six sides."
                .into(),
        );
    }
    if fit.degrees < 1.0 {
        lines.push(
            "There are no more rests than unknowns, so nothing checks the standard deviations: add \
             rests."
                .into(),
        );
    } else if fit.enlarged > 2.0 {
        lines.push(format!(
            "The rests contradict each other by {:.1} times the expected noise: the standard \
             deviations are enlarged so much. Likely causes: the sensor was touched, warmed up, or \
             its range was exceeded.",
            fit.enlarged
        ));
    }
    lines.push(
        "The gyro bias holds what the Earth's rotation does not average out. What is common to the \
         three axes, a rotation against the case, gravity does not show."
            .into(),
    );
    lines
}
