//! The measured error of the real laser-gyro recording, added to a simulated drive. No recording
//! here has this: a laser-gyro vehicle that moves for 20 minutes, with measured sensor errors.
//!
//! **What counts as error.** An error is the measured value minus that of an ideal IMU. The vehicle
//! stood at a known position, but people and engine swayed it by up to 5 mrad. That is thousands of
//! times the angle that a drift of 0.01 deg/h makes in a minute. So the attitude of an ideal IMU is
//! not a constant: differences from a constant attitude would be sway, which does not even cancel
//! on a vehicle that turns (1 mrad of it is 1000 ug). Instead, an aided navigator gets a constant
//! position and velocity (to 5 cm and 1 cm/s) as fixes and carries the attitude by the gyros. A
//! smoother over the whole recording gives the attitude at every second. The error of a second is
//! its measured increments, minus those that belong to the smoothed states at its ends, in body
//! axes. The smoother follows within some tens of seconds. Faster errors cannot be separated into
//! gyro noise and sway and are left out; the slow part of the random walk is included. Pulses are
//! generated again by rounding the sum to the recording's counts.
//!
//! **Heading** is hardly observable at rest. But the vehicle did not turn: the slope of the
//! straight line through the smoothed heading over the half hour is taken as drift of the vertical
//! gyro (sway of 0.1 mrad at one end makes 0.01 deg/h of it).
//!
//! **What one attitude cannot show.** A constant bias of a level accelerometer is a tilt of the
//! alignment, a constant bias of the east gyro is a heading, and scale factors and misalignments
//! have no motion to act on. The error contains only the changes of the biases, and none of
//! the others. So the drive is easier than a real one with the same unit.

use crate::experiment::lasergyro::{self, session as at_rest};
use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::{Begins, Settings, Split, judge};
use host_core::error::Error;
use host_core::inertial::align;
use host_core::inertial::counts::quantise;
use host_core::inertial::earth::Local;
use host_core::inertial::ekf::smooth;
use host_core::inertial::rotation::{from_rotvec, to_euler};
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState, Sins};
use host_core::inertial::units::DEG_PER_H;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::truth::{DriveConfig, Segment, Truth, random_drive};
use host_estimation::learning::device::Device;
use host_estimation::learning::teacher::{Assumptions, Start, navigate_from};
use host_io::recordings::lasergyro::Recording;
use host_unit::Unit;
use host_unit::scenario::network::NetworkSpec;
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Duration of the alignment for the first attitude, s.
const ALIGN_S: usize = 480;
/// Assumed bias of a gyro of the recording, rad/s. Its vertical one has 0.1 deg/h.
const GYRO_BIAS: f64 = 0.15 * DEG_PER_H;

/// The recording's error, second by second (rad/s and m/s2, forward-right-down). It is one second
/// shorter than the recording. `None` when the recording gives no attitude.
#[must_use]
pub fn errors(recording: &Recording) -> Option<Vec<Increment>> {
    let session = at_rest(
        recording,
        u32::try_from(recording.pulses.len() / recording.rate_hz as usize).ok()?,
    );
    let increments = session.increments();
    let a = laser();
    let site = session.nearest_fix(0).position;
    let nav = NavState {
        position: site,
        velocity: Vector3::zeros(),
        q_bn: first_attitude(&session, &increments)?,
    };
    let start = Start {
        nav,
        sigma: a.initial_sigma(&nav, &session.nearest_fix(0).sigmas),
    };
    let nominal = navigate_from(&session, &increments, &a, &start, 0, session.epochs());
    let states: Vec<NavState> = smooth(&nominal.records).iter().map(|s| s.nav).collect();
    let turning = Vector3::new(0.0, 0.0, slope(&states));
    let n = session.samples_per_epoch();
    let error = |k: usize| {
        let mut sins = Sins::new(states[k]);
        increments[k * n..(k + 1) * n]
            .iter()
            .for_each(|w| sins.step(w, session.dt));
        let want = &states[k + 1];
        let to_body = want.q_bn.inverse();
        Increment {
            dtheta: (to_body * sins.nav.q_bn).scaled_axis() / EPOCH_S + to_body * turning,
            dv: to_body * (sins.nav.velocity - want.velocity) / EPOCH_S,
        }
    };
    Some((0..states.len().checked_sub(1)?).map(error).collect())
}

/// The preset of the recording's unit.
#[expect(clippy::expect_used, reason = "a test reads every preset")]
fn usual() -> Assumptions {
    let unit = Unit::preset(lasergyro::UNIT).expect("a preset");
    lasergyro::assumptions(&unit)
}

/// The recording's unit, with an assumed bias large enough for its vertical gyro.
fn laser() -> Assumptions {
    let mut a = usual();
    a.prior.gyro_bias = GYRO_BIAS;
    a
}

/// Attitude at the first sample: that of the alignment, carried back by the gyros.
fn first_attitude(session: &Session, increments: &[Increment]) -> Option<UnitQuaternion<f64>> {
    let site = session.nearest_fix(0).position;
    let part = increments.get(..ALIGN_S * session.samples_per_epoch())?;
    let end = align::inertial_frame(part, session.dt, session.samples(), site)?;
    let turn = part.iter().fold(UnitQuaternion::identity(), |q, w| {
        q * from_rotvec(&w.dtheta)
    });
    let earth = Local::at(site.lat, site.h).omega_ie() * ALIGN_S as f64;
    Some(from_rotvec(&earth) * end * turn.inverse())
}

/// Slope of the straight line through the headings, rad/s.
fn slope(states: &[NavState]) -> f64 {
    let heading = |s: &NavState| to_euler(&s.q_bn).2;
    let middle = 0.5 * (states.len() as f64 - 1.0);
    let (mut above, mut below) = (0.0, 0.0);
    for (k, s) in states.iter().enumerate() {
        let t = (k as f64 - middle) * EPOCH_S;
        let turned = heading(s) - heading(&states[0]);
        above += t * (turned - TAU * (turned / TAU).round()); // no jump at south
        below += t * t;
    }
    if below > 0.0 { above / below } else { 0.0 }
}

/// The simulated drive.
#[derive(Debug, Clone)]
pub struct Config {
    /// Standstill before it, s.
    pub standstill_s: f64,
    /// Whole length, standstill included, s; at most the length of the errors.
    pub length_s: f64,
    /// Heading at the start, rad.
    pub heading: f64,
    /// Factor of the road's vibration.
    pub vibration: f64,
    /// Receiver.
    pub gnss: GnssSpec,
    /// Seed of road and fixes. `None`: the vehicle is at rest throughout.
    pub drive: Option<u64>,
}

/// Adds `errors` to the perfect increments of a simulated drive from the recording's site. `None`
/// when the drive is longer than the errors.
#[must_use]
pub fn session(recording: &Recording, errors: &[Increment], config: &Config) -> Option<Session> {
    let rest = at_rest(recording, 0);
    let mut rng = ChaCha8Rng::seed_from_u64(config.drive.unwrap_or_default());
    let drive_s = config.length_s - config.standstill_s;
    let mut segments = vec![Segment::hold(config.standstill_s)];
    match config.drive {
        Some(_) => segments.extend(random_drive(drive_s, &mut rng)),
        None => segments.push(Segment::hold(drive_s)),
    }
    let drive = DriveConfig {
        segments: &segments,
        start: rest.nearest_fix(0).position,
        heading: config.heading,
        dt: rest.dt,
        vibration: config.vibration,
    };
    let truth = Truth::new(&drive, &mut rng);
    let add = |(k, increment): (usize, &Increment)| {
        let e = errors.get(k / truth.samples_per_epoch)?;
        Some(Increment {
            dtheta: increment.dtheta + e.dtheta * rest.dt,
            dv: increment.dv + e.dv * rest.dt,
        })
    };
    let increments: Vec<Increment> = truth
        .increments
        .iter()
        .enumerate()
        .map(add)
        .collect::<Option<_>>()?;
    let fixes = config.gnss.fixes(&truth.epochs, EPOCH_S, &mut rng);
    let counts = quantise(&increments, &rest.lsb).ok()?;
    Some(Session {
        standstill: (config.standstill_s / EPOCH_S) as usize,
        systematic: Some(errors.to_vec()),
        ..Session::new(rest.dt, (counts, rest.lsb), truth.epochs, fixes)
    })
}

/// Standstill, driving with fixes, and free inertial, s; together just within the recording.
const PARTS_S: [usize; 3] = [300, 220, 1320];

/// The drive on a road.
fn drive(recording: &Recording, errors: &[Increment], road: u64) -> Option<Session> {
    let [stand, fixes, free] = PARTS_S;
    let config = Config {
        standstill_s: stand as f64,
        length_s: (stand + fixes + free) as f64,
        heading: (road as f64).rem_euclid(TAU),
        vibration: 1.0,
        gnss: GnssSpec::default(),
        drive: Some(road),
    };
    session(recording, errors, &config)
}

/// One drive for each of `roads`: alignment and learning over the first 520 s, then free-inertial
/// navigation for 22 min. As on the device, the networks are used only if they are proven on the
/// held-back part.
///
/// # Errors
/// As [`judge`].
pub fn replay(
    recording: &Recording,
    roads: &[u64],
    unit: &Unit,
) -> Result<Option<Vec<Outcome>>, Error> {
    let Some(errors) = errors(recording) else {
        return Ok(None);
    };
    let [stand, fixes, free] = PARTS_S;
    let settings = Settings {
        assumptions: lasergyro::assumptions(unit),
        device: Device::of_unit(unit)?,
        start_sigma: None,
        network: NetworkSpec {
            held_back: 0.33,
            ..NetworkSpec::default()
        },
        begins: Begins::Reference,
        promoted_only: true,
        times_s: vec![300, 600, 900, 1200, 1320],
    };
    let one = |road: &u64| {
        let Some(session) = drive(recording, &errors, *road) else {
            return Ok(None);
        };
        let split = Split::forward(stand + fixes + free, stand + fixes);
        let judged = judge(&format!("hybrid, road {road}"), &session, &split, &settings)?;
        let Some(mut outcome) = judged else {
            return Ok(None);
        };
        outcome.notes.push(
            "Simulated drive with the measured error of the real laser-gyro recording; constant level biases, scale factors and \
             misalignments are not in that error."
                .to_owned(),
        );
        Ok(Some(outcome))
    };
    roads.iter().map(one).collect()
}

#[cfg(test)]
mod tests;
