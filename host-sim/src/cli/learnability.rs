//! `host-sim learnability`.

use crate::analysis::learnability::{Question, answer};
use crate::error::Error;
use crate::output::write_atomic;
use crate::report::bounds;
use crate::report::outcomes::Head;
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::{ImuSpec, PRESETS};
use clap::Args as ClapArgs;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Arguments of `learnability`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// IMU: medium, nav, tactical
    #[arg(long, default_value = "medium", value_name = "NAME")]
    preset: String,
    /// Angle random walk, deg/sqrt(h), lock-in included [default: the preset's]
    #[arg(long, value_name = "DEG_PER_SQRT_H")]
    arw: Option<f64>,
    /// Velocity random walk, ug/sqrt(Hz) [default: the preset's]
    #[arg(long, value_name = "UG_PER_SQRT_HZ")]
    vrw: Option<f64>,
    /// Gyro pulse, arcsec [default: the preset's]
    #[arg(long, value_name = "ARCSEC")]
    gyro_pulse: Option<f64>,
    /// Accelerometer pulse, ug s [default: the preset's]
    #[arg(long, value_name = "UG_S")]
    accel_pulse: Option<f64>,
    /// Fixes at 1 Hz: horizontal standard deviation, m (vertical: half as much again)
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    gnss_m: f64,
    /// Fixes: standard deviation of the velocity, m/s
    #[arg(long, value_name = "M_PER_S", default_value_t = 0.05)]
    gnss_mps: f64,
    /// Driving after 5 min of standstill, min
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(2..=480))]
    minutes: u32,
    /// Simulated units that learn; 0: the bound alone
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(0..=1000))]
    units: u32,
    /// Seed of road and units
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write all numbers as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Directory for a page and the picture
    #[arg(long, value_name = "DIR", default_value = "out/learnability")]
    out: PathBuf,
}

impl Args {
    /// Computes, simulates, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let question = Question {
            imu: self.imu()?,
            gnss: GnssSpec {
                horizontal_m: checked("--gnss-m", self.gnss_m, [1e-3, 1e3])?,
                vertical_m: 1.5 * self.gnss_m,
                velocity_mps: checked("--gnss-mps", self.gnss_mps, [1e-4, 1e2])?,
            },
            minutes: self.minutes,
            units: self.units,
            seed: self.seed,
        };
        let bar = ProgressBar::new(u64::from(self.units));
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} units, {elapsed} gone, {eta} to go")
        {
            bar.set_style(style);
        }
        bar.tick();
        let answer = answer(&question, &|| bar.inc(1));
        bar.finish_and_clear();
        let table = bounds::table(&answer)?;
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let head = Head {
            title: format!(
                "What can be learnt of a {} IMU in {} min",
                self.preset, self.minutes
            ),
            command: format!("host-sim {}", arguments.join(" ")),
        };
        let page = bounds::write(&self.out, &head, &answer, &table)?;
        if let Some(file) = &self.json {
            let text = serde_json::to_vec_pretty(&answer.lines())
                .map_err(|e| Error::writing(file, e.into()))?;
            write_atomic(file, &text)?;
        }
        println!("{}\n\n{table}\n\nreport: {}", head.title, page.display());
        Ok(())
    }

    /// The preset with what was given instead.
    fn imu(&self) -> Result<ImuSpec, Error> {
        let names = PRESETS.map(|(name, _)| name);
        let mut imu = ImuSpec::preset(&self.preset)
            .ok_or_else(|| Error::unknown("preset", &self.preset, &names))?;
        if let Some(arw) = self.arw {
            imu.gyro.angle_random_walk_dpsqrth = checked("--arw", arw, [1e-6, 100.0])?;
            imu.gyro.dither.lock_in_dph = 0.0; // what is given is the whole
        }
        if let Some(vrw) = self.vrw {
            imu.accel.velocity_random_walk_ugpsqrthz = checked("--vrw", vrw, [1e-3, 1e5])?;
        }
        if let Some(pulse) = self.gyro_pulse {
            imu.gyro.pulse_arcsec = checked("--gyro-pulse", pulse, [1e-5, 100.0])?;
        }
        if let Some(pulse) = self.accel_pulse {
            imu.accel.pulse_ugs = checked("--accel-pulse", pulse, [1e-4, 1e5])?;
        }
        Ok(imu)
    }
}

fn checked(name: &str, value: f64, [low, high]: [f64; 2]) -> Result<f64, Error> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Error::Option {
        option: name.into(),
        problem: format!("is {value}"),
        remedy: format!("give a number from {low} to {high}"),
    })
}
