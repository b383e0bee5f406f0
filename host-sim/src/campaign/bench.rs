//! The classical filters of one case, taken through its fixes once for all schemes that ask for
//! them, and side by side where they have the same structure ([`Abreast`]).

use super::laws::{self, exponentials};
use super::schemes::Case;
use crate::inertial::ekf::{Abreast, Aided, ErrorModel, Known, Noise, Prior, alike};
use crate::inertial::session::Session;
use crate::inertial::sins::Increment;
use crate::learning::aiding::fix_at;
use crate::learning::teacher::{Aligned, Assumptions, aid, aligned};
use nalgebra::Vector3;
use std::cell::{OnceCell, RefCell};
use std::rc::Rc;
use std::sync::Arc;

/// A filter at the end of the fixes, and the logarithm of the density that it gave to them.
pub(super) type Scored = (Aided, f64);

/// What decides a filter on given samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Key {
    session: *const Session,
    until: usize,
    /// A model: of the classical filter with this number the one with this index.
    model: (usize, usize),
    prior: Prior,
    noise: Noise,
}

/// Filters that have run.
#[derive(Debug, Default)]
pub struct Bench {
    solved: RefCell<Vec<(Key, Rc<Scored>)>>,
    read: OnceCell<Arc<[Known]>>,
    felt: OnceCell<Arc<[Known]>>,
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
        _ => {
            let felt = bench.felt.get_or_init(|| laws::read_and_felt(session));
            laws::by_inputs(felt, prior)
        }
    }
}

impl Bench {
    /// The keys of a filter's models. The first model of each that picks is that of `ekf6`.
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

    /// Runs the filters that have not run yet, each with its walk. `None`: no attitude.
    pub(super) fn prepare(&self, case: &Case<'_>, wanted: &[(usize, f64)]) -> Option<()> {
        let (mut keys, mut missing) = (Vec::new(), Vec::new());
        let mut start = None;
        for &(filter, walk) in wanted {
            let assumptions = case.knows.told.walking(walk);
            let models = models(self, filter, case.session, &assumptions.prior);
            let own = Self::keys(case, filter, &assumptions, models.len());
            for (key, model) in own.into_iter().zip(models) {
                if self.found(&key).is_some() || keys.contains(&key) {
                    continue;
                }
                if start.is_none() {
                    start = Some(aligned(case.session, case.increments())?);
                }
                let start = start.as_ref()?;
                keys.push(key);
                missing.push(start.filter(model, &assumptions));
            }
        }
        let Some(start) = start else {
            return Some(());
        };
        let scored = scored(&start, missing, case.session, case.increments(), case.until);
        let scored = scored.into_iter().map(Rc::new);
        self.solved
            .borrow_mut()
            .extend(keys.into_iter().zip(scored));
        Some(())
    }

    fn found(&self, key: &Key) -> Option<Rc<Scored>> {
        let solved = self.solved.borrow();
        let found = solved.iter().find(|(known, _)| known == key)?;
        Some(found.1.clone())
    }

    /// Of the models of a filter the one that gave the fixes the greatest density.
    pub(super) fn best(&self, case: &Case<'_>, filter: usize, walk: f64) -> Option<Rc<Scored>> {
        self.prepare(case, &[(filter, walk)])?;
        let assumptions = case.knows.told.walking(walk);
        let count = models(self, filter, case.session, &assumptions.prior).len();
        let keys = Self::keys(case, filter, &assumptions, count);
        let all: Option<Vec<Rc<Scored>>> = keys.iter().map(|key| self.found(key)).collect();
        all?.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// Takes filters that begin at `start` through the fixes up to the end of epoch `until`, in the
/// order given.
pub(super) fn scored(
    start: &Aligned,
    filters: Vec<Aided>,
    session: &Session,
    increments: &[Increment],
    until: usize,
) -> Vec<Scored> {
    let step = |filter: &mut Aided, k: usize| aid(filter, session, increments, k);
    let first = |mut filter: Aided| {
        let score = step(&mut filter, start.first);
        (filter, score)
    };
    let next = (start.first + 1).min(until);
    let mut all: Vec<Scored> = match start.first < until {
        true => filters.into_iter().map(first).collect(),
        false => filters.into_iter().map(|filter| (filter, -0.0)).collect(),
    };
    let simple = simple(session);
    let mut left: Vec<usize> = (0..all.len()).collect();
    while let Some(&one) = left.first() {
        let same = |other: &usize| simple && alike(&all[one].0, &all[*other].0);
        let (mut group, others): (Vec<usize>, Vec<usize>) =
            left.iter().partition(|other| *other == &one || same(other));
        left = others;
        while !group.is_empty() {
            let rest = group.split_off(group.len().min(WIDEST));
            if group.len() >= PAYS {
                abreast(&mut all, &group, session, increments, next..until);
            } else {
                for &one in &group {
                    let (filter, score) = &mut all[one];
                    (next..until).for_each(|k| *score += step(filter, k));
                }
            }
            group = rest;
        }
    }
    all
}

/// Most filters side by side. Each width is compiled once for each kind of vectors, which takes the
/// compiler a minute, and wider ones gain little.
const WIDEST: usize = 4;

/// Fewer filters than these are faster one after the other.
const PAYS: usize = 3;

/// The filters `group` of `all`, at most [`WIDEST`]. Places beyond them repeat the first one.
fn abreast(
    all: &mut [Scored],
    group: &[usize],
    session: &Session,
    increments: &[Increment],
    epochs: std::ops::Range<usize>,
) {
    let n = session.steps_per_epoch();
    let place = |l: usize| *group.get(l).unwrap_or(&group[0]);
    let done: Vec<Scored> = {
        let mut abreast = Abreast::<WIDEST>::of(|l| &all[place(l)]);
        let epoch = |k: usize| (&increments[k * n..(k + 1) * n], fix_at(session, k + 1));
        abreast.pass(epochs.map(epoch), session.step_s());
        let each = group.iter().enumerate();
        each.map(|(l, of)| abreast.filter(l, &all[*of].0)).collect()
    };
    for (of, scored) in group.iter().zip(done) {
        all[*of] = scored;
    }
}

/// Whether fixes are valid at their epochs and at the IMU, no sample is missing, and a step is a
/// piece of the filters' linearisation.
fn simple(session: &Session) -> bool {
    let late = |fix: &Option<crate::inertial::gnss::Fix>| fix.is_some_and(|fix| fix.age_s != 0.0);
    session.outages.is_empty()
        && session.lever_arm == Vector3::zeros()
        && session.step_s() >= LEAST_STEP_S
        && !session.fixes.iter().any(late)
}

/// Shorter steps are gathered by a filter alone, s.
const LEAST_STEP_S: f64 = 0.05;

#[cfg(test)]
#[path = "bench_tests.rs"]
mod tests;
