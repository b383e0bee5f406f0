//! The device in a session: the firmware's own application on its samples and fixes.

use super::timeline::Timeline;
use crate::learning::device::{Device, Drive, Input};
use firmware::configuration::Configuration;
use firmware::control::Way;
use firmware::fix::{self, Position, WEEK_MS};
use firmware::model::Nets;
use host_core::inertial::gnss::Fix;
use host_core::inertial::sins::Increment;
use serde::Serialize;

/// What a device did in a session, for the reader.
#[derive(Debug, Clone, Serialize)]
pub struct Course {
    /// The correction at the beginning and at the end: gyros, deg/s, then accelerometers, m/s2.
    pub correction: [[f64; 6]; 2],
    /// The second from which on a correction was in force to the end.
    pub in_force_since_s: Option<usize>,
    /// Its navigator was aligned and used fixes at the end.
    pub navigates: bool,
    /// Fixes used, and of these with a value that was refused.
    pub fixes: [u32; 2],
    /// Hypotheses that had proved themselves at the end.
    pub proved: Vec<&'static str>,
    /// When it stored a record, s after power-on.
    pub stored_s: Vec<f64>,
    /// What it does, or what it waits for.
    pub says: String,
}

/// The configuration of a unit for recorded samples, which are in body axes already.
#[must_use]
pub fn configuration(of: &Configuration, timeline: &Timeline) -> Configuration {
    let mut of = of.clone();
    of.mounting = Configuration::default().mounting;
    of.receiver.lever_arm = timeline
        .session
        .lever_arm
        .map(|metres| metres as f32)
        .into();
    of.receiver.heading_offset = 0.0;
    of
}

/// One power-on of the device, with the fixes of the first `fixes_s` seconds.
pub fn drive(device: &mut Device, timeline: &Timeline, fixes_s: f64) -> Drive {
    let session = &timeline.session;
    let fixes: Vec<(usize, fix::Fix)> = timeline
        .fixes
        .iter()
        .map(|(step, fix)| arrived(timeline, *step, fix))
        .filter(|(after, _)| *after as f64 * session.dt <= fixes_s)
        .collect();
    let readings = session.readings.iter().flatten();
    let celsius: Vec<f32> = readings.map(|of| of.axes.mean() as f32).collect();
    device.drive(&Input {
        samples: &session.counts,
        lsb: session.lsb,
        dt: session.dt,
        celsius: &celsius,
        missing: &[],
        fixes: &fixes,
        alignment: &[],
    })
}

/// A fix after the first sample that is not before it.
fn arrived(timeline: &Timeline, step: usize, fix: &Fix) -> (usize, fix::Fix) {
    let dt = timeline.session.dt;
    let valid_s = step as f64 * timeline.step_s - fix.age_s;
    let after = (valid_s / dt - 1e-6).ceil().max(1.0);
    let arrived_s = after * dt;
    let fix = fix::Fix {
        position: Position {
            latitude: fix.position.lat,
            longitude: fix.position.lon,
            height: fix.position.h,
        },
        velocity: fix.velocity.into(),
        sigmas: fix.sigmas.map(|sigma| sigma as f32),
        heading: None,
        time_ms: ((valid_s.max(0.0) * 1e3).round() as u64 % u64::from(WEEK_MS)) as u32,
        arrived_us: (arrived_s * 1e6).round() as u64,
        waited: 0,
        age: Some((arrived_s - valid_s) as f32),
    };
    (after as usize, fix)
}

/// The device's samples in steps of the navigators.
#[must_use]
pub fn increments(timeline: &Timeline, drive: &Drive) -> Vec<Increment> {
    timeline.session.navigable(drive.corrected.iter().copied())
}

/// Describes a drive with all fixes. `before`: the networks in use from power-on on.
#[must_use]
pub fn course(drive: &Drive, device: &Device, before: &Nets) -> Course {
    let (report, trials) = (&drive.report, &drive.trials);
    let names = firmware::learn::bank::NAMES;
    let proved: Vec<&str> = trials
        .iter()
        .flat_map(|trials| &trials.each)
        .zip(names)
        .skip(1)
        .filter(|(trial, _)| trial.proved)
        .map(|(_, name)| name)
        .collect();
    let at = |of: Option<&[[f32; 3]; 2]>| {
        let [gyro, accel] = of.copied().unwrap_or_default();
        let [a, b, c] = gyro.map(|x| f64::from(x).to_degrees());
        let [d, e, f] = accel.map(f64::from);
        [a, b, c, d, e, f]
    };
    let (next, _) = device.stored();
    let ended = trials.map(|trials| trials.ended.iter().map(|n| u32::from(*n)).max());
    let ended = ended.flatten().unwrap_or(0);
    let says = match () {
        () if !report.navigates && report.refused_alignments > 0 => format!(
            "waits for its alignment in motion: samples and fixes contradicted each other {} times, \
             residual {:.1}",
            report.refused_alignments, report.residual
        ),
        () if !report.navigates => format!(
            "waits for its alignment: its heading is known by {}",
            match report.way {
                Way::None => "nothing",
                _ => "too little",
            }
        ),
        () if proved.is_empty() => format!(
            "has proved nothing: {ended} coasts have ended at the horizon with most of them"
        ),
        () if !next.same_images(before) => format!(
            "has proved {} and stored it for the next power-on",
            proved.join(", ")
        ),
        () => format!("has proved {} and stored nothing new", proved.join(", ")),
    };
    Course {
        correction: [at(drive.correction.first()), at(drive.correction.last())],
        in_force_since_s: drive.in_force_since(),
        navigates: report.navigates,
        fixes: [report.fixes, report.refused],
        proved,
        stored_s: drive.stored_s.clone(),
        says,
    }
}
