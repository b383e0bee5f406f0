//! The device's alignment in motion on a session of the desktop: counts and fixes give the attitude
//! where it is not given and the vehicle has not stood.
//!
//! The alignment and the detection of a standstill are the firmware's, called as its learner calls
//! them.

use crate::learning::fix_learner::{arrival, firmware_fix, nav_state};
use crate::learning::teacher::Assumptions;
use firmware::align::motion::{AlignedState, Config, InMotion, Progress};
use firmware::align::{Align, Sensors};
use firmware::control::HeadingSource;
use firmware::fix::Heading;
use firmware::nav::{self, Transition};
use host_core::inertial::earth::Geodetic;
use host_core::inertial::ekf::InitialSigma;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session, Start};
use host_core::inertial::sins::Sins;
use host_unit::around::Kind;
use std::ops::Range;

/// As for the device's learner: speed by the receiver above which a vehicle moves, m/s; seconds
/// after which a standstill is accepted; the standard deviation of the velocity at rest, m/s.
const STANDS_MPS: f64 = 0.3;
const REST_S: u32 = 3;
const REST_MPS: f64 = 0.01;

/// Knowledge beside samples and fixes.
#[derive(Debug, Clone, Copy)]
pub struct VehicleKnowledge {
    /// Kind of the vehicle.
    pub vehicle: Kind,
    /// Whether the samples' first axis is the vehicle's forward axis.
    pub forward: bool,
    /// Heading at the first fix and its standard deviation, rad.
    pub heading: Option<[f64; 2]>,
}

/// An attitude that was found.
#[derive(Debug, Clone, Copy)]
pub struct Aligned {
    /// The epoch of the attitude.
    pub epoch: usize,
    /// The state there.
    pub start: Start,
    /// Source of the heading.
    pub way: HeadingSource,
    /// Mean normalised innovation squared of the last fixes; 1 when all assumptions hold.
    pub residual: f64,
    /// Number of earlier alignments that were rejected because their innovations were too large.
    pub refused: u32,
    /// Estimated biases of the gyros, rad/s.
    pub bias: [f64; 3],
    /// Their standard deviation by the datasheet, rad/s.
    pub datasheet: f64,
}

/// Finds the attitude in `epochs` of a session.
///
/// # Errors
/// The progress of an alignment that did not succeed.
pub fn align(
    session: &Session,
    epochs: &Range<usize>,
    known: VehicleKnowledge,
    assumptions: &Assumptions,
) -> Result<Aligned, Progress> {
    let config = config(session, known, assumptions);
    let mut motion = InMotion::new(config, [0.0; 6]);
    let sensors = Sensors {
        noise: [config.navigator.noise.gyro, config.navigator.noise.accel],
        bias: config.bias,
        walk: 0.0,
    };
    let mut standing = Align::new(sensors, session.lsb, session.dt);
    let mut heading = known.heading;
    let mut rested = Rested::default();
    let mut scratch = Transition::ZEROED;
    let n = session.samples_per_epoch();
    let due = |epoch: usize| {
        let fix = session.fixes.get(epoch).copied().flatten()?;
        Some((arrival(session, epoch, &fix), epoch, fix))
    };
    let mut fixes = (epochs.start + 1..=epochs.end).filter_map(due).peekable();
    let samples = epochs.start * n..epochs.end * n;
    let counts = session.counts.part(samples.clone());
    for (k, counts) in samples.zip(counts.each()) {
        motion.sample(&counts);
        standing.sample(&counts);
        let Some((_, epoch, fix)) = fixes.next_if(|(after, ..)| *after <= k + 1) else {
            continue;
        };
        let still = standing.still() >= REST_S;
        let (moves, stands) = if fix.has(3..5) {
            let fast = fix.velocity.norm() > STANDS_MPS.max(5.0 * fix.start_sigmas()[3]);
            (fast, !fast)
        } else {
            rested.by(&fix, epoch, still)
        };
        if moves {
            standing.moves();
        }
        let rest = at_rest(&fix, standing.gain_mps()).filter(|_| still && stands);
        let found = motion.fix(&firmware_fix(&fix, epoch), rest, [0.0; 2], &mut scratch);
        if let (true, Some([angle, sigma])) = (motion.has_begun(), heading) {
            motion.heading(Heading {
                angle: angle as f32,
                sigma: sigma as f32,
            });
            heading = None;
        }
        if let Some(found) = found {
            let found = aligned(
                session,
                k + 1,
                (&found, &scratch),
                motion.progress().refused,
                assumptions.prior.gyro_bias,
            );
            if found.epoch <= epochs.end {
                return Ok(found);
            }
        }
    }
    Err(motion.progress())
}

/// The attitude found after sample `after`, at the end of its epoch.
fn aligned(
    session: &Session,
    after: usize,
    (found, scratch): (&AlignedState, &Transition),
    refused: u32,
    datasheet: f64,
) -> Aligned {
    let n = session.samples_per_epoch();
    let epoch = after.div_ceil(n);
    let mut sins = Sins::new(nav_state(&found.state)).with_samples(session.samples());
    let rest = session.counts.block(after..epoch * n);
    for increment in session.navigable(rest.iter().copied()) {
        sins.step(&increment, session.step_s());
    }
    let bias: [f64; 3] = std::array::from_fn(|axis| found.applied[axis].into());
    let sigmas = AlignedState::sigmas(scratch).map(f64::from);
    let largest = |range: Range<usize>| sigmas[range].iter().copied().fold(0.0, f64::max);
    Aligned {
        epoch,
        start: Start {
            nav: sins.nav,
            sigma: InitialSigma {
                tilt: largest(0..2),
                heading: f64::from(found.heading_sigma),
                velocity: largest(3..6),
                position: largest(6..9),
            },
        },
        way: found.way,
        residual: f64::from(found.residual),
        refused,
        bias,
        datasheet,
    }
}

fn config(session: &Session, known: VehicleKnowledge, assumptions: &Assumptions) -> Config {
    let Assumptions {
        prior,
        noise,
        in_run,
        ..
    } = assumptions;
    let noise = nav::Noise {
        gyro: noise.gyro as f32,
        accel: noise.accel as f32,
    };
    let mut navigator = nav::Config::new(session.lsb, session.dt, noise);
    navigator.lever_arm = session.lever_arm.map(|metres| metres as f32).into();
    let pieces = (1..=navigator.piece_samples).rev();
    let whole = pieces.filter(|p| session.samples_per_epoch().is_multiple_of(usize::from(*p)));
    navigator.piece_samples = whole.into_iter().next().unwrap_or(1);
    let bias = [prior.gyro_bias as f32, prior.accel_bias as f32];
    let per_root_second = 1.0 / 3600.0_f64.sqrt();
    Config {
        navigator,
        bias,
        walk: [0, 1].map(|k| bias[k] * (in_run[k] * per_root_second) as f32),
        scale: [0, 1].map(|k| prior.scale[k].hypot(prior.misalignment[k]) as f32),
        forward: if known.forward {
            [1.0, 0.0, 0.0]
        } else {
            [0.0; 3]
        },
        lever_arm_sigma: session.antenna_sigmas[0] as f32,
        rolls: known.vehicle == Kind::Land,
        stands: known.vehicle != Kind::Ship,
    }
}

/// Epoch and position at which the vehicle came to rest, by a receiver without velocity.
#[derive(Debug, Default)]
struct Rested(Option<(usize, Geodetic)>);

impl Rested {
    /// Whether the positions say that the vehicle moves, and whether they say that it stands: they
    /// agree for so long that a motion would have shown.
    fn by(&mut self, fix: &Fix, epoch: usize, still: bool) -> (bool, bool) {
        let sure = 5.0 * std::f64::consts::SQRT_2 * fix.sigmas[0].max(fix.sigmas[1]);
        let Some((since, place)) = self.0.filter(|_| still) else {
            self.0 = still.then_some((epoch, fix.position));
            return (false, false);
        };
        let moved = fix.position.ned_from(&place).xy().norm() > sure;
        if moved {
            self.0 = None;
        }
        let long = STANDS_MPS * (epoch - since) as f64 * EPOCH_S > sure;
        (moved, !moved && long)
    }
}

/// Standard deviation of the velocity of a vehicle that stands, if that is better than the fix's.
fn at_rest(fix: &Fix, gain_mps: f32) -> Option<f32> {
    let sigma = REST_MPS.hypot(10.0 * f64::from(gain_mps));
    (sigma < fix.sigmas[3]).then_some(sigma as f32)
}

#[cfg(test)]
mod tests;
