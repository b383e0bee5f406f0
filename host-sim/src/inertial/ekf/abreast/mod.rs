//! Several filters of the same structure side by side: one number of each stands beside those of
//! the others, so that the processor computes them at once. They differ in their priors, their
//! walks and noises, hence in their trajectories; what depends on the time or on the samples alone
//! is computed once for all. Each keeps the bits that it has alone, and nothing is allocated while
//! they run.

mod covariance;
mod dynamics;
mod lane;
mod navigate;

use super::Inputs;
use super::model::Known;
use super::{Aided, NAV, Parameter, Regressor};
use crate::inertial::earth::Local;
use crate::inertial::gnss::Fix;
use crate::inertial::session::EPOCH_S;
use crate::inertial::sins::{Increment, Samples};
use covariance::{Column, Covariance, MOST, Scalar};
use dynamics::{Sums, Transition, integrate, nothing};
use lane::{Lane, V3, gathered, matrix_of, rotation, scaled, sub, times};
use navigate::Navigators;

/// `L` filters that have just taken a fix.
#[derive(Debug, Clone)]
pub struct Abreast<'a, const L: usize> {
    first: &'a Aided,
    nav: Navigators<L>,
    theta: Vec<Lane<L>>,
    p: Covariance<L>,
    /// Variance of the walk of each parameter in a second.
    walks: Vec<Lane<L>>,
    noise: [Lane<L>; 2],
    /// Logarithm of the density that each has given to all fixes.
    score: Lane<L>,
    clock: f64,
    before: Increment,
    rate: V3<L>,
    /// Since the last fix: time, and integrals of the specific force, of the body axes, and of what
    /// the parameters that follow the motion add.
    time: f64,
    force: Sums<L>,
    axes: [Sums<L>; 3],
    effects: Vec<Sums<L>>,
    /// The second of the slow errors, and these: of gyros, of accelerometers.
    second: Option<usize>,
    slow: [V3<L>; 2],
    /// Columns of `[Phi Psi]`.
    by: Vec<Column<L>>,
}

/// Whether two filters may run side by side: they have the same parameters but for their priors and
/// walks, and nothing that only [`Aided`] knows.
#[must_use]
pub fn alike(a: &Aided, b: &Aided) -> bool {
    let known = std::ptr::addr_eq(a.model.known.as_ptr(), b.model.known.as_ptr());
    let same = |(p, q): (&Parameter, &Parameter)| {
        (p.triad, p.axis, p.regressor) == (q.triad, q.axis, q.regressor)
    };
    let mut pairs = a.model.parameters.iter().zip(&b.model.parameters);
    let equal = a.model.len() == b.model.len() && pairs.all(same);
    let clocks = a.interval.clock.to_bits() == b.interval.clock.to_bits();
    plain(a)
        && plain(b)
        && (known || a.model.known.is_empty() && b.model.known.is_empty())
        && equal
        && clocks
        && a.before == b.before
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

impl<'a, const L: usize> Abreast<'a, L> {
    /// Filters that are [`alike`], each with its score so far. `of(l)` is the one of place `l`.
    pub fn of(of: impl Fn(usize) -> &'a (Aided, f64)) -> Self {
        let filter = |l: usize| &of(l).0;
        let first = filter(0);
        let n = first.model.len();
        let walk = |k: usize| {
            Lane::of(|l| {
                let walk = filter(l).model.parameters[k].walk;
                walk * walk
            })
        };
        let noise = |l: usize| filter(l).noise;
        Self {
            first,
            nav: Navigators::of(|l| &filter(l).sins),
            theta: (0..n).map(|k| Lane::of(|l| filter(l).theta[k])).collect(),
            p: Covariance::of(NAV + n, |l, i, j| filter(l).p[(i, j)]),
            walks: (0..n).map(walk).collect(),
            noise: [Lane::of(|l| noise(l).gyro), Lane::of(|l| noise(l).accel)],
            score: Lane::of(|l| of(l).1),
            clock: first.interval.clock,
            before: first.before.unwrap_or_default(),
            rate: gathered(|l| filter(l).interval.last_rate.unwrap_or_default()),
            time: 0.0,
            force: nothing(),
            axes: [nothing(); 3],
            effects: vec![nothing(); n],
            second: None,
            slow: [[Lane::ZERO; 3]; 2],
            by: vec![[Lane::ZERO; NAV]; NAV + n],
        }
    }

    /// Filter `l` alone, and its score.
    #[must_use]
    pub fn filter(&self, l: usize, from: &Aided) -> (Aided, f64) {
        let mut out = from.clone();
        self.nav.give(l, &mut out.sins, self.past(from));
        out.theta
            .iter_mut()
            .zip(&self.theta)
            .for_each(|(to, x)| *to = x.0[l]);
        for j in 0..out.p.ncols() {
            for i in 0..out.p.nrows() {
                out.p[(i, j)] = self.p.cell(l, i, j);
            }
        }
        out.interval.clock = self.clock;
        out.interval.last_rate = Some(lane::at(&self.rate, l));
        out.start = out.sins.nav;
        out.before = Some(self.before);
        (out, self.score.0[l])
    }

    /// Filters with [`Samples::One`] do not read their last increments.
    fn past(&self, from: &Aided) -> [Increment; 2] {
        from.sins.past
    }

    /// Takes all through epochs of one second, each with the fix at its end, valid there and then:
    /// with the widest vectors of the processor, which compute the same bits.
    pub fn pass<'e>(
        &mut self,
        epochs: impl Iterator<Item = (&'e [Increment], Option<Fix>)>,
        dt: f64,
    ) {
        fearless_simd::dispatch!(fearless_simd::Level::new(), _simd => {
            for (increments, fix) in epochs {
                self.epoch(increments, dt, fix.as_ref());
            }
        });
    }

    #[inline(always)]
    fn epoch(&mut self, increments: &[Increment], dt: f64, fix: Option<&Fix>) {
        for increment in increments {
            self.step(increment, dt);
        }
        self.propagate();
        if let Some(fix) = fix {
            self.take(fix);
        }
        self.second = None;
        self.time = 0.0;
        self.force = nothing();
        self.axes = [nothing(); 3];
        self.effects.fill(nothing());
    }

    #[inline(always)]
    fn step(&mut self, increment: &Increment, dt: f64) {
        let [dtheta, dv] = self.corrected(increment, dt);
        self.before = *increment;
        self.nav.step(&dtheta, &dv, dt);
        self.time += dt;
        self.clock += dt;
        self.rate = dtheta.map(|x| x / dt);
        let force = dv.map(|x| x / dt);
        let q_mid = lane::after(&self.nav.q_bn, &rotation(&scaled(&dtheta, -0.5)));
        let c = matrix_of(&q_mid);
        let f_n = c.map(|row| row[0] * force[0] + row[1] * force[1] + row[2] * force[2]);
        integrate(&mut self.force, &f_n, dt);
        for (i, sums) in self.axes.iter_mut().enumerate() {
            integrate(sums, &c.map(|row| row[i]), dt);
        }
        for (sums, p) in self.effects.iter_mut().zip(&self.first.model.parameters) {
            if let Regressor::Input(axis) = p.regressor {
                let input = [&self.rate, &force][p.triad.index()][axis];
                integrate(sums, &times(&c.map(|row| row[p.axis]), input), dt);
            }
        }
    }

    /// The increment without the estimated errors.
    #[inline(always)]
    fn corrected(&mut self, increment: &Increment, dt: f64) -> [V3<L>; 2] {
        let [dtheta, dv] = [increment.dtheta, increment.dv].map(|v| gathered(|_| v));
        let model = &self.first.model;
        if model.parameters.is_empty() {
            return [dtheta, dv];
        }
        let now = Inputs {
            rate: increment.dtheta / dt,
            force: increment.dv / dt,
            time: self.clock + 0.5 * dt,
            ..Inputs::default()
        };
        let second = (now.time / EPOCH_S) as usize;
        if self.second != Some(second) {
            self.second = Some(second);
            self.slow(second);
        }
        let mut error = self.slow;
        let known = Known::default();
        for (p, t) in model.parameters.iter().zip(&self.theta) {
            if !p.regressor.is_slow() {
                error[p.triad.index()][p.axis] += *t * p.value(&now, &known);
            }
        }
        [
            sub(&dtheta, &scaled(&error[0], dt)),
            sub(&dv, &scaled(&error[1], dt)),
        ]
    }

    /// The slow part of the errors in the middle of a second.
    fn slow(&mut self, second: usize) {
        let model = &self.first.model;
        let now = Inputs {
            time: (second as f64 + 0.5) * EPOCH_S,
            ..Inputs::default()
        };
        let known = model.known_at(now.time);
        self.slow = [[Lane::ZERO; 3]; 2];
        for (p, t) in model.parameters.iter().zip(&self.theta) {
            if p.regressor.is_slow() {
                self.slow[p.triad.index()][p.axis] += *t * p.value(&now, &known);
            }
        }
    }

    /// Covariances over the interval.
    #[inline(always)]
    fn propagate(&mut self) {
        let t = self.time;
        let over = Transition::over(&self.nav, &self.force, &self.noise, t);
        self.by[..NAV].copy_from_slice(&over.phi);
        let model = &self.first.model;
        let middle = Inputs {
            time: self.clock - 0.5 * t,
            ..Inputs::default()
        };
        let known = model.known_at(middle.time);
        let parameters = model.parameters.iter().zip(&self.effects);
        for (by, (p, effect)) in self.by[NAV..].iter_mut().zip(parameters) {
            let sums = match p.regressor.is_slow() {
                true => {
                    let value = p.value(&middle, &known);
                    self.axes[p.axis].map(|c| scaled(&c, value))
                }
                false => *effect,
            };
            *by = over.effect(p.triad, &sums, t);
        }
        let walks = &self.walks;
        self.p.propagate(&self.by, &over.q, |k| walks[k] * t);
    }

    /// Scalar updates by a fix, and feedback.
    #[inline(always)]
    fn take(&mut self, fix: &Fix) {
        let origin = &fix.position;
        let local = Local::at(origin.lat, origin.h);
        let [lat, lon, h] = self.nav.place;
        let dp = [
            (lat - origin.lat) * local.m_h,
            (lon - origin.lon).map(crate::inertial::earth::wrapped) * local.n_h * local.cos_lat,
            origin.h - h,
        ];
        let mut scalars: [Scalar<L>; MOST] = [(0, Lane::ZERO, 1.0); MOST];
        let mut count = 0;
        for (i, dp) in dp.into_iter().enumerate() {
            let dv = self.nav.velocity[i] - fix.velocity[i];
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
        self.nav.displace(&self.p.errors[..NAV]);
        for (t, e) in self.theta.iter_mut().zip(&self.p.errors[NAV..]) {
            *t -= *e;
        }
    }
}

#[cfg(test)]
mod tests;
