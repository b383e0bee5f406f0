//! The schemes that the device is compared with, on the same samples and fixes from the same start.
//!
//! The filters estimate with every fix and freeze when the fixes end. Their memory is that of
//! [`recall`](host_estimation::learning::recall).

use super::Assumed;
use super::reference::Reference;
use super::timeline::Timeline;
use host_core::inertial::ekf::{Aided, Belief, ErrorModel, InitialSigma, NAV};
use host_core::inertial::sins::{Increment, NavState};
use host_core::inertial::units::DEG;
use host_estimation::learning::considered::considered as of_biases;
use host_estimation::learning::recall::{self, Passed, mean_rate, model};
use host_estimation::learning::teacher::Assumptions;
use nalgebra::Vector3;

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
    (timeline, increments, start): (&Timeline, &[Increment], &NavState),
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
        for increment in &increments[from..*step] {
            filter.step(increment, timeline.step_s);
        }
        from = *step;
        let fix = timeline.at_imu(*step, fix, &filter.sins.nav);
        sum += filter.take(Some(&fix));
    }
    for _ in 0..=times.count() {
        out.at.push(filter.clone());
        out.score.push(sum);
    }
    out
}

/// The state at the last fix until a time, s, of an aided navigator without sensor errors in its
/// state, and its step.
pub fn aided(
    timeline: &Timeline,
    start: &NavState,
    assumed: &Assumed,
    increments: &[Increment],
    until: f64,
) -> Option<(usize, NavState)> {
    let at = (timeline, increments, start);
    let pass = pass(at, ErrorModel::default(), assumed, None, &[until]);
    Some((timeline.last_fix(until)?, pass.at.first()?.sins.nav))
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
) -> Option<Passes> {
    let model = model(filter, &assumed.walking);
    let at = (timeline, &timeline.increments[..], &reference.states[0].1);
    let run = |prior: &Belief| Some(pass(at, model.clone(), assumed, Some(prior), times));
    let alone = recall::new(&model, run)?;
    let duration = timeline.duration_s();
    let after = |of: &Passed<Pass>| {
        let end = of.pass.at.last();
        end.map(|end| recall::after(&model, &of.before, end, duration))
    };
    let Some(known) = belief.as_ref() else {
        *belief = after(&alone);
        return Some(Passes {
            alone: alone.pass,
            remembering: None,
        });
    };
    let each = recall::knowing(&model, known, run)?;
    let of = |k: usize| &each[recall::stepped([0, 1].map(|i| each[i].pass.score[k]))];
    let count = each[0].pass.at.len();
    let remembering = Pass {
        at: (0..count).map(|k| of(k).pass.at[k].clone()).collect(),
        score: (0..count).map(|k| of(k).pass.score[k]).collect(),
    };
    *belief = after(of(count - 1));
    Some(Passes {
        alone: alone.pass,
        remembering: Some(remembering),
    })
}

/// A filter at power-on that knows the unit's part of its parameters.
pub fn at_power_on(filter: usize, assumed: &Assumed, belief: &Belief, start: &NavState) -> Aided {
    let sigma = InitialSigma {
        tilt: 0.0,
        heading: 0.0,
        velocity: 0.0,
        position: 0.0,
    };
    let mut aided = Aided::new(
        *start,
        &sigma,
        model(filter, &assumed.walking),
        assumed.noise,
    );
    aided.theta = belief.mean.clone();
    aided
}

/// Standard deviations of the biases of [`FILTERS`]' first after a session, rad/s, m/s2, where
/// scale factors, misalignments and g-sensitivity err by the datasheet.
pub fn considered(
    timeline: &Timeline,
    reference: &Reference,
    assumptions: &Assumptions,
) -> [f64; 6] {
    let session = &timeline.session;
    let sigma = start_sigma();
    let start = reference.states[0].1;
    let filter =
        |model| Aided::new(start, &sigma, model, assumptions.noise).with_samples(session.samples());
    let epochs = 0..session.epochs();
    let of = of_biases(session, &session.motion(), assumptions, filter, epochs);
    of.last().map_or([f64::INFINITY; 6], |p| {
        std::array::from_fn(|k| p[(k, k)].sqrt())
    })
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
    Some((mean_rate(all, timeline.step_s), rest.end))
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
    let mut filter = Aided::new(*nav, &sigma, model(0, &assumed.walking), assumed.noise)
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

/// The increments of a session less the errors that a filter has found.
pub fn corrected(timeline: &Timeline, filter: &Aided) -> Vec<Increment> {
    let dt = timeline.step_s;
    (timeline.increments.iter())
        .map(|w| filter.corrected(w, dt))
        .collect()
}
