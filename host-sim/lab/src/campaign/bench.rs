//! The classical filters of a case. Each runs once for all schemes that use it. Filters of the same
//! structure run side by side ([`pass`]), also those of different groups of errors on the same
//! drive.

use super::laws::{self, exponentials};
use super::schemes::{Case, FILTERS};
use host_core::inertial::PLACES;
use host_core::inertial::ekf::{
    Aided, AuxiliaryData, Beside, ErrorModel, Flight, Noise, Prior, alike, flies, free_abreast,
    pass,
};
use host_core::inertial::free_inertial::FreeInertial;
use host_core::inertial::free_inertial::from_filter;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::Session;
use host_core::inertial::sins::Increment;
use host_estimation::learning::aiding::fix_at;
use host_estimation::learning::teacher::{Aligned, Assumptions, aid, aligned};
use nalgebra::Vector3;
use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::rc::Rc;
use std::sync::Arc;

/// A filter at the end of the fixes, and the logarithm of their likelihood.
pub(super) type Scored = (Aided, f64);

/// All parameters of a filter on given samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Key {
    session: *const Session,
    until: usize,
    /// Number of the classical filter, and index of its model.
    model: (usize, usize),
    prior: Prior,
    noise: Noise,
}

/// Results of the filters that have run.
#[derive(Debug, Default)]
pub struct Bench {
    solved: RefCell<Vec<(Key, Rc<Scored>)>>,
    /// Their free-inertial parts, where they were navigated side by side.
    flown: RefCell<Vec<(Key, FreeInertial)>>,
    read: OnceCell<Arc<[AuxiliaryData]>>,
    felt: OnceCell<Arc<[AuxiliaryData]>>,
}

/// The number of the filter without a model of the IMU. It has a factor of the noise instead of a
/// walk.
pub(super) const NONE: usize = FILTERS.len();

/// The assumptions of a filter with this walk.
fn assumed(assumptions: &Assumptions, filter: usize, walk: f64) -> Assumptions {
    if filter != NONE {
        return assumptions.walking(walk);
    }
    let noise = Noise {
        gyro: assumptions.noise.gyro * walk,
        accel: assumptions.noise.accel * walk,
    };
    Assumptions {
        noise,
        ..*assumptions
    }
}

/// The models that the classical filter number `filter` picks from.
fn models(bench: &Bench, filter: usize, session: &Session, prior: &Prior) -> Vec<ErrorModel> {
    match filter {
        0 => vec![ErrorModel::biases(prior)],
        1 => vec![ErrorModel::with_scale(prior)],
        2 => vec![ErrorModel::with_matrices(prior)],
        3 => vec![ErrorModel::with_ramps(prior)],
        4 => exponentials(session, prior),
        5 => laws::by_temperature(bench.read.get_or_init(|| laws::read(session)), prior),
        NONE => vec![ErrorModel::default()],
        _ => {
            let felt = bench.felt.get_or_init(|| laws::read_and_felt(session));
            laws::by_inputs(felt, prior)
        }
    }
}

impl Bench {
    /// The keys of a filter's models. The first model of a filter with several models is that of
    /// `ekf6`.
    fn keys(case: &Case<'_>, filter: usize, assumptions: &Assumptions, count: usize) -> Vec<Key> {
        let of = |index: usize| Key {
            session: std::ptr::from_ref(case.session),
            until: case.until,
            model: if count > 1 && index == 0 {
                (0, 0)
            } else {
                (filter, index)
            },
            prior: assumptions.prior,
            noise: assumptions.noise,
        };
        (0..count).map(of).collect()
    }

    /// Runs the filters of this case that have not run yet, each with its walk. `None`: no
    /// attitude.
    pub(super) fn prepare(&self, case: &Case<'_>, wanted: &[(usize, f64)]) -> Option<()> {
        prepare(&[(case, wanted)])
    }

    /// The filters that have not run yet, and their keys.
    fn missing<'a>(
        &self,
        case: &Case<'a>,
        wanted: &[(usize, f64)],
    ) -> Option<(Vec<Key>, Vec<Task<'a>>)> {
        let (mut keys, mut missing) = (Vec::new(), Vec::new());
        let mut start = None;
        for &(filter, walk) in wanted {
            let assumptions = assumed(case.knows.assumptions, filter, walk);
            let models = models(self, filter, case.session, &assumptions.prior);
            let own = Self::keys(case, filter, &assumptions, models.len());
            for (key, model) in own.into_iter().zip(models) {
                if self.found(&key).is_some() || keys.contains(&key) {
                    continue;
                }
                if start.is_none() {
                    start = Some(aligned(case.session, &case.increments())?);
                }
                let start: &Aligned = start.as_ref()?;
                keys.push(key);
                missing.push(Task {
                    filter: start.filter(model, &assumptions),
                    first: start.first,
                    until: case.until,
                    session: case.session,
                    increments: case.increments(),
                });
            }
        }
        Some((keys, missing))
    }

    fn found(&self, key: &Key) -> Option<Rc<Scored>> {
        let solved = self.solved.borrow();
        let found = solved.iter().find(|(known, _)| known == key)?;
        Some(found.1.clone())
    }

    /// The model of a filter under which the fixes had the greatest likelihood.
    pub(super) fn best(&self, case: &Case<'_>, filter: usize, walk: f64) -> Option<Rc<Scored>> {
        Some(self.winner(case, filter, walk)?.1)
    }

    /// The same with its key.
    fn winner(&self, case: &Case<'_>, filter: usize, walk: f64) -> Option<(Key, Rc<Scored>)> {
        self.prepare(case, &[(filter, walk)])?;
        let assumptions = assumed(case.knows.assumptions, filter, walk);
        let count = models(self, filter, case.session, &assumptions.prior).len();
        let keys = Self::keys(case, filter, &assumptions, count).into_iter();
        let all: Option<Vec<_>> = keys.map(|key| Some((key, self.found(&key)?))).collect();
        all?.into_iter()
            .max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))
    }

    /// Navigates the free-inertial parts of filters side by side.
    pub(super) fn fly(&self, case: &Case<'_>, wanted: &[(usize, f64)]) -> Option<()> {
        let mut winners: Vec<(Key, Rc<Scored>)> = Vec::new();
        for &(filter, walk) in wanted {
            let winner = self.winner(case, filter, walk)?;
            if winners.iter().all(|(key, _)| *key != winner.0) {
                winners.push(winner);
            }
        }
        let filters: Vec<&Aided> = winners.iter().map(|(_, scored)| &scored.0).collect();
        let flown = flown(&filters, case.session, case.increments(), case.until);
        let keys = winners.iter().map(|(key, _)| *key);
        self.flown.borrow_mut().extend(keys.zip(flown));
        Some(())
    }

    /// Drops the free-inertial parts.
    pub(super) fn land(&self) {
        self.flown.borrow_mut().clear();
    }

    /// The free-inertial part of [`Self::best`].
    pub(super) fn free(&self, case: &Case<'_>, filter: usize, walk: f64) -> Option<FreeInertial> {
        let (key, best) = self.winner(case, filter, walk)?;
        let flown = self.flown.borrow();
        let found = flown.iter().find(|(known, _)| *known == key);
        let alone = || from_filter(&best.0, case.session, case.increments(), case.until);
        Some(found.map_or_else(alone, |(_, free)| free.clone()))
    }
}

/// The free-inertial parts of filters on one session, side by side where that is possible.
pub(super) fn flown(
    filters: &[&Aided],
    session: &Session,
    increments: &[Increment],
    until: usize,
) -> Vec<FreeInertial> {
    if !filters.iter().all(|filter| flies(filter)) {
        let alone = |filter: &&Aided| from_filter(filter, session, increments, until);
        return filters.iter().map(alone).collect();
    }
    let beside = filters.chunks(PLACES).flat_map(|filters| {
        let flight = filters.iter().map(|&filter| Flight {
            filter,
            session,
            increments,
            until,
        });
        free_abreast(&flight.collect::<Vec<_>>())
    });
    beside.collect()
}

/// Runs the filters of these cases that have not run yet, each with its walk. `None`: no attitude.
pub(super) fn prepare(cases: &[(&Case<'_>, &[(usize, f64)])]) -> Option<()> {
    let (mut keys, mut tasks) = (Vec::new(), Vec::new());
    for (case, wanted) in cases {
        let (own, missing) = case.bench.missing(case, wanted)?;
        keys.push((case.bench, own));
        tasks.extend(missing);
    }
    let mut scored = scored(tasks).into_iter().map(Rc::new);
    for (bench, keys) in keys {
        let own = scored.by_ref().take(keys.len());
        let solved = keys.into_iter().zip(own);
        bench.solved.borrow_mut().extend(solved);
    }
    Some(())
}

/// A filter at the start of epoch `first`, which has to process the fixes up to the end of epoch
/// `until`.
#[derive(Debug)]
pub(super) struct Task<'a> {
    pub(super) filter: Aided,
    pub(super) first: usize,
    pub(super) until: usize,
    pub(super) session: &'a Session,
    pub(super) increments: &'a [Increment],
}

/// The common part of filters that run side by side.
struct Course<'a> {
    session: &'a Session,
    /// The epochs after the first one.
    epochs: Range<usize>,
    /// The fixes at their ends.
    fixes: Vec<Option<Fix>>,
    simple: bool,
}

impl<'a> Course<'a> {
    fn of(task: &Task<'a>) -> Self {
        let epochs = (task.first + 1).min(task.until)..task.until;
        let fix = |k: usize| fix_at(task.session, k + 1);
        Self {
            session: task.session,
            fixes: epochs.clone().map(fix).collect(),
            epochs,
            simple: simple(task.session),
        }
    }

    /// The index of a task's course in `all`, to which a new one is added.
    fn index_of(all: &mut Vec<Self>, task: &Task<'a>) -> usize {
        let epochs = (task.first + 1).min(task.until)..task.until;
        let known = |of: &Self| std::ptr::eq(of.session, task.session) && of.epochs == epochs;
        all.iter().position(known).unwrap_or_else(|| {
            all.push(Self::of(task));
            all.len() - 1
        })
    }

    /// Whether filters of both may run side by side.
    fn like(&self, other: &Self) -> bool {
        let (a, b) = (self.session, other.session);
        self.simple
            && other.simple
            && self.epochs == other.epochs
            && (a.step_s().to_bits(), a.steps_per_epoch())
                == (b.step_s().to_bits(), b.steps_per_epoch())
            && self.fixes == other.fixes
    }
}

/// Processes the fixes of all filters. The results are in the order of the tasks.
pub(super) fn scored(tasks: Vec<Task<'_>>) -> Vec<Scored> {
    let mut courses: Vec<Course<'_>> = Vec::new();
    let mut runs = Vec::with_capacity(tasks.len());
    for task in tasks {
        let course = Course::index_of(&mut courses, &task);
        let mut filter = task.filter;
        let score = match task.first < task.until {
            true => aid(&mut filter, task.session, &task.increments, task.first),
            false => -0.0,
        };
        runs.push((course, task.increments, (filter, score)));
    }
    let like: Vec<Vec<bool>> = courses
        .iter()
        .map(|a| courses.iter().map(|b| a.like(b)).collect())
        .collect();
    let mut left: Vec<usize> = (0..runs.len()).collect();
    while let Some(&one) = left.first() {
        let (of, _, filter) = &runs[one];
        let same = |other: &usize| {
            let (course, _, scored) = &runs[*other];
            like[*of][*course] && alike(&filter.0, &scored.0)
        };
        let (group, others): (Vec<usize>, Vec<usize>) =
            left.iter().partition(|other| *other == &one || same(other));
        left = others;
        for group in group.chunks(PLACES) {
            abreast(&mut runs, group, &courses);
        }
    }
    runs.into_iter().map(|(_, _, scored)| scored).collect()
}

/// A running filter: the index of its course, its increments, and itself.
type Run<'a> = (usize, &'a [Increment], Scored);

/// Smallest number of filters that run faster side by side than one after the other.
const PAYS: usize = 2;

/// Runs the filters `group` side by side: at most [`PLACES`] indices, ascending.
fn abreast(runs: &mut [Run<'_>], group: &[usize], courses: &[Course<'_>]) {
    let course = &courses[runs[group[0]].0];
    let Range { start, end } = course.epochs;
    if group.len() < PAYS {
        for &one in group {
            let (_, increments, (filter, score)) = &mut runs[one];
            (start..end).for_each(|k| *score += aid(filter, course.session, &*increments, k));
        }
        return;
    }
    let n = course.session.steps_per_epoch();
    let each = runs.iter_mut().enumerate();
    let mut beside: Vec<Beside<'_>> = each
        .filter(|(k, _)| group.contains(k))
        .map(|(_, (_, increments, filter))| Beside {
            filter,
            increments: &increments[start * n..end * n],
        })
        .collect();
    pass(&mut beside, &course.fixes, course.session.step_s());
}

/// Whether fixes are valid at their epochs and at the IMU, no sample is missing, and a step is one
/// interval of the filters' linearisation.
fn simple(session: &Session) -> bool {
    let late =
        |fix: &Option<host_core::inertial::gnss::Fix>| fix.is_some_and(|fix| fix.age_s != 0.0);
    session.outages.is_empty()
        && session.lever_arm == Vector3::zeros()
        && session.step_s() >= LEAST_STEP_S
        && !session.fixes.iter().any(late)
}

/// Shortest step that filters side by side can use, s. A filter alone joins shorter ones.
const LEAST_STEP_S: f64 = 0.05;

#[cfg(test)]
#[path = "bench_tests.rs"]
mod tests;
