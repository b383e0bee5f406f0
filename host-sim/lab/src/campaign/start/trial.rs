//! One trial: a sensor is switched on in a vehicle, and the device's learner from fixes starts or
//! does not. It gets samples at the full rate, as on the device.

use super::class::{Class, JOURNEY_S};
use super::receiver::{Receiver, Sent, fixes};
use crate::campaign::Seeds;
use firmware::compensator::Compensator;
use firmware::configuration::{Configuration, UNKNOWN};
use firmware::control::HeadingSource;
use firmware::learn::{FixMemory, Settings};
use firmware::model::Nets;
use firmware::sample::{Counts, RawSample};
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_core::simulator::imu::magnetic::dipole_field;
use host_core::simulator::imu::{Imu, ImuSpec};
use host_core::simulator::truth::{Journey, Truth};
use host_estimation::learning::fix_learner::Device;
use host_estimation::learning::rests::{Detector, Rests};
use host_unit::Unit;
use nalgebra::{Quaternion, UnitQuaternion};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Largest sample rate, Hz: enough for the classes' motion, in a fifth of the time of 1000 Hz.
pub const MOST_HZ: u32 = 200;
/// Number of the random stream of the fixes, beside that of the journey.
const FIXES: u64 = 1;
/// Seconds after the start at which the errors are recorded.
pub const LATER_S: [u32; 2] = [60, 300];
/// A heading is silently wrong if it is off by more than this many claimed standard deviations and
/// by more than [`LEAST_DEG`].
const SIGMAS: f64 = 4.0;
const LEAST_DEG: f64 = 3.0;

/// A class with the common parameters of its trials.
#[derive(Debug, Clone)]
pub struct Prepared {
    pub(super) class: Class,
    spec: ImuSpec,
    configuration: Configuration,
    receiver: Receiver,
    /// Delay of the fixes, s, and lever arm, m.
    link: [f64; 4],
}

/// Errors at one time, and what the device claims.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// Error of the heading, deg, -180 to 180.
    pub heading_deg: f64,
    /// Standard deviation of the heading that the device claims, deg.
    pub sigma_deg: f64,
    /// Error of roll and pitch together, deg.
    pub tilt_deg: f64,
}

/// The start of the device's navigator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Started {
    /// Time of the start, s after power-on: the first whole second at which it navigates.
    pub at_s: u32,
    /// Source of the heading.
    pub way: String,
    /// Mean normalised innovation squared of the alignment in motion; 0 without one.
    pub residual: f64,
    /// Errors at the start.
    pub attitude: Attitude,
    /// Errors after [`LATER_S`], if the trial lasts that long and the device still navigates.
    pub later: [Option<Attitude>; 2],
}

/// Result of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// Name of the class.
    pub class: String,
    /// Seed of all random numbers.
    pub seed: u32,
    /// The first start; `None` if it never navigated.
    pub started: Option<Started>,
    /// When the heading was first silently wrong, s after power-on.
    pub wrong_at_s: Option<u32>,
    /// Seconds for which it was silently wrong.
    pub wrong_s: u32,
    /// Seconds for which the device navigated.
    pub navigated_s: u32,
    /// How often the navigator was lost, or dropped because it contradicted the fixes.
    pub lost: u32,
    /// Alignments that were rejected because they contradicted the fixes.
    pub refused_alignments: u32,
    /// Fixes that the navigator used.
    pub fixes: u32,
    /// Number of these with a component that was rejected as an outlier.
    pub refused: u32,
    /// Fixes that arrived too late.
    pub late: u32,
    /// The rests that its detector found without a receiver: from samples alone, and where the
    /// vehicle has wheels with their speed once a second.
    pub rests: [Option<Rests>; 2],
}

impl Attitude {
    /// The errors of an estimate (body or sensor axes to NED) against the truth.
    fn of(estimate: &UnitQuaternion<f64>, truth: &UnitQuaternion<f64>, sigma: f64) -> Self {
        // the error is a turn about the vertical after a turn about a level axis
        let error = (estimate * truth.inverse()).into_inner();
        let heading = 2.0 * error.k.atan2(error.w);
        let wrapped = heading - std::f64::consts::TAU * (heading / std::f64::consts::TAU).round();
        let level = error.i.hypot(error.j);
        Self {
            heading_deg: wrapped / DEG,
            sigma_deg: sigma / DEG,
            tilt_deg: 2.0 * level.atan2(error.k.hypot(error.w)) / DEG,
        }
    }

    /// Whether the heading is wrong by more than the device claims.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        let (error, claimed) = (self.heading_deg.abs(), SIGMAS * self.sigma_deg);
        // NaN is wrong too
        error.is_nan() || claimed.is_nan() || error > claimed.max(LEAST_DEG)
    }

    /// Square of the error divided by the claimed variance.
    #[must_use]
    pub fn normalised_square(&self) -> f64 {
        (self.heading_deg / self.sigma_deg).powi(2)
    }
}

impl Prepared {
    /// A class with another sensor than its own, if given.
    ///
    /// # Errors
    /// A unit that a device rejects; a rate of fixes that does not divide the samples.
    pub fn new(class: &Class, unit: Option<&Unit>, receiver: &Receiver) -> Result<Self, Error> {
        let mut unit = match unit {
            Some(unit) => unit.clone(),
            None => Unit::load(class.unit)?,
        };
        unit.vehicle.kind = class.configured;
        if let Some(delay) = receiver.delay_s {
            unit.receiver.fix_delay_ms = 1e3 * delay;
        }
        if let Some(arm) = receiver.lever_arm {
            unit.receiver.lever_arm_m = arm;
        }
        let mut spec = unit.simulated();
        spec.rate_hz = spec.rate_hz.min(MOST_HZ);
        if !spec.rate_hz.is_multiple_of(receiver.rate_hz) {
            return Err(Error::Option {
                option: "--rate-hz".into(),
                problem: format!(
                    "is {}, of which the {} samples a second of '{}' are not a multiple",
                    receiver.rate_hz, spec.rate_hz, unit.name
                ),
                remedy: "give 1, 2, 5 or 10".into(),
            });
        }
        let configuration = unit.configuration().map_err(|found| Error::Option {
            option: "--unit".into(),
            problem: format!("'{}': {} {}", unit.name, found.key, found.problem),
            remedy: found.remedy,
        })?;
        let [x, y, z] = unit.receiver.lever_arm_m;
        Ok(Self {
            class: *class,
            spec,
            configuration,
            receiver: *receiver,
            link: [1e-3 * unit.receiver.fix_delay_ms, x, y, z],
        })
    }

    /// Sensor axes to body axes.
    fn mounting(&self) -> UnitQuaternion<f64> {
        if self.configuration.mounting == UNKNOWN {
            return UnitQuaternion::identity(); // body axes are the sensor's
        }
        let [w, x, y, z] = self.configuration.mounting.map(f64::from);
        UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
    }

    fn truth(&self, seeds: &Seeds) -> Truth {
        let journey = Journey {
            start: Geodetic {
                lat: self.class.latitude_deg * DEG,
                lon: 8.0 * DEG,
                h: 400.0,
            },
            heading: seeds.heading,
            standstill_s: self.class.standstill_s,
            drive_s: JOURNEY_S,
            segments: None,
            vibration: 1.0,
            dt: 1.0 / f64::from(self.spec.rate_hz),
            epochs_per_s: self.receiver.rate_hz,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(seeds.drive);
        self.class.vehicle.truth(&journey, &mut rng)
    }

    fn compensator(&self) -> Compensator {
        let dt = 1.0 / f64::from(self.spec.rate_hz);
        let block = (f64::from(self.configuration.correction.block) / dt).round() as u16;
        let Nets { gyro, accel, .. } = Nets::NONE;
        let limit = self.configuration.correction.limit;
        let made = Compensator::new(gyro, accel, Imu::lsb(&self.spec), dt, block, limit);
        let mut compensator = made.expect("a configuration that was checked");
        compensator.set_inputs(self.configuration.inputs);
        compensator
    }

    /// The trial with this seed.
    #[must_use]
    pub fn run(&self, seed: u32) -> Trial {
        let seeds = Seeds::of(seed);
        let truth = self.truth(&seeds);
        let mut rng = ChaCha8Rng::seed_from_u64(seeds.drive);
        rng.set_stream(FIXES);
        let mut sent = fixes(&self.receiver, self.link, &truth, &mut rng)
            .into_iter()
            .peekable();
        let mut memory = Box::new(FixMemory::ZEROED);
        let settings = Settings::of(&self.configuration);
        let mut device = Device::new(&mut memory, settings, self.compensator());
        let mut imu = Imu::new(&self.spec, seeds.unit, seeds.turn_on);
        let dt = 1.0 / f64::from(self.spec.rate_hz);
        let mut detector = Detector::new(&settings, Imu::lsb(&self.spec), dt);
        let mut rolling = (self.class.vehicle.rolls())
            .then(|| Detector::with_wheels(&settings, Imu::lsb(&self.spec), dt));
        let mut judge = Judge::new(self.class.name, seed);
        let mounting = self.mounting();
        let samples_per_s = self.spec.rate_hz as usize;
        for (k, increment) in truth.increments.iter().enumerate() {
            if k % samples_per_s == 0 {
                let at = &truth.epochs[k / truth.samples_per_epoch];
                let body = at.q_bn.inverse() * dipole_field(&at.position);
                imu.set_field(mounting.inverse_transform_vector(&body));
                device.temperature(imu.readings().axes.mean() as f32);
            }
            let counts = measured(&mut imu, increment, &mounting);
            detector.sample(&counts);
            if let Some(rolling) = &mut rolling {
                rolling.sample(&counts);
            }
            device.sample(&RawSample::Counts {
                gyro: counts.dtheta,
                accel: counts.dv,
            });
            let came = k + 1;
            if came % samples_per_s == 0 {
                let now = &truth.epochs[came / truth.samples_per_epoch];
                judge.second((came / samples_per_s) as u32, &mut device, now, &mounting);
                detector.second(now);
                if let Some(rolling) = &mut rolling {
                    rolling.second(now);
                }
            }
            while let Some(Sent { fix, .. }) = sent.next_if(|sent| sent.sample <= came) {
                device.fix(&fix);
            }
        }
        judge.end(
            &device,
            [Some(detector), rolling].map(|of| of.map(|of| of.rests())),
        )
    }
}

/// A sample of the sensor in its own axes.
fn measured(imu: &mut Imu, body: &Increment, mounting: &UnitQuaternion<f64>) -> Counts {
    let sensor = Increment {
        dtheta: mounting.inverse_transform_vector(&body.dtheta),
        dv: mounting.inverse_transform_vector(&body.dv),
    };
    imu.measure(&sensor).0
}

/// Compares the device with the truth once a second.
struct Judge {
    trial: Trial,
    navigated: bool,
}

impl Judge {
    fn new(class: &str, seed: u32) -> Self {
        Self {
            trial: Trial {
                class: class.to_owned(),
                seed,
                started: None,
                wrong_at_s: None,
                wrong_s: 0,
                navigated_s: 0,
                lost: 0,
                refused_alignments: 0,
                fixes: 0,
                refused: 0,
                late: 0,
                rests: [None; 2],
            },
            navigated: false,
        }
    }

    /// Judges a whole second, after its samples and before a fix of that time.
    fn second(
        &mut self,
        at_s: u32,
        device: &mut Device<'_>,
        truth: &NavState,
        mounting: &UnitQuaternion<f64>,
    ) {
        let Some(state) = device.nav() else {
            self.trial.lost += u32::from(self.navigated);
            self.navigated = false;
            return;
        };
        self.navigated = true;
        let report = device.report();
        let sigma = report.heading_sigma.into();
        let attitude = Attitude::of(&state.q_bn, &(truth.q_bn * mounting), sigma);
        let started = self.trial.started.get_or_insert_with(|| Started {
            at_s,
            way: word(report.way).to_owned(),
            residual: report.residual.into(),
            attitude,
            later: [None; 2],
        });
        for (later, after_s) in started.later.iter_mut().zip(LATER_S) {
            if at_s == started.at_s + after_s {
                *later = Some(attitude);
            }
        }
        self.trial.navigated_s += 1;
        if attitude.is_wrong() {
            self.trial.wrong_s += 1;
            self.trial.wrong_at_s.get_or_insert(at_s);
        }
    }

    fn end(mut self, device: &Device<'_>, rests: [Option<Rests>; 2]) -> Trial {
        let report = device.report();
        self.trial.rests = rests;
        self.trial.fixes = report.fixes;
        self.trial.refused = report.refused;
        self.trial.late = report.late;
        self.trial.refused_alignments = report.refused_alignments;
        self.trial
    }
}

/// The source of the heading, in a word.
fn word(way: HeadingSource) -> &'static str {
    match way {
        HeadingSource::None => "nothing",
        HeadingSource::Gyrocompass => "gyrocompass",
        HeadingSource::Course => "course",
        HeadingSource::Velocity => "velocity",
        HeadingSource::Heading => "heading",
        HeadingSource::Known => "known",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::rotation::from_euler;

    /// Given errors in heading and tilt are found at any attitude.
    #[test]
    fn the_error_is_divided_into_heading_and_tilt() {
        for (roll, pitch, heading) in [(0.0, 0.0, 0.0), (0.5, -0.2, 2.0), (-1.0, 0.3, -3.0)] {
            let truth = from_euler(roll, pitch, heading);
            for error in [-170.0, -3.0, 0.0, 12.0, 179.0] {
                let tilt = from_euler(0.3 * DEG, -0.4 * DEG, 0.0);
                let estimate = from_euler(0.0, 0.0, error * DEG) * tilt * truth;
                let of = Attitude::of(&estimate, &truth, 1.0 * DEG);
                assert!((of.heading_deg - error).abs() < 0.01, "{of:?}");
                assert!((of.tilt_deg - 0.5).abs() < 0.01, "{of:?}");
                assert!((of.sigma_deg - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_heading_is_wrong_beyond_four_sigmas_and_three_degrees() {
        let of = |heading_deg, sigma_deg| Attitude {
            heading_deg,
            sigma_deg,
            tilt_deg: 0.0,
        };
        assert!(!of(2.9, 0.1).is_wrong());
        assert!(of(-3.1, 0.1).is_wrong());
        assert!(!of(7.9, 2.0).is_wrong());
        assert!(of(8.1, 2.0).is_wrong());
        assert!(of(f64::NAN, 2.0).is_wrong());
        assert!(of(90.0, f64::NAN).is_wrong());
    }
}
