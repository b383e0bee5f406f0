//! The device in a session: the firmware's own application on its samples and fixes.

use super::reference::Reference;
use super::timeline::Timeline;
use firmware::configuration::Configuration;
use firmware::fix;
use firmware::learn::Settings;
use host_core::inertial::sins::Increment;
use host_estimation::learning::device::{Device, Drive, Input, arrived};
use host_estimation::learning::rests::{Detector, Rests};

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
        wheels: &[],
        alignment: &[],
    })
}

/// The device's samples in steps of the navigators.
#[must_use]
pub fn increments(timeline: &Timeline, drive: &Drive) -> Vec<Increment> {
    timeline.session.navigable(drive.corrected.each())
}

/// Samples that the device has corrected.
pub struct Samples {
    /// As its configuration says.
    pub device: Vec<Increment>,
    /// With activation `first-rest`.
    pub resting: Vec<Increment>,
}

/// The rests that the device's detector finds in a session without a receiver.
pub fn found(timeline: &Timeline, reference: &Reference, configuration: &Configuration) -> Rests {
    let session = &timeline.session;
    let settings = Settings::of(configuration);
    let mut detector = Detector::new(&settings, session.lsb, session.dt);
    let second = (1.0 / session.dt).round().max(1.0) as usize;
    for (k, counts) in session.counts.each().enumerate() {
        detector.sample(&counts);
        if (k + 1).is_multiple_of(second) {
            let (_, nav) = reference.near(timeline.step_at((k + 1) as f64 * session.dt));
            detector.second(nav);
        }
    }
    detector.rests()
}

/// A note on them; `None`: it never stood.
pub fn of_rests(rests: &Rests) -> Option<String> {
    rests.found()?;
    Some(format!(
        "From samples alone the device found {} of the {} s in which the vehicle stood, and took \
         {} of {} s above 1 m/s for a rest.",
        rests.found_s, rests.standing_s, rests.false_s, rests.moving_s
    ))
}
