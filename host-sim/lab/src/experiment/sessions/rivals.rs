//! The schemes that the device is compared with, on the same samples and fixes from the same start.
//!
//! The filters estimate with every fix and freeze when the fixes end. With a memory they begin with
//! what they have found of the unit in earlier sessions: its part of each parameter has a mean and
//! a covariance, which widens a little from one power-on to the next. Once in a while a unit has
//! stepped: a second filter begins with a belief that a step has opened, and the fixes of the
//! session tell which of the two is used.

use super::Assumed;
use super::reference::Reference;
use super::timeline::Timeline;
use host_core::inertial::ekf::{Aided, Belief, ErrorModel, InitialSigma, NAV, TurnOn};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use nalgebra::Vector3;

/// The classical filters: biases, with scale factors, with 3x3 matrices.
pub const FILTERS: [&str; 3] = ["ekf6", "ekf12", "ekf24"];

/// Share of a parameter's prior variance that is new at a power-on, and by which the unit's own
/// part has moved since the last: 0.02 of its sigma each, as measured on real units.
const TIGHT: f64 = 0.02 * 0.02;
/// The same by which a step of the unit opens it: 0.2 of its sigma, with this probability.
const STEP: f64 = 0.2 * 0.2;
const STEPS: f64 = 0.1;

/// Errors of the start that the filters assume: tilt, heading, deg; m/s; m.
const START: [f64; 4] = [0.5, 1.0, 0.1, 0.1];

/// Errors of the start that the filters assume.
pub fn start_sigma() -> InitialSigma {
    let [tilt, heading, velocity, position] = START;
    InitialSigma {
        tilt: tilt * DEG,
        heading: heading * DEG,
        velocity,
        position,
    }
}

/// The error model of one of [`FILTERS`].
fn model(filter: usize, assumed: &Assumed) -> ErrorModel {
    let prior = &assumed.walking;
    match filter {
        0 => ErrorModel::biases(prior),
        1 => ErrorModel::with_scale(prior),
        _ => ErrorModel::with_matrices(prior),
    }
}

/// What a rival knows of its unit.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    /// Belief of each of [`FILTERS`] on the unit's part of its parameters.
    pub beliefs: [Option<Belief>; 3],
    /// The last session's biases: rad/s, m/s2.
    pub last: Option<[Vector3<f64>; 2]>,
}

/// A filter at some times of a session.
#[derive(Debug, Clone)]
pub struct Pass {
    /// The filter at each of the times, then at the end of the session.
    pub at: Vec<Aided>,
    /// Logarithm of the likelihood of the fixes until then.
    pub score: Vec<f64>,
}

/// Runs a filter through a session. It has the fixes up to each of `times`, s, rising. `prior`:
/// belief on the parameters at power-on; `None`: the datasheet's.
fn pass(
    (timeline, start): (&Timeline, &NavState),
    model: ErrorModel,
    assumed: &Assumed,
    prior: Option<&Belief>,
    times: &[f64],
) -> Pass {
    let sigma = start_sigma();
    let n = model.len();
    let mut filter =
        Aided::new(*start, &sigma, model, assumed.noise).with_samples(timeline.session.samples());
    if let Some(belief) = prior {
        filter.theta = belief.mean.clone();
        filter.p.view_mut((NAV, NAV), (n, n)).copy_from(&belief.p);
    }
    let mut sum = 0.0;
    let mut out = Pass {
        at: Vec::new(),
        score: Vec::new(),
    };
    let mut times = times.iter().map(|time| timeline.step_at(*time)).peekable();
    let fixes = timeline.fixes.iter().filter(|(step, _)| *step > 0);
    let mut from = 0;
    for (step, fix) in fixes {
        while times.next_if(|until| until < step).is_some() {
            out.at.push(filter.clone());
            out.score.push(sum);
        }
        for increment in &timeline.increments[from..*step] {
            filter.step(increment, timeline.step_s);
        }
        from = *step;
        let fix = timeline.at_imu(fix, &filter.sins.nav);
        sum += filter.take(Some(&fix));
    }
    for _ in 0..=times.count() {
        out.at.push(filter.clone());
        out.score.push(sum);
    }
    out
}

/// The passes of one filter through a session: without memory, and with it.
#[derive(Debug, Clone)]
pub struct Passes {
    /// Without memory.
    pub alone: Pass,
    /// With the memory, if there is one: the likelier of two beliefs at each time.
    pub remembering: Option<Pass>,
}

/// Runs one of [`FILTERS`] through a session, and updates its memory.
pub fn passes(
    filter: usize,
    (timeline, reference): (&Timeline, &Reference),
    assumed: &Assumed,
    belief: &mut Option<Belief>,
    times: &[f64],
) -> Passes {
    let turn_on = TurnOn::of_all(TIGHT);
    let of = || model(filter, assumed);
    let at = (timeline, &reference.states[0].1);
    let unit = Belief::of_unit(&of(), turn_on);
    let first = unit.turned_on(&of(), turn_on);
    let alone = pass(at, of(), assumed, Some(&first), times);
    let duration = timeline.duration_s();
    let after = |pass: &Pass, before: &Belief| {
        let end = pass.at.last().map(Belief::of_filter);
        end.map(|end| before.powered_off(&of(), turn_on, &end, duration))
    };
    let Some(known) = belief.as_ref() else {
        *belief = after(&alone, &unit);
        return Passes {
            alone,
            remembering: None,
        };
    };
    let opened = |share: f64| known.turned_on(&of(), TurnOn::of_all(share));
    let beliefs = [opened(TIGHT), opened(STEP)];
    let each = beliefs.each_ref().map(|belief| {
        let prior = belief.turned_on(&of(), turn_on);
        pass(at, of(), assumed, Some(&prior), times)
    });
    let odds = (STEPS / (1.0 - STEPS)).ln();
    let steps = |k: usize| usize::from(each[1].score[k] + odds > each[0].score[k]);
    let count = each[0].at.len();
    let remembering = Pass {
        at: (0..count).map(|k| each[steps(k)].at[k].clone()).collect(),
        score: (0..count).map(|k| each[steps(k)].score[k]).collect(),
    };
    let stepped = steps(count - 1);
    *belief = after(&each[stepped], &beliefs[stepped]);
    Passes {
        alone,
        remembering: Some(remembering),
    }
}

/// A filter at power-on that knows the unit's part of its parameters.
pub fn at_power_on(filter: usize, assumed: &Assumed, belief: &Belief, start: &NavState) -> Aided {
    let sigma = InitialSigma {
        tilt: 0.0,
        heading: 0.0,
        velocity: 0.0,
        position: 0.0,
    };
    let mut aided = Aided::new(*start, &sigma, model(filter, assumed), assumed.noise);
    aided.theta = belief.mean.clone();
    aided
}

/// The six biases of a filter: rad/s, m/s2.
pub fn biases(filter: &Aided) -> [Vector3<f64>; 2] {
    let of = |from: usize| Vector3::from_iterator(filter.theta.rows(from, 3).iter().copied());
    [of(0), of(3)]
}

/// Least time of a standstill, s, and the speed below which the vehicle stands, m/s.
const REST_S: f64 = 2.0;
const REST_MPS: f64 = 0.1;

/// The times at which the vehicle stands, in steps, by the speed of the reference.
pub fn rests(timeline: &Timeline, reference: &Reference) -> Vec<std::ops::Range<usize>> {
    let mut out: Vec<std::ops::Range<usize>> = Vec::new();
    let mut since = None;
    let long = timeline.step_at(REST_S);
    for (step, nav) in &reference.states {
        if nav.velocity.norm() < REST_MPS {
            since.get_or_insert(*step);
        } else if let Some(from) = since.take()
            && step - from >= long
        {
            out.push(from..*step);
        }
    }
    if let Some((from, (to, _))) = since.zip(reference.states.last())
        && to - from >= long
    {
        out.push(from..*to);
    }
    out
}

/// Mean of the gyros over the first standstill, rad/s, and the step at which it ends.
pub fn rest_mean(
    timeline: &Timeline,
    rests: &[std::ops::Range<usize>],
) -> Option<(Vector3<f64>, usize)> {
    let rest = rests.first()?;
    let all = timeline.increments.get(rest.clone())?;
    let turned: Vector3<f64> = all.iter().map(|w| w.dtheta).sum();
    Some((turned / (rest.len() as f64 * timeline.step_s), rest.end))
}

/// Standard deviation of the velocity of a vehicle that stands, m/s, and the time between two of
/// these observations, s.
const ZERO_MPS: f64 = 0.03;
const EVERY_S: f64 = 0.5;

/// Navigates from a state with zero velocity as an observation wherever the vehicle stands.
pub fn with_rests(
    timeline: &Timeline,
    assumed: &Assumed,
    (from, nav): (usize, &NavState),
    biases: &[Vector3<f64>; 2],
    rests: &[std::ops::Range<usize>],
    mut note: impl FnMut(usize, &NavState),
    to: usize,
) {
    use host_core::inertial::gnss::{Fix, NOT_MEASURED};
    let sigma = start_sigma();
    let mut filter = Aided::new(*nav, &sigma, model(0, assumed), assumed.noise)
        .with_samples(timeline.session.samples());
    for (k, bias) in biases.iter().flat_map(|of| of.iter()).enumerate() {
        filter.theta[k] = *bias;
    }
    let every = timeline.step_at(EVERY_S).max(1);
    for step in from..to {
        filter.step(&timeline.increments[step], timeline.step_s);
        let at = step + 1;
        if at % every == 0 && rests.iter().any(|rest| rest.contains(&at)) {
            let mut sigmas = [NOT_MEASURED; 6];
            sigmas[3..].fill(ZERO_MPS);
            let zero = Fix::new(filter.sins.nav.position, Vector3::zeros(), sigmas);
            filter.take(Some(&zero));
        }
        note(at, &filter.sins.nav);
    }
}

/// The increments of a session less a bias, from a step on.
pub fn less(timeline: &Timeline, [gyro, accel]: &[Vector3<f64>; 2], from: usize) -> Vec<Increment> {
    let dt = timeline.step_s;
    let each = timeline.increments.iter().enumerate();
    each.map(|(k, w)| {
        let on = f64::from(u8::from(k >= from));
        Increment {
            dtheta: w.dtheta - gyro * (dt * on),
            dv: w.dv - accel * (dt * on),
        }
    })
    .collect()
}

/// The increments of a session less the errors that a filter has found.
pub fn corrected(timeline: &Timeline, filter: &Aided) -> Vec<Increment> {
    let dt = timeline.step_s;
    (timeline.increments.iter())
        .map(|w| filter.corrected(w, dt))
        .collect()
}
