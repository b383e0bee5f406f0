//! The true drives of a unit, and what its sensor measures on them.

use super::act::Act;
use super::begin::Begin;
use super::case::Case;
use super::configured;
use super::device::Format;
use super::line;
use super::motion::Motion;
use super::names::Sensor;
use super::sensor::Fault;
use super::times::{Span, Times};
use crate::campaign::Seeds;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::{Session, to_si};
use host_core::inertial::sins::{Increment, Samples, gather};
use host_core::inertial::units::{ARCSEC, UG};
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::imu::ImuSpec;
use host_core::simulator::session::{Drive, Fixes, SessionConfig, measure};
use host_core::simulator::truth::{Segment, Truth};

/// Sample rate of all sensors here, Hz.
pub(super) const RATE_HZ: u32 = 100;
/// Samples in one step of a navigation computer, as in campaigns.
const GATHER: usize = 10;
/// Start of the drives.
const START: Geodetic = Geodetic {
    lat: 0.82,
    lon: 0.15,
    h: 400.0,
};

/// A drive of a unit: the one in which the device learns, or the next one.
pub(super) struct World {
    pub(super) truth: Truth,
    /// Fixes of the navigation computer's own receiver.
    fixes: Fixes,
    pub(super) seeds: Seeds,
    /// Durations of its parts: what happens before the standstill is a part of that.
    pub(super) times: Times,
    stands: bool,
    next: bool,
    /// How long something happens before the standstill, s.
    pub(super) begins_s: u32,
}

/// What happens before the standstill, and for how long, s.
pub(super) type Begins = Option<(Begin, u32)>;

/// The plan of a drive.
struct Plan {
    motion: Motion,
    seeds: Seeds,
    times: Times,
    begins: Begins,
    drive_s: u32,
    segments: Option<Vec<Segment>>,
}

impl Plan {
    fn config<'a>(&'a self, imu: &'a ImuSpec, gnss: &'a GnssSpec) -> SessionConfig<'a> {
        SessionConfig {
            imu,
            gnss,
            start: START,
            heading: self.seeds.heading,
            standstill_s: self.times.standstill_s.into(),
            drive_s: self.drive_s.into(),
            segments: self.segments.as_deref(),
            vibration: self.motion.vibration(),
            unit: self.seeds.unit,
            turn_on: self.seeds.turn_on,
            drive: self.seeds.drive,
        }
    }

    fn drive(&self) -> Drive {
        let imu = spec(Sensor::Perfect);
        let gnss = GnssSpec::default();
        Drive::of(&self.motion.vehicle(), &self.config(&imu, &gnss))
    }
}

impl World {
    /// The drive of run `k` in which the device learns.
    pub(super) fn learning(times: &Times, (motion, begins): (Motion, Begins), k: u32) -> Self {
        let seeds = Seeds::of(k);
        let times = with(times, begins);
        let [from, to] = Span::Ends.seconds(&times);
        Self::of(
            &Plan {
                motion,
                seeds,
                times,
                begins,
                drive_s: times.aided_s + times.free_s,
                segments: motion.segments(&times, to - from, seeds.drive),
            },
            false,
        )
    }

    /// The next drive of the same unit, with a turn-on of its own: `aided_s` seconds longer than
    /// without fixes.
    pub(super) fn next(
        times: &Times,
        (motion, begins): (Motion, Begins),
        k: u32,
        aided_s: u32,
    ) -> Self {
        Self::of(
            &Plan {
                motion: motion.next(),
                seeds: Seeds::of_earlier(k, 1),
                times: with(times, begins),
                begins,
                drive_s: aided_s + times.free_s,
                segments: None,
            },
            true,
        )
    }

    fn of(plan: &Plan, next: bool) -> Self {
        let mut drive = plan.drive();
        let begins_s = plan.begins.map_or(0, |(_, lasts_s)| lasts_s);
        if let Some((begin, _)) = plan.begins {
            let n = (begins_s * RATE_HZ) as usize;
            begin.disturb(&mut drive.truth.increments[..n], drive.truth.dt);
        }
        Self {
            fixes: drive.fixes(&GnssSpec::default()),
            truth: drive.truth,
            seeds: plan.seeds,
            times: plan.times,
            stands: plan.motion.vehicle().stands(),
            next,
            begins_s,
        }
    }

    /// The drive of an unrelated vehicle.
    pub(super) fn elsewhere(times: &Times, k: u32) -> Truth {
        let plan = Plan {
            motion: Motion::Road,
            seeds: Seeds::of_earlier(k, 7),
            times: *times,
            begins: None,
            drive_s: times.aided_s + times.free_s,
            segments: None,
        };
        plan.drive().truth
    }

    /// The samples that the sensor measures on the drive, with the faults of a case.
    pub(super) fn measured(&self, sensor: Sensor, faults: &[(Fault, Span)]) -> Session {
        let mut spec = spec(sensor);
        for (fault, _) in faults {
            fault.on_spec(&mut spec, self.next);
        }
        let gnss = GnssSpec::default();
        let config = SessionConfig {
            imu: &spec,
            gnss: &gnss,
            start: START,
            heading: self.seeds.heading,
            standstill_s: if self.stands {
                self.times.standstill_s.into()
            } else {
                0.0
            },
            drive_s: 0.0,
            segments: None,
            vibration: 1.0,
            unit: self.seeds.unit,
            turn_on: self.seeds.turn_on,
            drive: self.seeds.drive,
        };
        let mut session = measure(&config, &spec, &self.truth, &self.fixes);
        session.gather = GATHER;
        // in the next drive only permanent faults act, and those whose effect stays
        let acts = |(fault, span): &&(Fault, Span)| match span {
            Span::Before => self.begins_s > 0,
            span => !self.next || *span == Span::Always || fault.stays(),
        };
        let mut all: Option<Vec<Increment>> = None;
        for (fault, span) in faults.iter().filter(acts) {
            let of = all.get_or_insert_with(|| {
                session
                    .counts
                    .iter()
                    .map(|c| to_si(c, &session.lsb))
                    .collect()
            });
            let over = self.next && fault.stays();
            let seconds = match span {
                Span::Before => [0.0, self.begins_s.into()],
                _ if over => [0.0; 2],
                span => span.seconds(&self.times),
            };
            fault.on_samples(of, session.dt, seconds, self.seeds.unit);
        }
        if let Some(all) = all {
            session.counts = line::counts(&all, &session.lsb).into();
        }
        session
    }
}

/// The standstill is longer by what happens before it.
fn with(times: &Times, begins: Begins) -> Times {
    let before_s = begins.map_or(0, |(_, lasts_s)| lasts_s);
    Times {
        standstill_s: times.standstill_s + before_s,
        ..*times
    }
}

/// A session from this epoch of its standstill on, as a navigation computer gets it.
pub(super) fn later(session: &Session, epoch: usize) -> Session {
    let n = epoch * RATE_HZ as usize;
    let from = |fixes: &[_]| fixes.get(epoch..).unwrap_or_default().to_vec();
    Session {
        counts: session.counts[n..].to_vec().into(),
        standstill: session.standstill - epoch,
        reference: session.reference[epoch..].to_vec(),
        fixes: from(&session.fixes),
        systematic: None,
        surroundings: None,
        readings: None,
        ..session.clone()
    }
}

/// The sensor faults of a case, and when each acts.
pub(super) fn sensor_faults(case: &Case) -> Vec<(Fault, Span)> {
    let of = case.acts.iter().filter_map(|(act, span)| match act {
        Act::Sensor(fault) => Some((*fault, *span)),
        _ => None,
    });
    of.collect()
}

/// The simulated sensor, with the counts of its frames.
fn spec(sensor: Sensor) -> ImuSpec {
    let mut spec = configured::unit(sensor)
        .simulated()
        .error_model(sensor.group());
    let lsb = Format::of(true).lsb();
    spec.rate_hz = RATE_HZ;
    spec.gyro.pulse_arcsec = lsb.rad / ARCSEC;
    spec.accel.pulse_ugs = lsb.mps / UG;
    spec
}

/// The steps of a navigation computer that gets the samples of a session with these corrections,
/// rad/s and m/s2.
pub(super) fn corrected(session: &Session, correction: &[Increment]) -> Vec<Increment> {
    let samples = session.counts.iter().zip(correction);
    let of = samples.map(|(counts, by)| {
        let raw = to_si(counts, &session.lsb);
        Increment {
            dtheta: raw.dtheta + by.dtheta * session.dt,
            dv: raw.dv + by.dv * session.dt,
        }
    });
    gather(of, GATHER, Samples::default())
}
