//! A simulated session: the true drive, the fixes on it, and the samples of an IMU on it.

use crate::inertial::earth::Geodetic;
use crate::inertial::gnss::Fix;
use crate::inertial::session::{EPOCH_S, Session};
use crate::inertial::sins::Increment;
use crate::simulator::gnss::GnssSpec;
use crate::simulator::imu::magnetic::dipole_field;
use crate::simulator::imu::{Draws, Imu, ImuSpec};
use crate::simulator::truth::{DriveConfig, Journey, Segment, Truth, Vehicle, random_drive};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::sync::LazyLock;

/// Settings of a simulated session.
#[derive(Debug, Clone)]
pub struct SessionConfig<'a> {
    /// IMU.
    pub imu: &'a ImuSpec,
    /// Receiver.
    pub gnss: &'a GnssSpec,
    /// Start position.
    pub start: Geodetic,
    /// Heading at the start, rad.
    pub heading: f64,
    /// Standstill before the drive, s.
    pub standstill_s: f64,
    /// Drive after the standstill, s. Ignored if `segments` are given.
    pub drive_s: f64,
    /// The segments of the drive. A random drive if `None`, and in other vehicles than on the road.
    pub segments: Option<&'a [Segment]>,
    /// Scale of the vibration.
    pub vibration: f64,
    /// Seed of the device.
    pub unit: u64,
    /// Seed of turn-on and noise.
    pub turn_on: u64,
    /// Seed of road and fixes.
    pub drive: u64,
}

/// The receiver of [`SessionConfig::new`].
static USUAL: LazyLock<GnssSpec> = LazyLock::new(GnssSpec::default);

impl<'a> SessionConfig<'a> {
    /// A session in middle latitudes with a random road, the usual receiver and the vibration of a
    /// car: so many seconds at rest and then of driving. The seeds are those of the device, of
    /// turn-on and noise, and of road and fixes.
    #[must_use]
    pub fn new(
        imu: &'a ImuSpec,
        [standstill_s, drive_s]: [f64; 2],
        [unit, turn_on, drive]: [u64; 3],
    ) -> Self {
        Self {
            imu,
            gnss: &USUAL,
            start: Geodetic {
                lat: 0.5,
                lon: 2.0,
                h: 60.0,
            },
            heading: 1.0,
            standstill_s,
            drive_s,
            segments: None,
            vibration: 1.0,
            unit,
            turn_on,
            drive,
        }
    }
}

/// Simulates a session on a road. Gives the session and the true drive.
#[must_use]
pub fn simulate(config: &SessionConfig<'_>) -> (Session, Truth) {
    simulate_in(&Vehicle::Road, config)
}

/// Simulates a session in any vehicle. A ship has no standstill.
#[must_use]
pub fn simulate_in(vehicle: &Vehicle, config: &SessionConfig<'_>) -> (Session, Truth) {
    let (session, drive) = simulate_drive(vehicle, config);
    (session, drive.truth)
}

/// As [`simulate_in`], with the drive, which can make other fixes.
#[must_use]
pub fn simulate_drive(vehicle: &Vehicle, config: &SessionConfig<'_>) -> (Session, Drive) {
    let drive = Drive::of(vehicle, config);
    let mut session = measure(config, config.imu, &drive.truth, &drive.fixes(config.gnss));
    if !vehicle.stands() {
        session.standstill = 0;
    }
    (session, drive)
}

/// The fix of each epoch, if there is one.
pub type Fixes = Vec<Option<Fix>>;

/// A true drive, and the random numbers of the fixes on it.
#[derive(Debug, Clone)]
pub struct Drive {
    /// The motion.
    pub truth: Truth,
    rng: ChaCha8Rng,
}

impl Drive {
    /// The drive of a vehicle.
    #[must_use]
    pub fn of(vehicle: &Vehicle, config: &SessionConfig<'_>) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(config.drive);
        let truth = match vehicle {
            Vehicle::Road => on_road(config, &mut rng),
            _ => vehicle.truth(&journey(config), &mut rng),
        };
        Self { truth, rng }
    }

    /// The fixes of a receiver, one for each epoch. Different receivers have the same drive and the
    /// same random numbers.
    #[must_use]
    pub fn fixes(&self, gnss: &GnssSpec) -> Fixes {
        let every = gnss.rate_hz.max(1) as usize;
        let all = self.timed_fixes(gnss).into_iter().step_by(every);
        all.map(|(_, fix)| fix).collect()
    }

    /// All fixes of a receiver, and when they arrive, s after power-on.
    #[must_use]
    pub fn timed_fixes(&self, gnss: &GnssSpec) -> Vec<(f64, Option<Fix>)> {
        gnss.of_drive(&self.truth, &mut self.rng.clone())
    }
}

/// The true drive on a road and its fixes.
#[must_use]
pub fn drive(config: &SessionConfig<'_>) -> (Truth, Fixes) {
    let drive = Drive::of(&Vehicle::Road, config);
    let fixes = drive.fixes(config.gnss);
    (drive.truth, fixes)
}

fn on_road(config: &SessionConfig<'_>, rng: &mut ChaCha8Rng) -> Truth {
    let mut segments = vec![Segment::hold(config.standstill_s)];
    match config.segments {
        Some(s) => segments.extend_from_slice(s),
        None => segments.extend(random_drive(config.drive_s, rng)),
    }
    let drive = DriveConfig {
        segments: &segments,
        start: config.start,
        heading: config.heading,
        dt: 1.0 / f64::from(config.imu.rate_hz),
        vibration: config.vibration,
    };
    Truth::new(&drive, rng)
}

fn journey<'a>(config: &SessionConfig<'a>) -> Journey<'a> {
    Journey {
        start: config.start,
        heading: config.heading,
        standstill_s: config.standstill_s,
        drive_s: config.drive_s,
        segments: None,
        vibration: config.vibration,
        dt: 1.0 / f64::from(config.imu.rate_hz),
        epochs_per_s: 1,
    }
}

/// The session that an IMU measures on a true drive.
#[must_use]
pub fn measure(
    config: &SessionConfig<'_>,
    spec: &ImuSpec,
    truth: &Truth,
    fixes: &[Option<Fix>],
) -> Session {
    let draws = Draws::of(config.turn_on, false);
    measured(config, spec, truth, fixes, draws).0
}

/// Like [`measure`], with the random numbers of the turn-on from their start. Gives also the IMU.
#[must_use]
pub fn measured(
    config: &SessionConfig<'_>,
    spec: &ImuSpec,
    truth: &Truth,
    fixes: &[Option<Fix>],
    draws: Draws,
) -> (Session, Imu) {
    let mut imu = Imu::with_draws(spec, config.unit, config.turn_on, draws);
    let mut counts = Vec::with_capacity(truth.increments.len());
    let mut systematic = Vec::with_capacity(truth.epochs.len());
    let mut surroundings = Vec::with_capacity(truth.epochs.len());
    let mut readings = Vec::with_capacity(truth.epochs.len());
    for (second, at) in truth
        .increments
        .chunks(truth.samples_per_epoch)
        .zip(&truth.epochs)
    {
        imu.set_field(at.q_bn.inverse() * dipole_field(&at.position));
        imu.set_height(at.position.h);
        let mut sum = Increment::default();
        for increment in second {
            let (c, e) = imu.measure(increment);
            counts.push(c);
            sum.dtheta += e.dtheta;
            sum.dv += e.dv;
        }
        surroundings.push(imu.surroundings());
        readings.push(imu.readings());
        let time = second.len() as f64 * truth.dt;
        systematic.push(Increment {
            dtheta: sum.dtheta / time,
            dv: sum.dv / time,
        });
    }
    let samples = (counts, Imu::lsb(spec));
    let assumed = config.gnss.antenna_prior();
    let session = Session {
        lever_arm: assumed.lever_arm_m.into(),
        antenna_sigmas: [assumed.lever_arm_sigma_m, assumed.age_s[1]],
        standstill: (config.standstill_s / EPOCH_S) as usize,
        systematic: Some(systematic),
        surroundings: Some(surroundings),
        readings: Some(readings),
        ..Session::new(truth.dt, samples, truth.epochs.clone(), fixes.to_vec())
    };
    (session, imu)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertial::units::DEG_PER_H;
    use crate::simulator::imu::ErrorModelName;
    use nalgebra::Matrix3xX;

    /// With the magnetic error alone, the gyro errors are one matrix times the Earth's field in
    /// body axes, on any heading.
    #[test]
    fn gyros_feel_the_field_of_the_earth_as_the_vehicle_turns() {
        let preset = ImuSpec::preset("medium").unwrap();
        let mut imu = preset.error_model(ErrorModelName::Noise);
        (imu.gyro.magnetic_dphpgauss, imu.rate_hz) = (0.02, 50);
        let config = SessionConfig {
            heading: 0.3,
            ..SessionConfig::new(&imu, [10.0, 300.0], [1, 2, 3])
        };
        let (session, truth) = simulate(&config);
        let field: Vec<_> = session.surroundings.unwrap();
        let field = Matrix3xX::from_columns(&field.iter().map(|s| s.field).collect::<Vec<_>>());
        let errors: Vec<_> = session.systematic.unwrap();
        let errors = Matrix3xX::from_columns(&errors.iter().map(|e| e.dtheta).collect::<Vec<_>>());
        let square = (&field * field.transpose()).try_inverse().unwrap();
        let matrix = &errors * field.transpose() * square;
        assert!((matrix * &field - &errors).amax() < 1e-9 * errors.amax());
        let largest = matrix.amax() / DEG_PER_H;
        assert!(largest > 0.01 && largest < 0.08, "{largest}");
        for k in [0, 100, 250] {
            let ned = truth.epochs[k].q_bn * field.column(k);
            assert!((ned - dipole_field(&truth.epochs[k].position)).norm() < 1e-12);
        }
        // the drive turns, so the field ahead changes
        let ahead = field.row(0);
        assert!(
            ahead.max() - ahead.min() > 0.2,
            "{}",
            ahead.max() - ahead.min()
        );
    }
}
