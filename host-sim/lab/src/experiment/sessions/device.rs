//! The device in a session: the firmware's own application on its samples and fixes.

use super::timeline::Timeline;
use firmware::fix;
use host_core::inertial::sins::Increment;
use host_estimation::learning::device::{Device, Drive, Input, arrived};

/// One power-on of the device, with the fixes of the first `fixes_s` seconds.
pub fn drive(device: &mut Device, timeline: &Timeline, fixes_s: f64) -> Drive {
    let session = &timeline.session;
    let fixes: Vec<(usize, fix::Fix)> = timeline
        .fixes
        .iter()
        .map(|(step, fix)| arrived(*step as f64 * timeline.step_s, session.dt, fix))
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

/// The device's samples in steps of the navigators.
#[must_use]
pub fn increments(timeline: &Timeline, drive: &Drive) -> Vec<Increment> {
    timeline.session.navigable(drive.corrected.each())
}
