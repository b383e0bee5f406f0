//! The real laser-gyro recording: alignment and learning at the known site, then free-inertial
//! navigation to the end, raw and compensated.

use crate::experiment::outcome::Bench;
use crate::experiment::protocol::{self, Begins, Settings, Split};
use crate::experiment::results::{Curves, Report, Results, SCHEMA};
use crate::experiment::run::{Judged, judge, learning_curves, traces};
use firmware::sample::{Counts, Lsb};
use host_core::error::Error;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::ErrorModel;
use host_core::inertial::free_inertial::free_inertial;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_core::words::counted;
use host_estimation::learning::NONE;
use host_estimation::learning::device::Device;
use host_estimation::learning::fit::{FittedNetworks, fit};
use host_estimation::learning::teacher::{Assumptions, aligned};
use host_io::recordings::lasergyro::Recording;
use host_unit::Unit;
use host_unit::scenario::network::NetworkSpec;
use nalgebra::{UnitQuaternion, Vector3};

/// Shortest learning part, s. A third of it is alignment.
pub const LEAST_LEARN_S: u32 = 120;

/// Surveyed site of the recording (recording's documentation).
const SITE: [f64; 3] = [34.246_048, 108.909_664, 380.0];
/// Standard deviation of the vehicle's position and velocity while people and engine sway it
/// (assumed).
const SWAY: [f64; 6] = [0.05, 0.05, 0.05, 0.01, 0.01, 0.01];

/// Random walk of a bias in an hour, as a share of its prior, for the teacher on this recording
/// (assumed).
const WALK_PER_HOUR: f64 = 0.2;

/// The assumptions about the recorded unit.
#[must_use]
pub fn assumptions(unit: &Unit) -> Assumptions {
    let mut assumptions = Assumptions::of(unit);
    assumptions.prior.walk_per_hour = WALK_PER_HOUR;
    assumptions
}

/// Name of the preset of the recorded unit.
pub const UNIT: &str = "ld-a15";

/// The recording as a session at rest; the first `learn_s` seconds are the standstill.
#[must_use]
pub fn session(recording: &Recording, learn_s: u32) -> Session {
    // file axes right-forward-up, ours forward-right-down
    let turn = |x: &[i32]| [x[1], x[0], x[2].saturating_neg()];
    let counts: Vec<Counts> = recording
        .pulses
        .iter()
        .map(|w| Counts {
            dtheta: turn(&w[..3]),
            dv: turn(&w[3..]),
        })
        .collect();
    let dt = 1.0 / recording.rate_hz;
    let epochs = (counts.len() as f64 * dt / EPOCH_S) as usize;
    let position = Geodetic {
        lat: SITE[0] * DEG,
        lon: SITE[1] * DEG,
        h: SITE[2],
    };
    // the attitude is not part of the reference, and is not used
    let at_rest = NavState {
        position,
        velocity: Vector3::zeros(),
        q_bn: UnitQuaternion::identity(),
    };
    let lsb = Lsb {
        rad: recording.gyro_lsb_rad,
        mps: recording.accel_lsb_mps,
    };
    let fixes = vec![Some(Fix::new(position, Vector3::zeros(), SWAY)); epochs + 1];
    Session {
        standstill: learn_s as usize,
        ..Session::new(dt, (counts, lsb), vec![at_rest; epochs + 1], fixes)
    }
}

/// Training on a short standstill: a third of it is held back.
fn network() -> NetworkSpec {
    NetworkSpec {
        held_back: 0.33,
        ..NetworkSpec::default()
    }
}

/// The navigators that are aided over the learning part: without a model of the sensors, with six
/// biases, and without a model on the device's samples. Returns the device's results.
fn aid_all(
    session: &Session,
    settings: &Settings,
    all: &mut Judged,
) -> Result<Option<(Bench, String)>, Error> {
    let a = &settings.assumptions;
    let (until, end) = (session.standstill, session.epochs());
    let increments = session.increments();
    let plain = |increments: &[Increment]| {
        let aligned = aligned(session, &increments)?;
        let filter = aligned.aided(ErrorModel::default(), a, session, &increments, until);
        Some(free_inertial(
            session,
            &increments,
            filter.sins.nav,
            until,
            end,
        ))
    };
    let biased = || {
        let model = ErrorModel::biases(&a.walking(a.datasheet_walk()).prior);
        let filter = aligned(session, &increments)?.aided(model, a, session, &increments, until);
        let step = session.step_s();
        let frozen: Vec<Increment> = increments
            .iter()
            .map(|w| filter.corrected(w, step))
            .collect();
        Some(free_inertial(session, &frozen, filter.sins.nav, until, end))
    };
    let split = Split::forward(end, until);
    let device = protocol::judged(session, &split, settings)?;
    let own = match device.changed {
        true => Some(session.navigable(device.corrected.each())),
        false => None,
    };
    let own = own.as_deref().unwrap_or(&increments);
    let (Some(none), Some(ekf6), Some(corrected)) = (plain(&increments), biased(), plain(own))
    else {
        return Ok(None);
    };
    all.add(NONE, none);
    all.add("ekf6", ekf6);
    all.add("device", corrected);
    let limit = settings.device.configuration().correction.limit;
    let bench = Bench::of(&device, session, limit, split.learn, split.judge);
    Ok(Some((bench, device.note)))
}

/// Learns from the first `learn_s` seconds and judges on the rest. `None` when the recording gives
/// no attitude.
///
/// # Errors
/// A unit that no device accepts.
pub fn replay(recording: &Recording, learn_s: u32, unit: &Unit) -> Result<Option<Report>, Error> {
    let session = session(recording, learn_s);
    let settings = Settings {
        assumptions: assumptions(unit),
        device: Device::of_unit(unit)?,
        start_sigma: None,
        network: network(),
        begins: Begins::Own,
        promoted_only: true,
        times_s: Vec::new(),
    };
    let learnt = fit(
        &session,
        &session.increments(),
        settings.assumptions,
        &settings.network,
        learn_s as usize,
        true,
    );
    let judged = learnt.and_then(|learnt| Some((judge(&session, &learnt)?, learnt)));
    let Some((mut judged, learnt)) = judged else {
        return Ok(None);
    };
    let aided = aid_all(&session, &settings, &mut judged)?;
    let Some((bench, note)) = aided else {
        return Ok(None);
    };
    Ok(Some(report(
        recording,
        (learn_s, &unit.name),
        &session,
        &learnt,
        &judged,
        (bench, note),
    )))
}

fn report(
    recording: &Recording,
    (learn_s, unit): (u32, &str),
    session: &Session,
    learnt: &FittedNetworks,
    judged: &Judged,
    (bench, note): (Bench, String),
) -> Report {
    let notes = vec![
        learnt.verdict(),
        "`uncorrected`, `ekf6` and `device` align on the first third of that time and are aided over the rest by the known place and \
         zero velocity; `device` has the navigator of `uncorrected` behind it."
            .into(),
        note,
        format!(
            "Alignment: in the inertial frame over the first {learn_s} s, by each scheme with its own samples. It finds attitude alone; an \
             aided filter over the same time also estimates velocity and biases and leaves tilts that cancel them, so it goes on \
             differently (166 m instead of 218 m at 22 min is what others measured on this recording)."
        ),
        "The vehicle stands at a surveyed site, swayed by people and engine. At rest in one attitude a level accelerometer's bias hides \
         in the tilt and the east gyro's bias in the heading: nothing can learn them here, and a correction that guesses does bound."
            .into(),
        "The vertical channel is damped with the site's height in every scheme; the table is horizontal.".into(),
    ];
    Report {
        title: format!(
            "Real laser-gyro recording at rest: learning from the first {learn_s} s, free inertial after that"
        ),
        results: Results {
            schema: SCHEMA,
            scenario: "lasergyro".into(),
            seed: 0,
            rows: judged.rows(),
            device: Some(bench.course.clone()),
        },
        set_up: vec![
            (
                "recording".into(),
                format!(
                    "{} at {} Hz",
                    counted(recording.pulses.len(), "sample"),
                    recording.rate_hz
                ),
            ),
            ("unit".into(), unit.to_owned()),
            (
                "learning part".into(),
                format!("{learn_s} s: alignment, learning and, at its end, a held-back part"),
            ),
            ("error bound".into(), bench.bound.clone()),
            (
                "networks".into(),
                "two of 3x3x3x3, f32, one step a second".into(),
            ),
        ],
        notes,
        curves: Curves {
            track: judged.tracks(session),
            error_over_time: judged.errors(),
            learning: learning_curves(learnt),
            traces: traces(session, learnt),
        },
        bench: Some(Box::new(bench)),
    }
}
