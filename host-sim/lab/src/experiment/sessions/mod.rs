//! Several sessions of one unit, each from power-on to power-off, with what every scheme remembers
//! from one to the next.
//!
//! Every coast of every scheme starts from a state of the `reference`, which no judged scheme's
//! parameters shape, and is judged by it. Fixes are given to all schemes alike: none (`power-on`),
//! those of the first seconds (`fixes-5`, ...), or all until the last coast (`end`).
//!
//! | scheme | what it takes off the samples |
//! |---|---|
//! | `uncorrected` | nothing |
//! | `rest` | the gyros' mean over the first standstill |
//! | `last` | the biases that `ekf6` had at the end of the last session |
//! | `ekf6`, `ekf12`, `ekf24` | a filter's last estimates: biases; scale factors; matrices |
//! | the same with `-memory` | the same, after what the filter remembers of the unit |
//! | `zupt` | `rest`'s mean, and zero velocity wherever the vehicle stands |
//! | `device` | what the firmware's own application takes off |
//! | `device-first-rest` | the same with activation `first-rest` |

mod coasts;
mod device;
mod order;
mod paper;
mod reference;
mod rivals;
mod shared;
mod timeline;

pub use coasts::median;
pub use host_estimation::learning::device::Course;
pub use paper::{PaperRow, paper};
pub(in crate::experiment) use reference::{CONTRADICTS, state_at};
pub use shared::shared;
pub use timeline::Timeline;

use coasts::{Coasts, Scheme, Starts};
use device::{Samples, found, of_rests};
use firmware::configuration::{Activation, Configuration};
use host_core::error::Error;
use host_core::inertial::ekf::{Aided, Noise, Prior};
use host_core::inertial::sins::{Increment, NavState};
use host_estimation::learning::device::{Device, configured, course};
use host_estimation::learning::recall::{FILTERS, biases, less};
use host_estimation::learning::rests::Rests;
use host_estimation::learning::teacher::Assumptions;
use nalgebra::Vector3;
use order::Span;
use rayon::prelude::*;
use reference::{Reference, reference};
use rivals::{Memory, Pass, Passes};
use serde::{Deserialize, Serialize};

/// Times for which fixes are given before the coasts, s.
pub const FIXES_S: [f64; 4] = [5.0, 10.0, 20.0, 40.0];
/// The phases of a session: no fixes, those of the first seconds, and all until the last coast.
pub const PHASES: [&str; 6] = [
    "power-on", "fixes-5", "fixes-10", "fixes-20", "fixes-40", "end",
];

/// What all schemes assume of the sensors: the datasheet.
#[derive(Debug, Clone, Copy)]
pub struct Assumed {
    /// With the biases' walk by the datasheet.
    walking: Prior,
    noise: Noise,
}

impl Assumed {
    fn of(assumptions: &Assumptions) -> Self {
        Self {
            walking: assumptions.walking(assumptions.datasheet_walk()).prior,
            noise: assumptions.noise,
        }
    }
}

/// Errors of one scheme in one session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Number of the session, from 1.
    pub session: usize,
    /// Its name.
    pub name: String,
    /// The scheme.
    pub scheme: String,
    /// Which fixes it had: one of [`PHASES`].
    pub phase: String,
    /// Time without fixes, s.
    pub horizon_s: f64,
    /// Number of coasts.
    pub coasts: usize,
    /// Median of the horizontal error at the end, m.
    pub median_m: f64,
    /// Its greatest value, m.
    pub worst_m: f64,
    /// Median of the attitude error at the end, deg.
    pub attitude_deg: f64,
}

/// What a filter with a memory knows of a unit after a session.
#[derive(Debug, Clone, Serialize)]
pub struct Remembered {
    /// Mean of the six biases of the unit: gyros, deg/s, then accelerometers, m/s2.
    pub mean: [f64; 6],
    /// Their standard deviations: the larger of what the filter claims and of what it can know that
    /// does not estimate scale factors, misalignments and g-sensitivity
    /// ([`considered`](host_estimation::learning::considered)), by the best session so far.
    pub sigma: [f64; 6],
}

/// One session.
#[derive(Debug, Clone, Serialize)]
pub struct Judged {
    /// Number of the session, from 1.
    pub session: usize,
    /// Its name.
    pub name: String,
    /// Duration, s.
    pub duration_s: f64,
    /// Mean normalised innovation squared of the reference's fixes: 1 when all assumptions hold.
    pub residual: f64,
    /// What the device did with all fixes.
    pub device: Course,
    /// The rests that its detector found without a receiver.
    pub rests: Rests,
    /// What `ekf6-memory` remembers afterwards.
    pub remembered: Option<Remembered>,
    /// Notes for the reader, in sentences.
    pub notes: Vec<String>,
    /// The errors.
    #[serde(skip)]
    pub rows: Vec<Row>,
}

/// The user's choices.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The sensors.
    pub assumptions: Assumptions,
    /// The device's configuration.
    pub configuration: Configuration,
    /// Times without fixes, s, rising.
    pub horizons: Vec<f64>,
    /// No scheme has fixes.
    pub no_fixes: bool,
    /// Coasts start when the fixes end, each scheme's from the state of its own aided navigator.
    pub own_start: bool,
}

impl Plan {
    /// Where coasts start, in a sentence.
    #[must_use]
    pub fn start(&self) -> &'static str {
        match self.own_start {
            false => {
                "Every coast starts from one state, smoothed from all fixes, that no row's \
                 parameters shaped."
            }
            true => {
                "Every coast starts when the fixes end, from the state of the row's own aided \
                 navigator, without sensor errors in its state except in the filters."
            }
        }
    }
}

/// A unit over its sessions.
#[derive(Debug)]
pub struct Unit {
    plan: Plan,
    assumed: Assumed,
    device: Device,
    memory: Memory,
    /// Least standard deviations of the biases that a session allows, rad/s, m/s2.
    considered: [f64; 6],
    session: usize,
    /// The session before.
    last: Option<Span>,
}

impl Unit {
    /// A unit before its first session, or with the device that earlier ones have left.
    #[must_use]
    pub fn new(plan: Plan, device: Option<Device>) -> Self {
        Self {
            assumed: Assumed::of(&plan.assumptions),
            device: device.unwrap_or_else(|| Device::new(&plan.configuration)),
            memory: Memory::default(),
            considered: [f64::INFINITY; 6],
            session: 0,
            last: None,
            plan,
        }
    }

    /// The device as the last session has left it.
    #[must_use]
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// The next session.
    ///
    /// # Errors
    /// Samples and fixes contradict each other; the session is of another sample rate than the one
    /// before, or of an earlier time.
    pub fn next(&mut self, mut timeline: Timeline) -> Result<Judged, Error> {
        let span = Span::of(&timeline);
        if let Some(before) = &self.last {
            span.follows(before)?;
        }
        self.last = Some(span);
        self.session += 1;
        let reference =
            reference(&mut timeline).map_err(|residual| contradiction(&timeline, residual))?;
        let [offset, x, y] = reference.between;
        if offset != 0.0 {
            timeline.notes.push(format!(
                "The fixes were moved by {offset:+.2} s, and their antenna is {x:+.2} m before and \
                 {y:+.2} m right of the IMU, for all schemes: there they contradict the samples least."
            ));
        }
        let rests = found(&timeline, &reference, &self.plan.configuration);
        timeline.notes.extend(of_rests(&rests));
        if self.plan.no_fixes {
            timeline.fixes.clear();
        }
        let configuration = configured(&self.plan.configuration, &timeline.session);
        self.device.configure(&configuration);
        let before = self.device.clone();
        let ends = self.ends(&timeline, &reference);
        let times: Vec<f64> = FIXES_S
            .iter()
            .copied()
            .chain(ends.iter().copied())
            .collect();
        let ((drives, whole), passes) = rayon::join(
            || self.device_drives(&timeline, &ends),
            || self.passes(&timeline, &reference, &times),
        );
        let course = course(&whole.1, &whole.0, &before.stored().0);
        let session = Session {
            number: self.session,
            coasts: Coasts {
                timeline: &timeline,
                reference: &reference,
                assumed: &self.assumed,
                horizons: &self.plan.horizons,
            },
            passes: &passes.0,
            before: &self.memory,
            drives: &drives,
            own_start: self.plan.own_start,
            times: &times,
        };
        let rows = session.rows(self.plan.no_fixes);
        let alone = passes.0[0].alone.at.last();
        let remembers = alone.filter(|_| !self.plan.no_fixes);
        if remembers.is_some() {
            let of = rivals::considered(&timeline, &reference, &self.plan.assumptions);
            for (least, sigma) in self.considered.iter_mut().zip(of) {
                *least = least.min(sigma);
            }
        }
        let last = remembers.map(biases).or(self.memory.last);
        self.memory = Memory { last, ..passes.1 };
        self.device = whole.0;
        Ok(Judged {
            session: self.session,
            name: timeline.name.clone(),
            duration_s: timeline.duration_s(),
            residual: reference.residual,
            rests,
            device: course,
            remembered: self.remembered(),
            notes: timeline.notes,
            rows,
        })
    }

    /// Times at which the fixes end before the last coast of each horizon, rising, s.
    fn ends(&self, timeline: &Timeline, reference: &Reference) -> Vec<f64> {
        let last = reference.states.last().map_or(0, |(step, _)| *step);
        let all = last as f64 * timeline.step_s;
        let ends = self.plan.horizons.iter().rev().map(|horizon| all - horizon);
        ends.filter(|end| *end > 0.0).collect()
    }

    /// The device's drives with the fixes of each phase, and the one with all fixes, which its
    /// store is taken over from.
    fn device_drives(
        &self,
        timeline: &Timeline,
        ends: &[f64],
    ) -> (
        Vec<Samples>,
        (Device, host_estimation::learning::device::Drive),
    ) {
        let until: Vec<f64> = std::iter::once(0.0)
            .chain(FIXES_S)
            .chain(ends.iter().copied())
            .collect();
        let mut resting = self.device.configuration().clone();
        resting.correction.activation = Activation::FirstRest;
        let drive = |configuration: &Configuration, until: f64| {
            let mut device = self.device.clone();
            device.configure(configuration);
            let drive = device::drive(&mut device, timeline, until);
            (device, drive)
        };
        let own = self.device.configuration();
        let whole = drive(own, f64::INFINITY);
        let samples = |configuration: &Configuration, until: f64| {
            device::increments(timeline, &drive(configuration, until).1)
        };
        let each = until.par_iter().map(|until| Samples {
            device: samples(own, *until),
            resting: samples(&resting, *until),
        });
        (each.collect(), whole)
    }

    /// The passes of all filters, and what they remember afterwards.
    fn passes(
        &self,
        timeline: &Timeline,
        reference: &Reference,
        times: &[f64],
    ) -> (Vec<Passes>, Memory) {
        let each: Vec<_> = (0..FILTERS.len())
            .into_par_iter()
            .map(|filter| {
                let mut belief = self.memory.beliefs[filter].clone();
                let at = (timeline, reference);
                let passes = rivals::passes(filter, at, &self.assumed, &mut belief, times);
                (passes.expect("a filter runs"), belief)
            })
            .collect();
        let (passes, beliefs): (Vec<_>, Vec<_>) = each.into_iter().unzip();
        let beliefs = match self.plan.no_fixes {
            true => self.memory.beliefs.clone(),
            false => std::array::from_fn(|k| beliefs[k].clone()),
        };
        let memory = Memory {
            beliefs,
            last: self.memory.last,
        };
        (passes, memory)
    }

    fn remembered(&self) -> Option<Remembered> {
        let belief = self.memory.beliefs[0].as_ref()?;
        let shown = |k: usize, value: f64| if k < 3 { value.to_degrees() } else { value };
        Some(Remembered {
            mean: std::array::from_fn(|k| shown(k, belief.mean[k])),
            sigma: std::array::from_fn(|k| {
                shown(k, belief.p[(k, k)].sqrt().max(self.considered[k]))
            }),
        })
    }
}

/// The schemes of one session.
struct Session<'a> {
    number: usize,
    coasts: Coasts<'a>,
    passes: &'a [Passes],
    before: &'a Memory,
    /// The device's samples in each phase: without fixes, with those of the first seconds, and
    /// before each last coast.
    drives: &'a [Samples],
    own_start: bool,
    /// Times of the passes' states, s.
    times: &'a [f64],
}

impl Session<'_> {
    /// The rows of all schemes and phases.
    fn rows(&self, no_fixes: bool) -> Vec<Row> {
        let timeline = self.coasts.timeline;
        let times = std::iter::once(0.0).chain(FIXES_S);
        let fits =
            |until: &(usize, f64)| until.1 < timeline.duration_s() && (!no_fixes || until.0 == 0);
        let phases: Vec<(usize, f64)> = times.enumerate().filter(fits).collect();
        let along = phases.par_iter().flat_map(|(phase, until)| {
            let at = phase.checked_sub(1);
            self.phase(
                PHASES[*phase],
                at,
                &self.drives[*phase],
                Starts::From(*until),
            )
        });
        let mut rows: Vec<Row> = along.collect();
        rows.extend(self.end());
        rows
    }

    /// The one coast at the end, at each horizon with the fixes until it begins.
    fn end(&self) -> Vec<Row> {
        let horizons = self.coasts.horizons;
        let count = self.drives.len() - 1 - FIXES_S.len();
        let each = (0..count).into_par_iter().flat_map(|k| {
            // the ends rise as the horizons fall
            let horizon = &horizons[count - 1 - k..count - k];
            let coasts = Coasts {
                horizons: horizon,
                ..self.coasts
            };
            let at = FIXES_S.len() + k;
            Session { coasts, ..*self }.phase(
                PHASES[5],
                Some(at),
                &self.drives[1 + at],
                Starts::End,
            )
        });
        each.collect()
    }

    /// The rows of a phase; `at`: which state of the passes has its fixes, `None`: no fix.
    fn phase(&self, phase: &str, at: Option<usize>, device: &Samples, starts: Starts) -> Vec<Row> {
        let (coasts, number) = (&self.coasts, self.number);
        let timeline = coasts.timeline;
        if self.own_start && at.is_none() {
            return Vec::new(); // no scheme has a state of its own without fixes
        }
        let from = &coasts.reference.states[0].1;
        let begin = |own: &dyn Fn() -> Option<(usize, NavState)>| match self.own_start {
            true => own().map(|(step, nav)| Starts::Own(step, nav)),
            false => Some(starts),
        };
        // of a navigator without sensor errors in its state
        let plain = |increments: &[Increment]| {
            begin(&|| rivals::aided(timeline, from, coasts.assumed, increments, self.times[at?]))
        };
        let with = |scheme: &str, increments: &[Increment]| {
            let of = (number, scheme, phase);
            let rows = |starts| coasts.rows(of, &Scheme::Increments(increments), starts);
            plain(increments).map(rows).unwrap_or_default()
        };
        let mut rows = with("uncorrected", &timeline.increments);
        let rests = rivals::rests(timeline, coasts.reference);
        let rest = rivals::rest_mean(timeline, &rests);
        if let Some((mean, end)) = rest {
            let biases = [mean, Vector3::zeros()];
            let increments = less(&timeline.increments, timeline.step_s, &biases, end);
            rows.extend(with("rest", &increments));
            let rests = Scheme::Rests(biases, &rests);
            let zupt = |starts| coasts.rows((number, "zupt", phase), &rests, starts);
            rows.extend(plain(&increments).map(zupt).unwrap_or_default());
        }
        if let Some(last) = &self.before.last {
            rows.extend(with(
                "last",
                &less(&timeline.increments, timeline.step_s, last, 0),
            ));
        }
        for (k, name) in FILTERS.iter().enumerate() {
            let passes = &self.passes[k];
            let mut filtered = |name: &str, pass: Option<&Pass>, power_on: Option<Aided>| {
                let filter = match at {
                    Some(at) => pass.map(|pass| &pass.at[at]),
                    None => power_on.as_ref(),
                };
                let increments = match filter {
                    Some(filter) => rivals::corrected(timeline, filter),
                    None if name == FILTERS[k] => timeline.increments.clone(),
                    None => return,
                };
                let own = || Some((timeline.last_fix(self.times[at?])?, filter?.sins.nav));
                if let Some(starts) = begin(&own) {
                    let scheme = Scheme::Increments(&increments);
                    rows.extend(coasts.rows((number, name, phase), &scheme, starts));
                }
            };
            filtered(name, Some(&passes.alone), None);
            let known = self.before.beliefs[k].as_ref();
            let knowing = known.map(|belief| rivals::at_power_on(k, coasts.assumed, belief, from));
            let memory = format!("{name}-memory");
            filtered(&memory, passes.remembering.as_ref(), knowing);
        }
        rows.extend(with("device", &device.device));
        rows.extend(with("device-first-rest", &device.resting));
        rows
    }
}

fn contradiction(timeline: &Timeline, residual: f64) -> Error {
    Error::Option {
        option: timeline.name.clone(),
        problem: format!(
            "samples and fixes contradict each other (residual {residual:.1} where 1 is expected)"
        ),
        remedy: "check axes, units, the time offset of the fixes and the unit file".into(),
    }
}

#[cfg(test)]
mod tests;
