//! Recordings of messages on the command line, for `replay` and `convert`: files of the recorders
//! of robots, autopilots and receivers.

use crate::beside::{Beside, reading_bar};
use crate::open::{Loaded, Source};
use crate::options::{positive, refused, within};
use crate::progress;
use crate::source::attitude;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::units::DEG;
use host_estimation::analysis::doubts::{Field, FixFields, Says};
use host_io::recordings::corrected::Original;
use host_io::recordings::record::Record;
use host_io::recordings::{InitialAttitude, Progress, Reading, euroc, mcap, ubx, ulog};
use host_unit::Unit;
use host_unit::mounting::Mounting;
use nalgebra::{Matrix3, Rotation3};
use std::path::{Path, PathBuf};

/// Range of delays of fixes, s.
const LONGEST_DELAY: [f64; 2] = [-1.0, 5.0];

/// A recording of messages.
pub trait Messages {
    /// Name of the command.
    const NAME: &'static str;

    /// Reads it. `unit` is the unit of the command line.
    ///
    /// # Errors
    /// A wrong option, and any fault of the files.
    fn read(&self, unit: Option<&Unit>, progress: Progress<'_>) -> Result<Reading, Error>;

    /// Description of the samples by the format and the options.
    fn says(&self) -> Says;

    /// The file into which corrected samples are written; `None` for a format that is not written.
    ///
    /// # Errors
    /// A wrong mounting.
    fn original(&self, _unit: Option<&Unit>) -> Result<Option<Original>, Error> {
        Ok(None)
    }

    /// Options for fixes from another file.
    fn beside(&self) -> &Beside;

    /// Reads it with a bar for progress, and prints its notes.
    ///
    /// # Errors
    /// As [`Self::read`].
    fn record(&self, unit: Option<&Unit>) -> Result<Record, Error> {
        let bar = reading_bar();
        let read = self.read(unit, &|read, length| {
            bar.set_length(length);
            bar.set_position(read);
        });
        bar.finish_and_clear();
        let reading = read?;
        for note in reading.notes {
            progress::say(&note);
        }
        let mut record = reading.record;
        self.beside().replace(&mut record, reading.origin_s)?;
        Ok(record)
    }
}

impl<S: Messages + ClapArgs> Source for S {
    fn load(&self, unit: Option<&Unit>) -> Result<Loaded, Error> {
        Ok(Loaded {
            name: S::NAME,
            record: self.record(unit)?,
            says: self.says(),
            named: None,
            original: self.original(unit)?,
        })
    }
}

/// Mounting of the IMU in the vehicle, and initial attitude.
#[derive(Debug, ClapArgs)]
struct Body {
    /// Forward, right and down of the vehicle in axes of the IMU, as in 'y x -z' for
    /// right-forward-up [default: the mounting of the unit file, else the axes of the format]
    #[arg(long, value_name = "AXES", allow_hyphen_values = true)]
    mounting: Option<String>,
    /// Longest step between rates that is interpolated, s [default: three samples or 0.1 s]
    #[arg(long, value_name = "SECONDS")]
    max_gap_s: Option<f64>,
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
    #[command(flatten)]
    beside: Beside,
}

impl Body {
    /// Rotation from the axes of the IMU to forward-right-down. `usual`: the axes of the format.
    fn mounting(&self, unit: Option<&Unit>, usual: Axes) -> Result<Rotation3<f64>, Error> {
        let of_unit = unit.filter(|unit| unit.mounting != Mounting::default());
        let axes = match (&self.mounting, of_unit) {
            (Some(text), _) => Axes::parse(text).map_err(|why| {
                let remedy = "give forward, right and down in axes of the IMU, as in 'y x -z' for \
                              right-forward-up";
                refused("--mounting", format!("'{text}' {why}"), remedy)
            })?,
            (None, Some(unit)) => {
                let rotation = unit.mounting.rotation().map_err(|_| {
                    refused(
                        "--unit",
                        "has a wrong mounting",
                        "run 'unit check' on the file",
                    )
                })?;
                return Ok(rotation.to_rotation_matrix());
            }
            (None, None) => usual,
        };
        let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let matrix = Matrix3::from_columns(&columns.map(|axis| axes.turn(axis)));
        Ok(Rotation3::from_matrix_unchecked(matrix))
    }

    fn max_gap_s(&self) -> Result<Option<f64>, Error> {
        let given = self.max_gap_s;
        given.map(|s| positive("--max-gap-s", s)).transpose()
    }

    /// Attitude at the first fix by the options.
    fn start(&self) -> Result<Option<InitialAttitude>, Error> {
        match (self.standstill_s, &self.attitude[..]) {
            (Some(s), _) => Ok(Some(InitialAttitude::Standstill(s as usize))),
            (None, []) => Ok(None),
            (None, angles) => Ok(Some(InitialAttitude::Known(attitude(angles)?))),
        }
    }
}

/// Description of the samples of a format with fixed units.
fn says(file: &Path, gyro: &str, accel: &str) -> Says {
    Says {
        file: file.to_path_buf(),
        gyro: Field::fixed(gyro),
        accel: Field::fixed(accel),
        axes: ("--mounting".into(), "'y x -z' for right-forward-up".into()),
        rate: None,
        fixes: FixFields::default(),
    }
}

/// A bag of ROS 2 in MCAP.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Mcap {
    /// MCAP file, or the folder of a bag with its metadata.yaml
    bag: PathBuf,
    /// Topic of the IMU (sensor_msgs/msg/Imu) [default: the only one]
    #[arg(long, value_name = "TOPIC")]
    imu_topic: Option<String>,
    /// Topic of the fixes (sensor_msgs/msg/NavSatFix) [default: the only one]
    #[arg(long, value_name = "TOPIC")]
    fix_topic: Option<String>,
    /// Topic of the receiver's velocities, east-north-up (geometry_msgs/msg/TwistStamped or
    /// TwistWithCovarianceStamped) [default: none]
    #[arg(long, value_name = "TOPIC")]
    velocity_topic: Option<String>,
    /// Take the times at which the recorder received the messages, not their stamps
    #[arg(long)]
    bag_time: bool,
    #[command(flatten)]
    body: Body,
}

impl Messages for Mcap {
    const NAME: &'static str = "mcap";

    fn beside(&self) -> &Beside {
        &self.body.beside
    }

    fn read(&self, unit: Option<&Unit>, progress: Progress<'_>) -> Result<Reading, Error> {
        let choice = mcap::Choice {
            imu: self.imu_topic.clone(),
            fix: self.fix_topic.clone(),
            velocity: self.velocity_topic.clone(),
            bag_time: self.bag_time,
            max_gap_s: self.body.max_gap_s()?,
            mounting: self.body.mounting(unit, Axes::FORWARD_LEFT_UP)?,
        };
        let start = self.body.start()?;
        let mut reading = mcap::read(&self.bag, &choice, progress)?;
        reading.record.initial_attitude = start;
        Ok(reading)
    }

    fn says(&self) -> Says {
        says(
            &self.bag,
            "angular_velocity in rad/s",
            "linear_acceleration in m/s2",
        )
    }
}

/// A log of PX4.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Ulog {
    /// Log, which usually ends in .ulg
    log: PathBuf,
    /// Instance of vehicle_imu [default: the first that is logged whole, else sensor_combined]
    #[arg(long, value_name = "NUMBER")]
    instance: Option<u8>,
    /// Time from validity to arrival of a fix, s [default: EKF2_GPS_DELAY of the autopilot]
    #[arg(long, value_name = "SECONDS")]
    fix_delay_s: Option<f64>,
    /// Start with the autopilot's attitude at the first fix
    #[arg(long, conflicts_with_all = ["attitude", "standstill_s", "fixes"])]
    attitude_from_log: bool,
    #[command(flatten)]
    body: Body,
}

impl Messages for Ulog {
    const NAME: &'static str = "ulog";

    fn beside(&self) -> &Beside {
        &self.body.beside
    }

    fn read(&self, unit: Option<&Unit>, progress: Progress<'_>) -> Result<Reading, Error> {
        let delay = self.fix_delay_s;
        let choice = ulog::Choice {
            instance: self.instance,
            fix_delay_s: delay
                .map(|s| within("--fix-delay-s", s, LONGEST_DELAY))
                .transpose()?,
            attitude: self.attitude_from_log,
            max_gap_s: self.body.max_gap_s()?,
            mounting: self.body.mounting(unit, Axes::FORWARD_RIGHT_DOWN)?,
        };
        let start = self.body.start()?;
        let mut reading = ulog::read(&self.log, &choice, progress)?;
        let record = &mut reading.record;
        record.initial_attitude = start.or(record.initial_attitude);
        Ok(reading)
    }

    fn says(&self) -> Says {
        says(
            &self.log,
            "gyros in rad or rad/s",
            "accelerometers in m/s or m/s2",
        )
    }
}

/// A log of a u-blox receiver.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Ubx {
    /// Log with ESF-RAW (or ESF-MEAS) and NAV-PVT, as u-center records it
    log: PathBuf,
    /// Time from validity of the promptest fix to the sample before it in the log, s
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    fix_delay_s: f64,
    #[command(flatten)]
    body: Body,
}

impl Messages for Ubx {
    const NAME: &'static str = "ubx";

    fn beside(&self) -> &Beside {
        &self.body.beside
    }

    fn read(&self, unit: Option<&Unit>, progress: Progress<'_>) -> Result<Reading, Error> {
        let choice = ubx::Choice {
            fix_delay_s: within("--fix-delay-s", self.fix_delay_s, LONGEST_DELAY)?,
            max_gap_s: self.body.max_gap_s()?,
            mounting: self.body.mounting(unit, Axes::FORWARD_LEFT_UP)?,
        };
        let start = self.body.start()?;
        let mut reading = ubx::read(&self.log, &choice, progress)?;
        reading.record.initial_attitude = start;
        Ok(reading)
    }

    fn says(&self) -> Says {
        says(
            &self.log,
            "gyros of the receiver",
            "accelerometers of the receiver",
        )
    }
}

/// A folder of EuRoC.
#[derive(Debug, ClapArgs)]
#[group(skip)] // the commands have the same names
pub struct Euroc {
    /// Folder with mav0
    folder: PathBuf,
    /// Where the origin of the ground truth is: latitude, longitude, deg, height, m
    #[arg(
        long,
        value_name = "LAT,LON,HEIGHT",
        value_delimiter = ',',
        allow_hyphen_values = true,
        default_value = "47.4,8.5,450"
    )]
    origin: Vec<f64>,
    /// Seconds between two states of the ground truth that serve as fixes
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    fix_interval_s: f64,
    /// Standard deviations of these fixes: position, m, velocity, m/s
    #[arg(
        long,
        value_name = "M,M/S",
        value_delimiter = ',',
        default_value = "0.05,0.05"
    )]
    fix_sigma: Vec<f64>,
    #[command(flatten)]
    body: Body,
}

impl Euroc {
    fn origin(&self) -> Result<Geodetic, Error> {
        match self.origin[..] {
            [lat, lon, h] if lat.abs() < 89.9 && lon.abs() <= 360.0 && h.abs() < 20_000.0 => {
                Ok(Geodetic {
                    lat: lat * DEG,
                    lon: lon * DEG,
                    h,
                })
            }
            _ => Err(refused(
                "--origin",
                format!("is {:?}", self.origin),
                "give latitude,longitude,height in degrees and m, not at a pole",
            )),
        }
    }

    fn sigmas(&self) -> Result<[f64; 2], Error> {
        match self.fix_sigma[..] {
            [p, v] => Ok([positive("--fix-sigma", p)?, positive("--fix-sigma", v)?]),
            _ => {
                let problem = format!("is {:?}", self.fix_sigma);
                Err(refused(
                    "--fix-sigma",
                    problem,
                    "give two numbers, m and m/s",
                ))
            }
        }
    }
}

impl Messages for Euroc {
    const NAME: &'static str = "euroc";

    fn beside(&self) -> &Beside {
        &self.body.beside
    }

    fn read(&self, unit: Option<&Unit>, _: Progress<'_>) -> Result<Reading, Error> {
        let choice = euroc::Choice {
            origin: self.origin()?,
            interval_s: within("--fix-interval-s", self.fix_interval_s, [0.01, 60.0])?,
            sigmas: self.sigmas()?,
            max_gap_s: self.body.max_gap_s()?,
            mounting: self.body.mounting(unit, euroc::body())?,
        };
        let start = self.body.start()?;
        let mut reading = euroc::read(&self.folder, &choice)?;
        let record = &mut reading.record;
        if self.beside().is_given() {
            record.lever_arm_m = None; // that of the antenna, not of the ground truth
        }
        record.initial_attitude = start.or(record.initial_attitude);
        Ok(reading)
    }

    fn original(&self, unit: Option<&Unit>) -> Result<Option<Original>, Error> {
        let mounting = self.body.mounting(unit, euroc::body())?;
        euroc::original(&self.folder, mounting).map(|text| Some(Original::Text(text)))
    }

    fn says(&self) -> Says {
        says(&self.folder, "w_RS_S in rad/s", "a_RS_S in m/s2")
    }
}
