//! The files of a user's recording on the command line, for `replay` and `convert`.

use crate::beside::Beside;
use crate::open::{Loaded, Source};
use crate::progress;
use clap::{Args as ClapArgs, ValueEnum};
use firmware::wire::novatel::ImuType;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::rotation::from_euler;
use host_core::inertial::units::DEG;
use host_estimation::analysis::doubts::{Field, FixFields, Says};
use host_io::recordings::corrected::Original;
use host_io::recordings::generic::NamedUnit;
use host_io::recordings::record::Record;
use host_io::recordings::{InitialAttitude, generic, kfgins, novatel};
use host_unit::Unit;
use std::path::PathBuf;

/// CSV files with a TOML header.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Csv {
    /// Meaning of the columns; `simulate` writes an example, and docs/your-data.md explains each
    /// key
    #[arg(long, value_name = "FILE.toml")]
    header: PathBuf,
    /// Files instead of those that the header names: first the IMU's, then that of the fixes
    #[arg(value_name = "FILE.csv")]
    files: Vec<PathBuf>,
    /// True states to judge against instead of the fixes; replaces the file of the header's
    /// 'truth'. Its columns are those that the header's table 'truth' names, else those of
    /// simulate's truth.csv or of the header's fixes
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    #[command(flatten)]
    beside: Beside,
}

/// KF-GINS text files.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct KfGins {
    /// Increments: second of week, rad, m/s, axes forward-right-down
    imu: PathBuf,
    /// Positions, 7 columns, or 13 with velocities
    gnss: PathBuf,
    /// Order of the last nine of 13 columns [default: the one that the numbers fit]
    #[arg(long, value_name = "ORDER")]
    gnss_order: Option<GnssOrder>,
    /// True states (week, second, position, velocity, attitude), for the reference and the initial
    /// attitude
    #[arg(long, value_name = "FILE", conflicts_with_all = ["standstill_s", "attitude"])]
    truth: Option<PathBuf>,
    /// Seconds for which the vehicle stands at the first fix, for alignment
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(90..=86_400), conflicts_with = "attitude")]
    standstill_s: Option<u32>,
    /// Attitude at the first fix, deg: roll, pitch (nose up), heading (clockwise from north)
    #[arg(
        long,
        value_name = "ROLL,PITCH,HEADING",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    attitude: Vec<f64>,
}

/// Order of the columns behind the position.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum GnssOrder {
    /// Velocity, then the standard deviations of position and velocity
    VelocitySigma,
    /// Standard deviations of position, velocity, standard deviations of velocity
    SigmaVelocity,
}

/// A NovAtel binary log.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Novatel {
    /// Binary log with RAWIMUSX (or another raw log) and INSPVAS
    pub file: PathBuf,
    /// Forward, right and down of the vehicle in axes of the sensor
    #[arg(
        long,
        default_value = "y x -z",
        value_name = "AXES",
        allow_hyphen_values = true
    )]
    mounting: String,
    /// NovAtel's number of the IMU type, which RAWIMU and RAWIMUS do not hold
    #[arg(long, value_name = "NUMBER")]
    imu: Option<u8>,
}

impl Csv {
    /// Reads it.
    ///
    /// # Errors
    /// Any fault of the files.
    pub fn record(&self) -> Result<Record, Error> {
        if let Ok(Original::Text(text)) = self.original() {
            progress::scale_by(&text.file);
        }
        let truth = self.truth.as_deref();
        if !self.beside.is_given() {
            return generic::read_with_truth(&self.header, &self.files, truth);
        }
        let mut record = generic::samples(&self.header, &self.files, truth)?;
        self.beside.replace(&mut record, None)?;
        Ok(record)
    }

    /// The file into which corrected samples are written.
    fn original(&self) -> Result<Original, Error> {
        generic::original(&self.header, &self.files).map(Original::Text)
    }

    /// The unit that the header names.
    fn unit(&self) -> Result<Option<Unit>, Error> {
        generic::unit(&self.header)
    }

    /// Description of the samples by the header.
    fn says(&self, record: &Record) -> Result<Says, Error> {
        let [gyro, accel] = generic::units(&self.header, 1.0 / record.rate_hz as f64)?;
        let fixes = match self.beside.is_given() {
            true => None,
            false => generic::fix_units(&self.header)?,
        };
        let field = |name: &str, (given, units): (NamedUnit, Vec<NamedUnit>)| Field {
            name: name.into(),
            named: Some(given),
            units,
        };
        Ok(Says {
            file: self.header.clone(),
            gyro: field("imu.gyro.unit", gyro),
            accel: field("imu.accel.unit", accel),
            axes: ("imu.axes".into(), RIGHT_FORWARD_UP.into()),
            rate: None,
            fixes: fixes.map_or_else(FixFields::default, |fixes| FixFields {
                time: Field::fixed("gnss.time_offset_s"),
                time_unit: field("gnss.time.unit", fixes.time),
                position: field("gnss.latitude.unit", fixes.position),
                height: fixes.height.map_or_else(
                    || Field::fixed("gnss.height"),
                    |height| field("gnss.height.unit", height),
                ),
                velocity: fixes.velocity.map_or_else(
                    || Field::fixed("gnss.velocity"),
                    |velocity| field("gnss.velocity.unit", velocity),
                ),
                order: ("gnss.velocity.order".into(), fixes.order),
            }),
        })
    }
}

/// An example of axes.
const RIGHT_FORWARD_UP: &str = "'y x -z' for right-forward-up";

impl KfGins {
    /// The file into which corrected samples are written.
    fn original(&self) -> Original {
        Original::Text(kfgins::original(&self.imu))
    }

    /// Description of the samples by the format.
    fn says(&self) -> Says {
        Says {
            file: self.imu.clone(),
            gyro: Field::fixed("dtheta in rad"),
            accel: Field::fixed("dv in m/s"),
            axes: ("axes".into(), "forward-right-down, those of KF-GINS".into()),
            rate: None,
            fixes: FixFields::default(),
        }
    }

    /// Reads it.
    ///
    /// # Errors
    /// A wrong option, and any fault of the files.
    pub fn record(&self) -> Result<Record, Error> {
        progress::scale_by(&self.imu);
        let order = self.gnss_order.map(|order| match order {
            GnssOrder::VelocitySigma => kfgins::Order::VelocitySigma,
            GnssOrder::SigmaVelocity => kfgins::Order::SigmaVelocity,
        });
        let mut record = kfgins::read_in_order(&self.imu, &self.gnss, None, order)?;
        let truth = self.truth.as_deref().map(kfgins::read_truth).transpose()?;
        record.initial_attitude = match (&truth, self.standstill_s, &self.attitude[..]) {
            (Some(truth), ..) => {
                let first = record.first_epoch();
                let within = truth.span().filter(|(t0, t1)| (*t0..=*t1).contains(&first));
                if within.is_none() {
                    return Err(Error::Option {
                        option: "--truth".into(),
                        problem: format!("does not cover the first epoch, {first} s"),
                        remedy: "give the truth of the same drive, in seconds of the same week"
                            .into(),
                    });
                }
                Some(InitialAttitude::Known(truth.at(first).q_bn))
            }
            (None, Some(s), _) => Some(InitialAttitude::Standstill(s as usize)),
            (None, None, []) => None,
            (None, None, angles) => Some(InitialAttitude::Known(attitude(angles)?)),
        };
        record.truth = truth;
        Ok(record)
    }
}

/// An attitude from roll, pitch and heading, deg.
pub(crate) fn attitude(angles: &[f64]) -> Result<nalgebra::UnitQuaternion<f64>, Error> {
    match angles {
        [roll, pitch, heading] if angles.iter().all(|a| a.abs() <= 360.0) => {
            Ok(from_euler(roll * DEG, pitch * DEG, heading * DEG))
        }
        _ => Err(Error::Option {
            option: "--attitude".into(),
            problem: format!("{angles:?} is not an attitude"),
            remedy: "give roll,pitch,heading in degrees, -360 to 360".into(),
        }),
    }
}

impl Novatel {
    /// Reads it.
    ///
    /// # Errors
    /// A wrong option, and any fault of the log.
    pub fn record(&self) -> Result<Record, Error> {
        novatel::record(&novatel::read(&self.file)?, self.axes()?, self.kind())
    }

    /// The file into which corrected samples are written.
    fn original(&self, log: &novatel::Recording) -> Result<Original, Error> {
        novatel::log(log, self.axes()?, self.kind()).map(Original::Novatel)
    }

    /// Description of the samples by the log and the options.
    fn says(&self, record: &Record) -> Says {
        Says {
            file: self.file.clone(),
            gyro: Field::fixed("--imu"),
            accel: Field::fixed("--imu"),
            axes: ("--mounting".into(), RIGHT_FORWARD_UP.into()),
            rate: Some(("--imu".into(), record.rate_hz as f64)),
            fixes: FixFields::default(),
        }
    }

    fn kind(&self) -> Option<ImuType> {
        self.imu.map(ImuType)
    }

    fn axes(&self) -> Result<Axes, Error> {
        Axes::parse(&self.mounting).map_err(|why| Error::Option {
            option: "--mounting".into(),
            problem: format!("'{}' {why}", self.mounting),
            remedy: "give forward, right and down in axes of the sensor, as in 'y x -z' for \
                     right-forward-up"
                .into(),
        })
    }
}

impl Source for Csv {
    fn load(&self, _: Option<&Unit>) -> Result<Loaded, Error> {
        let named = self.unit()?;
        let record = self.record()?;
        Ok(Loaded {
            name: "csv",
            says: self.says(&record)?,
            record,
            named,
            original: Some(self.original()?),
        })
    }
}

impl Source for KfGins {
    fn load(&self, _: Option<&Unit>) -> Result<Loaded, Error> {
        Ok(Loaded {
            name: "kf-gins",
            record: self.record()?,
            says: self.says(),
            named: None,
            original: Some(self.original()),
        })
    }
}

impl Source for Novatel {
    fn load(&self, _: Option<&Unit>) -> Result<Loaded, Error> {
        self.loaded(&novatel::read(&self.file)?)
    }
}

impl Novatel {
    /// The recording of a log that was read.
    ///
    /// # Errors
    /// A wrong option, or a log without what is needed.
    pub fn loaded(&self, log: &novatel::Recording) -> Result<Loaded, Error> {
        let record = novatel::record(log, self.axes()?, self.kind())?;
        Ok(Loaded {
            name: "novatel",
            says: self.says(&record),
            record,
            named: None,
            original: Some(self.original(log)?),
        })
    }
}
