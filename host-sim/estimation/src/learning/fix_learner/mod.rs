//! The device's learner from fixes alone, on a session of the desktop (LEARNING sections 3 and 4),
//! for studies of its parts: with chosen hypotheses, from a chosen state. It is not the device,
//! which is [`crate::learning::device`]: nothing limits, delays or stores what it learns.
//!
//! [`Device`] uses the path of the firmware: a session's integer counts go at full rate through the
//! compensator's blocks, and samples, blocks and fixes reach [`FixLearner`] by the same calls in
//! the same order as in the application. Navigation, alignment, the hypotheses and the choice among
//! them are the firmware's.
//!
//! [`learn`] processes a session up to the end of its fixes and returns the learner's knowledge
//! ([`Learnt`]). [`Learnt::free_inertial`] continues from there: the networks in force correct the
//! counts and do not learn.

mod learnt;

use crate::learning::teacher::{ALIGN_SHARE, Assumptions, Start};
use crate::learning::window::{compensator, temperature_at};
use firmware::align::LEAST_S;
use firmware::compensator::{self, Compensator};
use firmware::configuration::VehicleKind;
use firmware::control::Alignment;
use firmware::fix::{Fix, Position};
use firmware::learn::bank::Gates;
use firmware::learn::prior::{Datasheet, NAV};
use firmware::learn::{FixLearner, FixMemory, Learner, Report, Settings};
use firmware::model::Nets;
use firmware::nav::{self, Noise};
use firmware::sample::{Counts, RawSample};
use host_core::inertial::align;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::NavState;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

pub use learnt::Learnt;

/// Milliseconds in a GPS week: times of fixes wrap there.
const WEEK_MS: u64 = 604_800_000;
/// Milliseconds between fixes.
const EPOCH_MS: u64 = 1000;

/// The firmware's learner behind a compensator that changes nothing, as in mode shadow.
#[derive(Debug)]
pub struct Device<'m> {
    learner: FixLearner<'m>,
    compensator: Compensator,
    state: compensator::State,
    /// Number of the last sample, modulo 2^32; the first is 0.
    number: u32,
}

impl<'m> Device<'m> {
    /// Starts to learn. The compensator contains the scale and the rate of the stream.
    #[must_use]
    pub fn new(memory: &'m mut FixMemory, settings: Settings, compensator: Compensator) -> Self {
        Self::with_nets(&Nets::NONE, memory, settings, compensator)
    }

    /// The same as [`Self::new`] with networks to begin with.
    #[must_use]
    pub fn with_nets(
        nets: &Nets,
        memory: &'m mut FixMemory,
        settings: Settings,
        compensator: Compensator,
    ) -> Self {
        let mut learner = FixLearner::new(memory, settings);
        learner.begin(nets, compensator.scale());
        Self {
            learner,
            state: compensator.power_on(true),
            compensator,
            number: u32::MAX,
        }
    }

    /// The next sample, and the block that it completes.
    pub fn sample(&mut self, sample: &RawSample) {
        self.number = self.number.wrapping_add(1);
        self.learner.sample(self.number, sample);
        if let Some(block) = self.compensator.accumulate(&mut self.state, sample) {
            self.learner.block(self.number, &block);
        }
    }

    /// A reading of the sensor's thermometer before the next sample, degrees C.
    pub fn temperature(&mut self, celsius: f32) {
        self.state.read_temperature(celsius);
    }

    /// The next sample is missing. `first`: the sensor falls silent with it.
    pub fn miss(&mut self, first: bool) {
        self.number = self.number.wrapping_add(1);
        self.compensator.miss(&mut self.state, 1);
        if first {
            self.learner.silence();
        }
    }

    /// A fix that has arrived after the last sample.
    pub fn fix(&mut self, fix: &Fix) {
        self.learner.fix(self.number, fix);
    }

    /// The learner's report.
    #[must_use]
    pub fn report(&self) -> Report {
        self.learner.report()
    }

    /// The navigator's solution; `None` while it does not navigate.
    pub fn nav(&mut self) -> Option<NavState> {
        Some(nav_state(&self.learner.nav()?))
    }

    /// The present result of learning. `None` while it does not navigate.
    pub fn learnt(&mut self) -> Option<Learnt> {
        let nav = nav_state(&self.learner.nav_in_force()?);
        let (nets, states) = self.learner.learnt();
        let bank = self.learner.bank();
        Some(Learnt {
            nets,
            states,
            estimate: triads(bank.estimate_of(self.learner.running())),
            nav,
            running: self.learner.running(),
            evidence: std::array::from_fn(|index| bank.evidence(index)),
        })
    }
}

/// The sensors' datasheet for the learner.
#[must_use]
pub fn datasheet(assumptions: &Assumptions) -> Datasheet {
    let ekf::Prior {
        gyro_bias,
        accel_bias,
        ..
    } = assumptions.prior;
    Datasheet {
        walk_per_hour: assumptions.in_run.map(|share| share as f32),
        scale: assumptions.prior.scale.map(|ratio| ratio as f32),
        misalignment: assumptions.prior.misalignment.map(|angle| angle as f32),
        ..Datasheet::land_vehicle(gyro_bias as f32, accel_bias as f32)
    }
}

/// The device's settings: the sensors' datasheet, and fixes that arrive when they are valid, with
/// the session's standard deviations of lever arm and delay. The alignment takes a third of the
/// standstill, as that of the other schemes.
fn settings(session: &Session, assumptions: &Assumptions, gates: Gates) -> Settings {
    let share = (session.standstill as f64 * ALIGN_SHARE).floor();
    let [arm_sigma, age_sigma] = session.antenna_sigmas;
    Settings {
        inputs: assumptions.inputs,
        sheet: datasheet(assumptions),
        noise: Noise {
            gyro: assumptions.noise.gyro as f32,
            accel: assumptions.noise.accel as f32,
        },
        gates,
        align_s: share.max(LEAST_S),
        g_sensitivity: assumptions.g_sensitivity as f32,
        vehicle: VehicleKind::Land,
        forward: [1.0, 0.0, 0.0],
        fix_age_s: 0.0,
        fix_age_sigma: age_sigma as f32,
        lever_arm: session.lever_arm.map(|metres| metres as f32).into(),
        lever_arm_sigma: arm_sigma as f32,
        mounting: [1.0, 0.0, 0.0, 0.0],
        wheels: None,
    }
}

/// Learns from the fixes up to epoch `until`. With a standstill the device aligns itself at the
/// command of a navigation computer. Without one it starts from `start`. `None` if the standstill
/// gives no attitude.
#[must_use]
pub fn learn(
    session: &Session,
    assumptions: &Assumptions,
    gates: Gates,
    start: Option<&Start>,
    until: usize,
) -> Option<Learnt> {
    let mut memory = Box::new(FixMemory::ZEROED);
    let mut device = device(&mut memory, session, assumptions, gates);
    taught(&mut device, session, assumptions, start, until)
}

/// A learner for a session's stream, with blocks of one epoch.
fn device<'m>(
    memory: &'m mut FixMemory,
    session: &Session,
    assumptions: &Assumptions,
    gates: Gates,
) -> Device<'m> {
    let nets = [Nets::NONE.gyro, Nets::NONE.accel];
    let compensator = compensator(session, &nets, assumptions);
    let settings = settings(session, assumptions, gates);
    let shape = assumptions.shape.unwrap_or(Nets::NONE);
    Device::with_nets(&shape, memory, settings, compensator)
}

/// Processes the session up to epoch `until`, and returns the result of learning.
fn taught(
    device: &mut Device<'_>,
    session: &Session,
    assumptions: &Assumptions,
    start: Option<&Start>,
    until: usize,
) -> Option<Learnt> {
    if let Some(start) = start {
        begin(device, start)?;
    }
    let n = session.samples_per_epoch();
    let mut fixes = (1..=until)
        .filter_map(|epoch| due(session, epoch))
        .peekable();
    for (k, counts) in session.counts.each().enumerate().take(until * n) {
        if let Some(outage) = session.outage(k / n) {
            while fixes.next_if(|(after, _)| *after <= k + 1).is_some() {}
            device.miss(k == outage.epochs.start * n);
            if k + 1 == outage.epochs.end * n {
                begin(device, &outage.resume)?;
            }
            continue;
        }
        if let Some(celsius) = temperature_at(session, k) {
            device.temperature(celsius);
        }
        device.sample(&raw(&counts));
        if device.number == 0 && session.standstill > 0 {
            device.learner.align(Alignment::Started);
        }
        if k + 1 == session.standstill * n {
            device.learner.align(Alignment::Finished);
            if !device.report().navigates {
                begin(device, &aligned_elsewhere(session, assumptions)?)?;
            }
        }
        while let Some((_, fix)) = fixes.next_if(|(after, _)| *after <= k + 1) {
            device.fix(&fix);
        }
    }
    device.learner.end();
    device.learnt()
}

/// The fix of an epoch, and the number of samples after which it arrives.
fn due(session: &Session, epoch: usize) -> Option<(usize, Fix)> {
    let of = session.fixes.get(epoch)?.as_ref()?;
    Some((arrival(session, epoch, of), firmware_fix(of, epoch)))
}

/// The number of samples after which the fix of an epoch arrives: those until it is valid.
pub(super) fn arrival(
    session: &Session,
    epoch: usize,
    of: &host_core::inertial::gnss::Fix,
) -> usize {
    let after = (epoch as f64 * EPOCH_S - of.age_s) / session.dt;
    after.round().max(1.0) as usize
}

/// The state at the end of the standstill, for sensors that are too coarse for the device's
/// alignment.
fn aligned_elsewhere(session: &Session, assumptions: &Assumptions) -> Option<Start> {
    let first = session.standstill;
    let increments = session.increments();
    let q_bn = align::inertial_frame(
        &increments[..first * session.steps_per_epoch()],
        session.step_s(),
        session.samples(),
        session.nearest_fix(0).position,
    )?;
    let fix = session.nearest_fix(first);
    let nav = NavState {
        position: session.imu_position(&fix.position, &q_bn),
        velocity: Vector3::zeros(),
        q_bn,
    };
    let sigma = assumptions.initial_sigma(&nav, &fix.start_sigmas());
    Some(Start { nav, sigma })
}

/// Starts the navigator from a known state.
fn begin(device: &mut Device<'_>, Start { nav, sigma }: &Start) -> Option<()> {
    let (a, v, p) = (sigma.tilt, sigma.velocity, sigma.position);
    let sigmas: [f32; NAV] = [a, a, sigma.heading, v, v, v, p, p, p].map(|sigma| sigma as f32);
    let [x, y, z] = nav.q_bn.imag().into();
    let state = nav::State {
        position: position(&nav.position),
        velocity: nav.velocity.into(),
        q_bn: [nav.q_bn.w, x, y, z],
    };
    device.learner.navigate_from(state, &sigmas).ok()
}

/// A fix of an epoch in the form of the firmware.
pub(super) fn firmware_fix(of: &host_core::inertial::gnss::Fix, epoch: usize) -> Fix {
    let time_ms = epoch as u64 * EPOCH_MS;
    let time_ms = time_ms.saturating_add_signed(-(of.age_s * 1e3).round() as i64);
    Fix {
        position: position(&of.position),
        velocity: of.velocity.into(),
        sigmas: of.sigmas.map(|sigma| sigma as f32),
        heading: None,
        time_ms: (time_ms % WEEK_MS) as u32,
        arrived_us: time_ms * 1000,
        waited: 0,
        age: None,
    }
}

fn raw(counts: &Counts) -> RawSample {
    RawSample::Counts {
        gyro: counts.dtheta,
        accel: counts.dv,
    }
}

fn position(of: &Geodetic) -> Position {
    Position {
        latitude: of.lat,
        longitude: of.lon,
        height: of.h,
    }
}

pub(super) fn nav_state(of: &nav::State) -> NavState {
    let [w, x, y, z] = of.q_bn;
    NavState {
        position: Geodetic {
            lat: of.position.latitude,
            lon: of.position.longitude,
            h: of.position.height,
        },
        velocity: Vector3::from(of.velocity),
        q_bn: UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)),
    }
}

fn triads([a, b, c, d, e, f]: &[f32; 6]) -> [[f32; 3]; 2] {
    [[*a, *b, *c], [*d, *e, *f]]
}

#[cfg(test)]
mod tests;
