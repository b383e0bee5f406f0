//! Several filters of the same structure side by side: the numbers of all filters are in one
//! vector, so that the processor computes them at once. They differ in their samples, priors, walks
//! and noises, hence in their trajectories; fixes and time are the same for all. Nothing is
//! allocated while they run. Filters without laws of time or temperature have the same bits as
//! alone; the sums of the others are formed axis by axis, which changes their last digits.

mod covariance;
mod free;
mod parts;

use super::model::AuxiliaryData;
use super::transition::{Sums, Transition, integrate, nothing};
use super::{Aided, Inputs, NAV, Parameter, Regressor};
use crate::inertial::earth::{Local, wrapped};
use crate::inertial::gnss::Fix;
use crate::inertial::lane::{
    Lane, PLACES, V3, after, applied, at, column, divided, matrix_of, rotation, scaled, sub, times,
    zeros,
};
use crate::inertial::session::EPOCH_S;
use crate::inertial::sins::{Increment, Samples, Strapdown};
use crate::inertial::vectors::widest;
use covariance::{Covariance, MOST, Scalar, Transitions};
use fearless_simd::f64x8;
pub use free::{Flight, flies, free_abreast};
use parts::{By, Feature, ParameterFactor, parts, sources};
use std::sync::Arc;

/// A filter that has just processed a fix, and its next increments.
#[derive(Debug)]
pub struct Beside<'a> {
    /// The filter, and the logarithm of the density that it has given to all fixes so far.
    pub filter: &'a mut (Aided, f64),
    /// The increments of all epochs to come.
    pub increments: &'a [Increment],
}

/// Whether two filters may run side by side: they have the same parameters but for their priors and
/// walks, and no feature that only [`Aided`] supports.
#[must_use]
pub fn alike(a: &Aided, b: &Aided) -> bool {
    let same = |(p, q): (&Parameter, &Parameter)| {
        (p.triad, p.axis, p.regressor) == (q.triad, q.axis, q.regressor)
    };
    let mut pairs = a.model.parameters.iter().zip(&b.model.parameters);
    let equal = a.model.len() == b.model.len() && pairs.all(same);
    plain(a) && plain(b) && equal && a.interval.clock.to_bits() == b.interval.clock.to_bits()
}

fn plain(filter: &Aided) -> bool {
    let simple = |p: &Parameter| {
        p.time_s.is_infinite()
            && (p.regressor.is_slow() || matches!(p.regressor, Regressor::Input(_)))
    };
    filter.model.delay_s == 0.0
        && filter.sins.samples == Samples::One
        && filter.interval.time == 0.0
        && filter.model.parameters.iter().all(simple)
}

/// Runs at most [`PLACES`] filters that are [`alike`] through epochs of one second, each with a fix
/// at its end, valid at that time and at the IMU. It uses the widest vectors of the processor, on
/// which no bit depends. `dt`: duration of an increment, s. All have the same number of increments.
pub fn pass(beside: &mut [Beside<'_>], fixes: &[Option<Fix>], dt: f64) {
    if beside.is_empty() || fixes.is_empty() {
        return;
    }
    widest!(simd => run::<f64x8<_>>(simd, beside, fixes, dt));
}

#[inline(always)]
fn run<L: Lane>(kind: L::Kind, beside: &mut [Beside<'_>], fixes: &[Option<Fix>], dt: f64) {
    let mut abreast = Abreast::<L>::of(kind, beside);
    let mut increments = [beside[0].increments; PLACES];
    for (of, filter) in increments.iter_mut().zip(&*beside) {
        *of = filter.increments;
    }
    let steps = increments[0].len() / fixes.len();
    for (k, fix) in fixes.iter().enumerate() {
        for i in k * steps..(k + 1) * steps {
            abreast.step(&increments, i, dt);
        }
        abreast.propagate();
        if let Some(fix) = fix {
            abreast.take(fix);
        }
        abreast.begin();
    }
    for (l, beside) in beside.iter_mut().enumerate() {
        abreast.give(l, beside);
    }
}

/// Filters that have just processed a fix.
struct Abreast<L: Lane> {
    kind: L::Kind,
    parts: Vec<ParameterFactor>,
    features: Vec<Feature>,
    /// Present value of each feature.
    values: Vec<L>,
    known: [Arc<[AuxiliaryData]>; PLACES],
    nav: Strapdown<L>,
    theta: Vec<L>,
    p: Covariance<L>,
    /// Variance of the walk of each parameter in a second.
    walks: Vec<L>,
    noise: [L; 2],
    /// Logarithm of the density that each has given to all fixes.
    score: L,
    clock: f64,
    rate: V3<L>,
    /// Since the last fix: time, and integrals of the specific force, of the body axes, and of the
    /// contributions of the parameters that follow the motion.
    time: f64,
    force: Sums<L>,
    axes: [Sums<L>; 3],
    effects: Vec<Sums<L>>,
    /// The second of the slow errors, and the slow errors of gyros and accelerometers.
    second: Option<usize>,
    slow: [V3<L>; 2],
    /// `[Phi Psi]`.
    by: Transitions<L>,
}

impl<L: Lane> Abreast<L> {
    #[inline(always)]
    fn of(kind: L::Kind, beside: &[Beside<'_>]) -> Self {
        let member = |l: usize| &*beside.get(l).unwrap_or(&beside[0]).filter;
        let filter = |l: usize| &member(l).0;
        let first = filter(0);
        let n = first.model.len();
        let walk = |l: usize, k: usize| {
            let walk = filter(l).model.parameters[k].walk;
            walk * walk
        };
        let (parts, features) = parts(&first.model.parameters);
        let sources = sources(&parts);
        let zero = L::all(kind, 0.0);
        Self {
            kind,
            values: vec![zero; features.len()],
            parts,
            features,
            known: std::array::from_fn(|l| filter(l).model.known.clone()),
            nav: Strapdown::of(kind, |l| &filter(l).sins),
            theta: (0..n)
                .map(|k| L::of(kind, |l| filter(l).theta[k]))
                .collect(),
            p: Covariance::of(kind, (NAV + n, sources.len()), |l, i, j| {
                filter(l).p[(i, j)]
            }),
            walks: (0..n).map(|k| L::of(kind, |l| walk(l, k))).collect(),
            noise: [
                L::of(kind, |l| filter(l).noise.gyro),
                L::of(kind, |l| filter(l).noise.accel),
            ],
            score: L::of(kind, |l| member(l).1),
            clock: first.interval.clock,
            rate: L::gathered(kind, |l| filter(l).interval.last_rate.unwrap_or_default()),
            time: 0.0,
            force: nothing(kind),
            axes: [nothing(kind); 3],
            effects: vec![nothing(kind); n],
            second: None,
            slow: [zeros(kind); 2],
            by: Transitions {
                columns: vec![[zero; NAV]; NAV + sources.len()],
                numbers: vec![L::all(kind, 1.0); n],
                sources,
            },
        }
    }

    /// Writes the state of filter `l` back.
    fn give(&self, l: usize, to: &mut Beside<'_>) {
        let (filter, score) = &mut *to.filter;
        let previous = filter.sins.previous; // not read with [`Samples::One`]
        self.nav.give(l, &mut filter.sins, previous);
        for (to, x) in filter.theta.iter_mut().zip(&self.theta) {
            *to = x.at(l);
        }
        for j in 0..filter.p.ncols() {
            for i in 0..filter.p.nrows() {
                filter.p[(i, j)] = self.p.cell(l, i, j);
            }
        }
        filter.interval.clock = self.clock;
        filter.interval.last_rate = Some(at(&self.rate, l));
        filter.start = filter.sins.nav;
        filter.before = to.increments.last().copied();
        *score = self.score.at(l);
    }

    /// Resets the integrals since the last fix.
    #[inline(always)]
    fn begin(&mut self) {
        self.second = None;
        self.time = 0.0;
        self.force = nothing(self.kind);
        self.axes = [nothing(self.kind); 3];
        self.effects.fill(nothing(self.kind));
    }

    /// Advances by step `i`.
    #[inline(always)]
    fn step(&mut self, increments: &[&[Increment]; PLACES], i: usize, dt: f64) {
        let measured = [
            L::gathered(self.kind, |l| increments[l][i].dtheta),
            L::gathered(self.kind, |l| increments[l][i].dv),
        ];
        let [dtheta, dv] = self.corrected(measured, dt);
        self.nav.step(&dtheta, &dv, dt);
        self.time += dt;
        self.clock += dt;
        self.rate = divided(&dtheta, dt);
        let force = divided(&dv, dt);
        let q_mid = after(&self.nav.nav.q_bn, &rotation(&scaled(&dtheta, -0.5)));
        let c = matrix_of(&q_mid);
        integrate(&mut self.force, &applied(&c, &force), dt);
        for (i, sums) in self.axes.iter_mut().enumerate() {
            integrate(sums, &column(&c, i), dt);
        }
        for (sums, p) in self.effects.iter_mut().zip(&self.parts) {
            if let By::Input(axis) = p.by {
                let input = [&self.rate, &force][p.triad.index()][axis];
                integrate(sums, &times(&column(&c, p.axis), input), dt);
            }
        }
    }

    /// The increment without the estimated errors.
    #[inline(always)]
    fn corrected(&mut self, [dtheta, dv]: [V3<L>; 2], dt: f64) -> [V3<L>; 2] {
        if self.parts.is_empty() {
            return [dtheta, dv];
        }
        let second = ((self.clock + 0.5 * dt) / EPOCH_S) as usize;
        if self.second != Some(second) {
            self.second = Some(second);
            self.find_slow(second);
        }
        let mut error = self.slow;
        let input = [divided(&dtheta, dt), divided(&dv, dt)];
        for (p, t) in self.parts.iter().zip(&self.theta) {
            if let By::Input(axis) = p.by {
                error[p.triad.index()][p.axis] += *t * input[p.triad.index()][axis];
            }
        }
        [
            sub(&dtheta, &scaled(&error[0], dt)),
            sub(&dv, &scaled(&error[1], dt)),
        ]
    }

    /// Computes the features at a time, s.
    #[inline(always)]
    fn find_values(&mut self, time: f64) {
        let now = Inputs {
            time,
            ..Inputs::default()
        };
        let nothing = AuxiliaryData::default();
        let second = (time / EPOCH_S) as usize;
        for (value, feature) in self.values.iter_mut().zip(&self.features) {
            *value = match feature.timed {
                true => L::all(self.kind, feature.of.value(&now, &nothing)),
                false => L::of(self.kind, |l| {
                    let known = self.known[l].get(second).unwrap_or(&nothing);
                    feature.of.value(&now, known)
                }),
            };
        }
    }

    /// The slow part of the errors in the middle of a second.
    #[inline(always)]
    fn find_slow(&mut self, second: usize) {
        self.find_values((second as f64 + 0.5) * EPOCH_S);
        self.slow = [zeros(self.kind); 2];
        for (p, t) in self.parts.iter().zip(&self.theta) {
            if let By::Slow(feature) = p.by {
                self.slow[p.triad.index()][p.axis] += *t * self.values[feature];
            }
        }
    }

    /// Covariances over the interval.
    #[inline(always)]
    fn propagate(&mut self) {
        let t = self.time;
        let over = Transition::over(&self.nav.nav, &self.force, &self.noise, t);
        self.find_values(self.clock - 0.5 * t);
        let (navigation, sources) = self.by.columns.split_at_mut(NAV);
        navigation.copy_from_slice(&over.phi);
        for (column, source) in sources.iter_mut().zip(&self.by.sources) {
            let integrals = match source.slow {
                true => &self.axes[source.axis],
                false => &self.effects[source.parameters[0]],
            };
            *column = over.effect(source.triad, integrals, t);
        }
        for (number, p) in self.by.numbers.iter_mut().zip(&self.parts) {
            if let By::Slow(feature) = p.by {
                *number = self.values[feature];
            }
        }
        self.p.propagate(&self.by, &over.q, &self.walks, t);
    }

    /// Scalar updates by a fix, and feedback.
    #[inline(always)]
    fn take(&mut self, fix: &Fix) {
        let origin = &fix.position;
        let local = Local::at(origin.lat, origin.h);
        let [lat, lon, h] = self.nav.nav.position;
        let mut turns = lon - origin.lon;
        for l in 0..L::PLACES {
            turns.put(l, wrapped(turns.at(l)));
        }
        let dp = [
            (lat - origin.lat) * local.m_h,
            turns * local.n_h * local.cos_lat,
            L::all(self.kind, origin.h) - h,
        ];
        let mut scalars: [Scalar<L>; MOST] = [(0, L::all(self.kind, 0.0), 1.0); MOST];
        let mut count = 0;
        for (i, dp) in dp.into_iter().enumerate() {
            let dv = self.nav.nav.velocity[i] - fix.velocity[i];
            for (state, z, sigma) in [(6 + i, dp, fix.sigmas[i]), (3 + i, dv, fix.sigmas[3 + i])] {
                if sigma.is_finite() {
                    scalars[count] = (state, z, sigma);
                    count += 1;
                }
            }
        }
        if count == 0 {
            return;
        }
        self.p.update(&scalars[..count], &mut self.score);
        self.nav.nav.displace(&self.p.errors[..NAV]);
        for (t, e) in self.theta.iter_mut().zip(&self.p.errors[NAV..]) {
            *t -= *e;
        }
    }
}

#[cfg(test)]
mod tests;
