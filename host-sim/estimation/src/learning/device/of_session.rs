//! The device on the sessions of the desktop: its configuration for samples that are in body axes
//! already, and the fixes of the epochs.

use super::{Device, Drive, Input, at_work};
use firmware::configuration::Configuration;
use firmware::control::Alignment;
use firmware::fix::{self, Position, WEEK_MS};
use firmware::wheels::WheelSpeed;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};

/// The configuration of a unit for the samples of a session, which are in body axes already, with
/// the session's lever arm. In mode bypass, which is that of a new unit file, a device neither
/// learns nor corrects: it is judged in mode learn.
#[must_use]
pub fn configured(of: &Configuration, session: &Session) -> Configuration {
    let mut of = of.clone().in_body_axes();
    of.receiver.lever_arm = session.lever_arm.map(|metres| metres as f32).into();
    of.receiver.heading_offset = 0.0;
    let [arm_sigma, age_sigma] = session.antenna_sigmas.map(|sigma| sigma as f32);
    if arm_sigma > 0.0 {
        of.receiver.lever_arm_sigma = arm_sigma;
    }
    if age_sigma > 0.0 {
        // the ages of the fixes are configured ones, and no more is known of them
        (of.receiver.fix_delay, of.receiver.fix_delay_sigma) = (0.0, age_sigma);
    }
    if let Some(wheels) = of.wheels.as_mut().filter(|_| session.wheels.is_some()) {
        wheels.delay = 0.0;
    }
    at_work(&of)
}

impl Device {
    /// Power on, the session with its fixes up to the end of epoch `until`, power off. Over a
    /// standstill the navigation computer reports its alignment.
    pub fn drive_session(&mut self, session: &Session, until: usize) -> Drive {
        self.configure(&configured(&self.configuration, session));
        let n = session.samples_per_epoch();
        let exact = session.antenna_sigmas[1] == 0.0;
        let fix = |(epoch, fix): (usize, &Option<Fix>)| {
            let (after, fix) = arrived(epoch as f64 * EPOCH_S, session.dt, fix.as_ref()?);
            let age = fix.age.filter(|_| exact);
            Some((after, fix::Fix { age, ..fix }))
        };
        let epochs = session.fixes.iter().enumerate().take(until + 1).skip(1);
        let fixes: Vec<_> = epochs.filter_map(fix).collect();
        let speeds = session.wheels.iter().flatten().take(until + 1).enumerate();
        let speed = |(epoch, speed): (usize, &Option<f64>)| {
            let speed = (*speed)? as f32;
            Some((epoch * n, WheelSpeed { speed, age_ms: 0 }))
        };
        let wheels: Vec<_> = speeds.skip(1).filter_map(speed).collect();
        let missing = session.outages.iter();
        let missing = missing.map(|outage| outage.epochs.start * n..outage.epochs.end * n);
        let celsius = session.readings.iter().flatten();
        let alignment = [
            (1, Alignment::Started),
            (session.standstill * n, Alignment::Finished),
        ];
        self.drive(&Input {
            samples: &session.counts,
            lsb: session.lsb,
            dt: session.dt,
            celsius: &celsius.map(|of| of.axes.mean() as f32).collect::<Vec<_>>(),
            missing: &missing.collect::<Vec<_>>(),
            fixes: &fixes,
            wheels: &wheels,
            alignment: if session.standstill > 0 {
                &alignment
            } else {
                &[]
            },
        })
    }
}

/// A fix after the first sample of `dt` seconds that is not before its validity. `used_s`: the time
/// from which its age counts, s.
#[must_use]
pub fn arrived(used_s: f64, dt: f64, fix: &Fix) -> (usize, fix::Fix) {
    let valid_s = used_s - fix.age_s;
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
