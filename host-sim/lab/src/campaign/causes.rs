//! The causes of the groups: the sizes of those of the fixes, and what the schemes assume where
//! they know the size of a cause.
//!
//! | cause | not known | known |
//! |---|---|---|
//! | of the sensors | the unit's datasheet | the datasheet with a larger bias and a faster walk |
//! | coloured, optimistic fixes | the accuracy without the cause | the true standard deviation |
//! | late fixes, lever arm | zero | the exact value |
//! | gaps | - | (a missing fix shows it) |
//! | multipath | the accuracy without the cause | the standard deviation with it, during bursts |

use super::group::{FixErrors, Group};
use firmware::configuration::{Configuration, LIMIT_SIGMAS};
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_core::simulator::gnss::{AntennaPrior, Coloured, Gaps, GnssSpec, Multipath};
use host_core::simulator::session::{Drive, Fixes};
use host_estimation::learning::teacher::Assumptions;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A receiver in a town: coloured errors of position and velocity (assumed; those of the position
/// as of a single-frequency receiver among houses).
const COLOURED: Coloured = Coloured {
    horizontal_m: 3.0,
    vertical_m: 4.5,
    velocity_mps: 0.08,
    time_s: 120.0,
    velocity_time_s: 30.0,
};
/// White noise divided by the reported accuracy.
const OPTIMISTIC: f64 = 3.0;
/// Delay of fixes from validity to arrival, s.
const LATENCY_S: f64 = 0.5;
/// From the IMU to the antenna: forward, right, down, m. From the rear of a car to its roof.
const LEVER_ARM_M: [f64; 3] = [1.5, 0.6, -1.2];
/// A tunnel or an underpass every three minutes.
const GAPS: Gaps = Gaps {
    mean_interval_s: 180.0,
    mean_length_s: 30.0,
};
/// Reflections among high buildings.
const MULTIPATH: Multipath = Multipath {
    mean_interval_s: 300.0,
    mean_length_s: 60.0,
    horizontal_m: 20.0,
    vertical_m: 30.0,
    velocity_mps: 0.3,
    in_streets: false,
};

/// The receiver of a scenario with the cause of a group.
pub(super) fn receiver(own: &GnssSpec, group: Group) -> GnssSpec {
    let mut out = *own;
    match group.fixes {
        FixErrors::AsInScenario => {}
        FixErrors::Coloured => out.coloured = COLOURED,
        FixErrors::Optimistic => {
            out.horizontal_m *= OPTIMISTIC;
            out.vertical_m *= OPTIMISTIC;
            out.velocity_mps *= OPTIMISTIC;
        }
        FixErrors::Late => out.latency_s = Some(LATENCY_S),
        FixErrors::LeverArm => out.lever_arm_m = Some(LEVER_ARM_M),
        FixErrors::Gaps => out.gaps = GAPS,
        FixErrors::Multipath => out.multipath = MULTIPATH,
    }
    match group.fixes {
        FixErrors::Late => out.assumed_antenna.age_s = [0.0; 2],
        FixErrors::LeverArm => {
            out.assumed_antenna = AntennaPrior {
                age_s: own.assumed_antenna.age_s,
                ..AntennaPrior::default()
            }
        }
        _ => {}
    }
    if group.told {
        match group.fixes {
            FixErrors::Late => out.assumed_antenna.age_s = [LATENCY_S, 0.0],
            FixErrors::LeverArm => out.assumed_antenna.lever_arm_m = LEVER_ARM_M,
            _ => {}
        }
    }
    out
}

/// The fixes of [`receiver`] on a drive, with the accuracy that the schemes of the group assume.
pub(super) fn fixes(drive: &Drive, own: &GnssSpec, group: Group) -> Fixes {
    let with = receiver(own, group);
    let mut fixes = drive.fixes(&with);
    match (group.fixes, group.told) {
        (FixErrors::Coloured | FixErrors::Optimistic, false) => {
            let sigmas = own.reported_sigmas();
            fixes
                .iter_mut()
                .flatten()
                .for_each(|fix| fix.sigmas = sigmas);
        }
        (FixErrors::Multipath, true) => {
            let m = MULTIPATH;
            let shift = [m.horizontal_m, m.horizontal_m, m.vertical_m];
            let shift = [shift, [m.velocity_mps; 3]];
            let plain = drive.fixes(own);
            for (fix, plain) in fixes.iter_mut().zip(plain) {
                let (Some(fix), Some(plain)) = (fix, plain) else {
                    continue;
                };
                if fix.position != plain.position {
                    let all = fix.sigmas.iter_mut().zip(shift.as_flattened());
                    all.for_each(|(sigma, shift)| *sigma = sigma.hypot(*shift));
                }
            }
        }
        _ => {}
    }
    fixes
}

/// Size of an error of the sensors: gyros (rad/s), accelerometers (m/s2).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Size {
    /// Root mean square over the part with fixes.
    pub bias: [f64; 2],
    /// Root mean square of its change, as a random walk over an hour.
    pub walk: [f64; 2],
}

/// Seconds at each end of the part with fixes over which an error is averaged for its change.
const END_S: usize = 120;

impl Size {
    /// The size of the additional errors of several units, given as their mean in each second, axis
    /// by axis. `aided`: the seconds with fixes.
    pub(super) fn of(units: &[&[Increment]], aided: Range<usize>) -> Self {
        let mut out = Self::default();
        let (ends, hours) = (END_S.min(aided.len() / 2), aided.len() as f64 / 3600.0);
        for triad in 0..2 {
            let (mut squares, mut changes, mut n) = (0.0, 0.0, 0.0);
            for unit in units {
                let part = &unit[aided.clone()];
                for axis in 0..3 {
                    let of = |w: &Increment| [w.dtheta, w.dv][triad][axis];
                    let mean =
                        |part: &[Increment]| part.iter().map(of).sum::<f64>() / part.len() as f64;
                    let square = part.iter().map(|w| of(w).powi(2)).sum::<f64>();
                    squares += square / part.len() as f64;
                    changes += (mean(&part[part.len() - ends..]) - mean(&part[..ends])).powi(2);
                    n += 1.0;
                }
            }
            out.bias[triad] = f64::sqrt(squares / n);
            out.walk[triad] = f64::sqrt(changes / n / hours);
        }
        out
    }
}

/// The assumptions of a datasheet, enlarged by an error of this size.
pub(super) fn enlarged(assumptions: &Assumptions, size: &Size) -> Assumptions {
    let mut out = *assumptions;
    let prior = [&mut out.prior.gyro_bias, &mut out.prior.accel_bias];
    for (triad, prior) in prior.into_iter().enumerate() {
        let walk = (out.in_run[triad] * *prior).hypot(size.walk[triad]);
        *prior = prior.hypot(size.bias[triad]);
        out.in_run[triad] = walk / *prior;
    }
    out
}

/// The device's configuration with a datasheet that is [`enlarged`] so. A limit that follows from
/// the bias follows the larger one.
pub(super) fn enlarged_configuration(of: &Configuration, size: &Size) -> Configuration {
    let mut out = of.clone();
    if *size == Size::default() {
        return out;
    }
    let correction = &mut out.correction;
    let (limit, slew) = (&mut correction.limit, &mut correction.slew);
    let triads = [
        (&mut out.gyro, &mut limit.gyro, &mut slew.gyro),
        (&mut out.accel, &mut limit.accel, &mut slew.accel),
    ];
    for (k, (triad, limit, slew)) in triads.into_iter().enumerate() {
        let [bias, walk] = [size.bias[k] as f32, size.walk[k] as f32];
        let before = triad.bias_turn_on.hypot(triad.bias_in_run);
        let whole = before.hypot(bias);
        triad.bias_in_run = triad.bias_in_run.hypot(walk).min(whole);
        let turn_on = whole * whole - triad.bias_in_run * triad.bias_in_run;
        triad.bias_turn_on = turn_on.max(0.0).sqrt().max(f32::MIN_POSITIVE);
        let usual = LIMIT_SIGMAS * before;
        if (*limit - usual).abs() <= 1e-5 * usual {
            (*limit, *slew) = (*limit * whole / before, *slew * whole / before);
        }
    }
    out
}

/// Errors of a session's sensors in each second, minus those of another session on the same drive
/// with the same seeds.
pub(super) fn beside(session: &Session, other: &Session) -> Vec<Increment> {
    let seconds = |of: &Session| of.systematic.clone().unwrap_or_default();
    let pairs = seconds(session).into_iter().zip(seconds(other));
    pairs
        .map(|(a, b)| Increment {
            dtheta: a.dtheta - b.dtheta,
            dv: a.dv - b.dv,
        })
        .collect()
}
