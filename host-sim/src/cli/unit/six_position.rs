//! `host-sim unit six-position`.

use super::logs::Logs;
use super::outputs::{Calibration, Outputs};
use crate::cli::options::{refused, within};
use crate::cli::output::JsonOption;
use crate::cli::{progress, stdout};
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::units::{DEG, UG};
use host_estimation::analysis::positions::{
    Fit, Position, Turn, fit, gyro_bias, gyro_scale, numbers, positions, scales, turns,
};
use host_estimation::analysis::standing::Log;
use host_io::recordings::calibration::Triad;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// What the bias of a consumer sensor does between the rests, m/s2 (assumed): 100 ug.
const BETWEEN: f64 = 100.0 * UG;

/// Arguments of `unit six-position`.
#[derive(Debug, ClapArgs)]
pub(super) struct Args {
    #[command(flatten)]
    logs: Logs,
    /// Shortest rest that counts, s
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0)]
    least_rest_s: f64,
    /// How well an axis of the sensor was vertical in each rest, deg: then the axes' common
    /// rotation is found, too. Leave it out for rests on edges [default: not known]
    #[arg(long, value_name = "DEGREES")]
    placement_deg: Option<f64>,
    /// The sensor was also turned, upright on a side, by this angle or a multiple of it between two
    /// rests, deg, such as 360: gives the scale factors of the gyros [default: no such turns]
    #[arg(long, value_name = "DEGREES")]
    turn_deg: Option<f64>,
    /// Standard deviation of such an angle, deg
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.5,
        requires = "turn_deg"
    )]
    turn_sigma_deg: f64,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    json: JsonOption,
}

/// The results for `--json`.
#[derive(Serialize)]
struct JsonOutput<'a> {
    rests: Vec<&'a str>,
    #[serde(flatten)]
    fit: &'a Fit,
    /// Covariance of the map, row by row, the bias and gravity.
    covariance: Vec<Vec<f64>>,
    gyro_bias_radps: [f64; 3],
    gyro_bias_sigma_radps: [f64; 3],
    turns: &'a [Turn],
}

impl Args {
    pub(super) fn run(&self) -> Result<(), Error> {
        self.outputs.check()?;
        let least_s = within("--least-rest-s", self.least_rest_s, [2.0, 3600.0])?;
        let placement = self
            .placement_deg
            .map(|deg| within("--placement-deg", deg, [1e-3, 10.0]));
        let placement = placement.transpose()?.map(|deg| deg * DEG);
        let unit = self.outputs.unit()?;
        let progress = progress::plan(&[(progress::READING, 1.0)]);
        let logs = self.logs.read()?;
        let rests = positions(&logs, least_s)?;
        let gravity = logs.iter().find(|log| log.site.is_some()).or(logs.first());
        let gravity = gravity.map_or([9.8, 0.1], |log| log.gravity());
        let between = unit
            .as_ref()
            .map(|(_, unit)| unit.accel.bias_in_run_ug * UG);
        let found = fit(&rests, gravity, between.unwrap_or(BETWEEN), placement)?;
        let gyro = gyro_bias(&rests);
        let turned = self.turned(&logs, least_s)?;
        self.leave(&rests, &found, gyro, &turned)?;
        drop(progress);
        let width = stdout::width();
        let scales = scales(&turned);
        print!(
            "{}",
            host_report::positions::text(&rests, &found, &gyro, &scales, width)
        );
        for log in &logs {
            log.notes
                .iter()
                .for_each(|note| println!("- {}: {note}", log.name));
        }
        let map = Matrix3::from_fn(|i, j| found.map[i][j]);
        let numbers = unit.map(|(name, unit)| {
            let gyro = gyro_scale(&scales, &unit, name);
            numbers(&found, &unit, name)
                .into_iter()
                .chain(gyro)
                .collect()
        });
        self.outputs.write(&Calibration {
            accel: Some(Triad {
                matrix: Matrix3::identity() - map,
                bias: Vector3::from(found.bias),
            }),
            gyro: gyros(&scales),
            numbers: numbers.unwrap_or_default(),
            about: about(&found, rests.len()),
        })
    }
}

impl Args {
    /// Writes the JSON, if it was asked for.
    fn leave(
        &self,
        rests: &[Position],
        fit: &Fit,
        gyro: [[f64; 3]; 2],
        turns: &[Turn],
    ) -> Result<(), Error> {
        let rows = fit.covariance.row_iter();
        self.json.write(&JsonOutput {
            rests: rests.iter().map(|rest| rest.name.as_str()).collect(),
            fit,
            covariance: rows.map(|row| row.iter().copied().collect()).collect(),
            gyro_bias_radps: gyro[0],
            gyro_bias_sigma_radps: gyro[1],
            turns,
        })
    }

    /// The turns of the gyros, if some were made.
    fn turned(&self, logs: &[Log], least_s: f64) -> Result<Vec<Turn>, Error> {
        let Some(degrees) = self.turn_deg else {
            return Ok(vec![]);
        };
        let angle = within("--turn-deg", degrees, [30.0, 3600.0])? * DEG;
        let sigma = within("--turn-sigma-deg", self.turn_sigma_deg, [1e-4, 10.0])? * DEG;
        let found = turns(logs, least_s, angle, sigma);
        if found.is_empty() {
            let problem = format!(
                "is {degrees}, and no turn by a multiple of it about a vertical axis lies between \
                 two rests of {least_s} s in the same attitude"
            );
            let remedy = "rest before and after the turn, or give the angle that was turned by";
            return Err(refused("--turn-deg", problem, remedy));
        }
        Ok(found)
    }
}

/// The calibration of the gyros by their scale factors. Their biases are new at each power-on.
fn gyros(scales: &[Option<[f64; 2]>; 3]) -> Option<Triad> {
    scales.iter().any(Option::is_some).then(|| {
        let factor = scales.map(|of| 1.0 / (1.0 + of.map_or(0.0, |[scale, _]| scale)));
        Triad {
            matrix: Matrix3::from_diagonal(&factor.into()),
            ..Triad::none()
        }
    })
}

/// Comments for the unit file: the calibration itself, which it has no field for.
fn about(fit: &Fit, rests: usize) -> Vec<String> {
    let three = |of: [f64; 3]| of.map(|x| format!("{x:.6}")).join(" ");
    let mut lines = vec![format!(
        "Accelerometers by `host-sim unit six-position` from {rests} rests: f = (1 - M) (z - B)"
    )];
    lines.push(format!(
        "B, m/s2: {} +- {}",
        three(fit.bias),
        three(fit.bias_sigma)
    ));
    let rows = fit.map.iter().zip(&fit.map_sigma).zip(["x", "y", "z"]);
    lines.extend(rows.map(|((m, s), axis)| format!("M {axis}: {} +- {}", three(*m), three(*s))));
    lines
}
