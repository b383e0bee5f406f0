//! Files with a calibration: of other tools, of the device, and the unit file.

use super::{base, doubts, free};
use crate::cli::options::refused;
use crate::cli::output::output_file;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::units::{DEG_PER_H, DEG_PER_SQRT_H, UG, UG_PER_SQRT_HZ};
use host_device::device::{calibrated, clipped, images};
use host_estimation::analysis::standing::Number;
use host_io::output::write_atomic;
use host_io::recordings::calibration::{Triad, kalibr, sm, tk};
use host_unit::{Unit, examine};
use nalgebra::{Matrix3, Vector3};
use std::path::{Path, PathBuf};

/// Seconds of the root of an hour, over which the unit file states a walk.
const ROOT_OF_HOUR: f64 = 60.0;

/// Where to write.
#[derive(Debug, ClapArgs)]
pub(super) struct Outputs {
    /// Unit file or preset: what it has and the recording has not
    #[arg(long, value_name = "NAME|FILE.toml")]
    unit: Option<String>,
    /// Write the unit file with what is known now
    #[arg(long, value_name = "FILE.toml", requires = "unit", value_parser = output_file())]
    output: Option<PathBuf>,
    /// Write the accelerometers' calibration for imu_tk
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    imu_tk: Option<PathBuf>,
    /// Write it for imu_calib
    #[arg(long, value_name = "FILE.yaml", value_parser = output_file())]
    imu_calib: Option<PathBuf>,
    /// Write noise and matrices as IMU YAML of Kalibr; needs --unit for the noise
    #[arg(long, value_name = "FILE.yaml", requires = "unit", value_parser = output_file())]
    kalibr: Option<PathBuf>,
    /// Write it as weights for `device weights put`
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    weights: Option<PathBuf>,
    /// Replace files that are there
    #[arg(long)]
    force: bool,
}

/// A calibration that was found or read.
pub(super) struct Calibration {
    pub(super) accel: Option<Triad>,
    pub(super) gyro: Option<Triad>,
    pub(super) numbers: Vec<Number>,
    /// Comments for the unit file.
    pub(super) about: Vec<String>,
}

impl Outputs {
    /// The unit that was given, and its name.
    pub(super) fn unit(&self) -> Result<Option<(&str, Unit)>, Error> {
        let name = self.unit.as_deref();
        name.map(|name| Ok((name, Unit::load(name)?))).transpose()
    }

    /// Refuses files that are there.
    pub(super) fn check(&self) -> Result<(), Error> {
        let all = [
            &self.output,
            &self.imu_tk,
            &self.imu_calib,
            &self.kalibr,
            &self.weights,
        ];
        let mut given = all.into_iter().flatten();
        given.try_for_each(|file| free(file, self.force))
    }

    /// Writes all files that were asked for, and says so.
    pub(super) fn write(&self, of: &Calibration) -> Result<(), Error> {
        let done = |file: &Path, text: &[u8], says: &str| {
            write_atomic(file, text)?;
            println!("{}: {says}", file.display());
            Ok::<(), Error>(())
        };
        let accel = |option: &str| {
            let remedy = "give a calibration of the accelerometers";
            of.accel
                .ok_or_else(|| refused(option, "needs accelerometers", remedy))
        };
        if let Some(file) = &self.imu_tk {
            let text = tk::write(&accel("--imu-tk")?);
            done(
                file,
                text.as_bytes(),
                "T, K and B of imu_tk, f = T K (z - B)",
            )?;
        }
        if let Some(file) = &self.imu_calib {
            let text = sm::write(&accel("--imu-calib")?);
            done(
                file,
                text.as_bytes(),
                "SM and bias of imu_calib, f = SM z - bias",
            )?;
        }
        let unit = self.unit()?;
        if let (Some(file), Some((name, unit))) = (&self.kalibr, &unit) {
            let noise = kalibr::Noise {
                rate_hz: Some(unit.sensor.rate()),
                gyro: [
                    unit.gyro.angle_random_walk_dpsqrth * DEG_PER_SQRT_H,
                    unit.gyro.bias_in_run_dph * DEG_PER_H / ROOT_OF_HOUR,
                ],
                accel: [
                    unit.accel.velocity_random_walk_ugpsqrthz * UG_PER_SQRT_HZ,
                    unit.accel.bias_in_run_ug * UG / ROOT_OF_HOUR,
                ],
            };
            let about = format!("host-sim, noise of unit {name}");
            let text = kalibr::write(of.accel.as_ref(), of.gyro.as_ref(), &noise, &about);
            done(
                file,
                text.as_bytes(),
                "M of Kalibr, z = M f + b; the biases have no place in it",
            )?;
        }
        if let Some(file) = &self.weights {
            self.write_weights(file, of, unit.as_ref().map(|(_, unit)| unit))?;
        }
        match (&self.output, &unit) {
            (Some(file), Some((name, _))) => self.write_unit(file, name, of),
            _ => Ok(()),
        }
    }

    fn write_weights(
        &self,
        file: &Path,
        of: &Calibration,
        unit: Option<&Unit>,
    ) -> Result<(), Error> {
        let none = (Matrix3::zeros(), Vector3::zeros());
        let both = [of.gyro, of.accel].map(|t| t.map_or(none, |t| t.device()));
        let maps = both.map(|(m, _)| [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)])));
        let nets = calibrated(maps, both.map(|(_, b)| b.into()));
        write_atomic(file, &images(&nets))?;
        println!(
            "{}: weights, f = z - M z - b; `device weights put` and `device store` load them",
            file.display()
        );
        let configuration = unit.map(Unit::configuration).transpose();
        let configuration = configuration.map_err(|f| f.error(Path::new("--unit")))?;
        for (key, times) in configuration.iter().flat_map(|c| clipped(&nets, c)) {
            println!(
                "- the device would not subtract all of it: it needs {times:.1} times the limit \
                 that {key} sets; give it the file of --output"
            );
        }
        Ok(())
    }

    fn write_unit(&self, file: &Path, name: &str, of: &Calibration) -> Result<(), Error> {
        let (table, sources) = base::given(name)?;
        let text = base::filled(table, sources, &of.numbers, &of.about);
        let (read, found) = examine(&text);
        if read.is_none() {
            let faults = found.into_iter().filter(|finding| !finding.doubt);
            return Err(Error::Several(faults.map(|f| f.error(file)).collect()));
        }
        base::write(file, &text)?;
        println!("{}: unit file", file.display());
        doubts(file, found);
        Ok(())
    }
}
