//! `host-sim learnability`.

use super::options::{UnitOption, arguments, seed, within};
use super::output::Output;
use super::progress::bar;
use super::stdout;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::ImuSpec;
use host_estimation::analysis::learnability::{Question, answer};
use host_report::replay::Head;
use host_unit::Unit;

/// Arguments of `learnability`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(flatten)]
    unit: UnitOption,
    /// Angle random walk, deg/sqrt(h), lock-in included [default: the unit's]
    #[arg(long, value_name = "DEG_PER_SQRT_H")]
    arw: Option<f64>,
    /// Velocity random walk, ug/sqrt(Hz) [default: the unit's]
    #[arg(long, value_name = "UG_PER_SQRT_HZ")]
    vrw: Option<f64>,
    /// Gyro pulse, arcsec [default: the unit's]
    #[arg(long, value_name = "ARCSEC")]
    gyro_pulse: Option<f64>,
    /// Accelerometer pulse, ug s [default: the unit's]
    #[arg(long, value_name = "UG_S")]
    accel_pulse: Option<f64>,
    /// Fixes at 1 Hz: standard deviation of the horizontal position, m (vertical: 1.5 times that)
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    gnss_m: f64,
    /// Fixes: standard deviation of the velocity, m/s
    #[arg(long, value_name = "M_PER_S", default_value_t = 0.05)]
    gnss_mps: f64,
    /// Driving after 5 min of standstill, min
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(2..=480))]
    minutes: u32,
    /// Number of simulated units that learn; 0 computes the bound alone
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(0..=1000))]
    units: u32,
    /// Seed of the road and the units
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    #[command(flatten)]
    output: Output,
}

impl Args {
    /// Computes, simulates, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        let unit = self.unit.load_or("medium")?;
        let question = Question {
            imu: self.imu(&unit)?,
            gnss: GnssSpec {
                horizontal_m: within("--gnss-m", self.gnss_m, [1e-3, 1e3])?,
                vertical_m: 1.5 * self.gnss_m,
                velocity_mps: within("--gnss-mps", self.gnss_mps, [1e-4, 1e2])?,
                ..GnssSpec::default()
            },
            minutes: self.minutes,
            units: self.units,
            seed: self.seed,
        };
        let bar = bar(
            u64::from(self.units),
            "{bar:30} {pos}/{len} units, {elapsed} elapsed, {eta} left",
        );
        bar.tick();
        let answer = answer(&question, &|| bar.inc(1));
        bar.finish_and_clear();
        let table = host_report::learnability::table(&answer, usize::MAX)?;
        let head = Head {
            title: format!(
                "What can be learnt of a {} IMU in {} min",
                unit.name, self.minutes
            ),
            command: format!("host-sim {}", arguments()),
        };
        let page = host_report::learnability::write(
            &self.output.directory("learnability"),
            &head,
            &answer,
            &table,
        )?;
        self.output.json.write(&answer.lines())?;
        let table = host_report::learnability::table(&answer, stdout::width())?;
        println!("{}\n\n{table}\n\nreport: {}", head.title, page.display());
        Ok(())
    }

    /// The unit's simulated errors, with the values given on the command line.
    fn imu(&self, unit: &Unit) -> Result<ImuSpec, Error> {
        let mut imu = unit.simulated();
        if let Some(arw) = self.arw {
            imu.gyro.angle_random_walk_dpsqrth = within("--arw", arw, [1e-6, 100.0])?;
            imu.gyro.dither.lock_in_dph = 0.0; // the given value includes it
        }
        if let Some(vrw) = self.vrw {
            imu.accel.velocity_random_walk_ugpsqrthz = within("--vrw", vrw, [1e-3, 1e5])?;
        }
        if let Some(pulse) = self.gyro_pulse {
            imu.gyro.pulse_arcsec = within("--gyro-pulse", pulse, [1e-5, 100.0])?;
        }
        if let Some(pulse) = self.accel_pulse {
            imu.accel.pulse_ugs = within("--accel-pulse", pulse, [1e-4, 1e5])?;
        }
        Ok(imu)
    }
}
