//! How the navigator starts, and how it goes on across missing samples.

use super::observe::STANDS_MPS;
use super::{FixLearner, Memory};
use crate::control::Reason;
use crate::fix::Fix;
use crate::learn::prior::NAV;
use crate::learn::quantise::{Scale, divisor};
use crate::nav::vector::rotated;
use crate::nav::{self, Navigator};
use lrnn_nostd::learn::kalman::OUTPUTS;

/// Errors are linear up to a heading error of this standard deviation, rad.
const MAX_HEADING: f32 = 0.1;
/// The longest gap that is bridged with the sample before it, s.
const BRIDGE_S: f64 = 0.1;
/// Rotation (rad/s) and acceleration (m/s2) that a bridged gap may hide (assumed).
const MISSED: [f32; 2] = [0.1, 1.0];

impl FixLearner<'_> {
    /// Starts the navigator at a fix if the alignment is good enough. The vehicle stands: what the
    /// receiver does not measure of its velocity is zero.
    pub(super) fn start_at(&mut self, fix: &Fix, age: f32) -> Option<()> {
        let mut fix = *fix;
        if !fix.has(0..3) {
            return None;
        }
        let measured = fix.sigmas.iter_mut().skip(3).zip(&mut fix.velocity);
        for (sigma, velocity) in measured.filter(|(sigma, _)| !sigma.is_finite()) {
            (*sigma, *velocity) = (STANDS_MPS, 0.0);
        }
        self.start(&fix, age)
    }

    fn start(&mut self, fix: &Fix, age: f32) -> Option<()> {
        let align = self.align.as_mut()?;
        if align.gathered() < self.settings.align_s && !(align.is_over()) {
            return None;
        }
        if !align.is_solving() {
            // in parts, until the next fix
            align.solve(fix.position.latitude, fix.position.height);
            return None;
        }
        while align.sweep() {}
        let aligned = align.aligned()?;
        let bias = [
            self.settings.sheet.gyro_bias,
            self.settings.sheet.accel_bias,
        ];
        let [.., [.., heading]] = aligned.covariance(bias);
        if !(0.0..=MAX_HEADING * MAX_HEADING).contains(&heading) {
            align.restart(false); // a longer one would not do either
            return None;
        }
        let mut position = fix
            .position
            .displaced(fix.velocity.map(|v| v * f64::from(age)));
        let arm = self.antenna.arm();
        if arm != [0.0; 3] {
            // the vehicle stands: the antenna does not move
            position = position.displaced(rotated(aligned.q_bn, arm.map(|m| -f64::from(m))));
        }
        let state = nav::State {
            position,
            velocity: fix.velocity,
            q_bn: aligned.q_bn,
        };
        let mut by = [[0.0; OUTPUTS]; NAV];
        let mut rest = [[0.0; NAV]; NAV];
        for i in 0..3 {
            by[i] = aligned.by[i];
            for (entry, &value) in rest[i].iter_mut().zip(&aligned.rest[i]) {
                *entry = value;
            }
        }
        for (k, sigma) in fix.sigmas.iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            if let Some(entry) = rest.get_mut(i).and_then(|row| row.get_mut(i)) {
                *entry = sigma * sigma;
            }
        }
        self.navigate(state, &by, &rest, Some((fix, age)))
    }

    /// A navigator in this state at the end of the last sample. Its errors are `by` times the
    /// sensors' errors, plus others of covariance `rest`. `at`: the fix, and its age, that the
    /// state is from. `None`: no stream yet, or the state is outside the range of the equations.
    fn navigate(
        &mut self,
        state: nav::State,
        by: &[[f32; OUTPUTS]; NAV],
        rest: &[[f32; NAV]; NAV],
        at: Option<(&Fix, f32)>,
    ) -> Option<()> {
        let (stream, scale) = (self.stream?, self.scale?);
        let mut config = nav::Config::new(scale.lsb, stream.period_s, self.settings.noise);
        config.lever_arm = self.antenna.arm();
        config.piece_samples = divisor(stream.block_samples, config.piece_samples);
        let navigator = Navigator::new(config, state).ok()?;
        self.finish();
        let sigma = self.antenna.age_sigma();
        let seen = at.map(|(fix, age)| navigator.seen(fix, age, sigma));
        self.antenna.navigates(by, rest, seen.as_ref());
        let mut rest = *rest;
        for (k, variance) in self.antenna.unknown().into_iter().enumerate() {
            let i = if k < 3 { 6 + k } else { k };
            if let Some(entry) = rest.get_mut(i).and_then(|row| row.get_mut(i)) {
                *entry += variance;
            }
        }
        let Memory { bank, work } = &mut *self.memory;
        bank.align_means(by, &[0.0; OUTPUTS]);
        work.clear();
        work.alignment(by, &rest);
        self.navigator = Some(navigator);
        Some(())
    }

    /// Starts the navigator in a known state, instead of an alignment at standstill: for recordings
    /// that have none. `state` holds at the end of the last sample (before the first: at the
    /// stream's start); `sigmas` are the standard deviations of its errors, in the order of
    /// [`NAV`]. A navigator that was running is replaced; what has been learnt stays.
    ///
    /// To be called after [`begin`](crate::learn::Learner::begin). A stream of float samples must
    /// have begun, because their resolution follows from the first one.
    ///
    /// # Errors
    /// [`Reason::NotAvailable`] before that, [`Reason::Range`] for a state that the navigator does
    /// not accept.
    pub fn navigate_from(&mut self, state: nav::State, sigmas: &[f32; NAV]) -> Result<(), Reason> {
        let stream = self.stream.ok_or(Reason::NotAvailable)?;
        self.scale
            .get_or_insert_with(|| Scale::counts_of(stream.lsb));
        let mut rest = [[0.0; NAV]; NAV];
        for (i, (row, sigma)) in rest.iter_mut().zip(sigmas).enumerate() {
            if let Some(entry) = row.get_mut(i) {
                *entry = sigma * sigma;
            }
        }
        let by = [[0.0; OUTPUTS]; NAV];
        self.navigate(state, &by, &rest, None).ok_or(Reason::Range)
    }

    /// Samples are missing before `number`: a short gap is bridged, a long one ends the navigation.
    pub(super) fn bridge(&mut self, number: u32) {
        let Some((last, counts)) = self.last else {
            return;
        };
        let missing = number.wrapping_sub(last).wrapping_sub(1);
        if missing == 0 {
            return;
        }
        let time = f64::from(missing) * self.stream.map_or(0.0, |stream| stream.period_s);
        if let Some(align) = &mut self.align {
            align.gap();
        }
        if time > BRIDGE_S {
            return self.lose();
        }
        let Some(navigator) = &mut self.navigator else {
            return;
        };
        (0..missing).for_each(|_| navigator.sample(&counts));
        let [turn, push] = MISSED.map(|rate| rate * time as f32);
        let (turn, push) = (turn * turn, push * push);
        self.finish();
        let variance = [turn, turn, turn, push, push, push, 0.0, 0.0, 0.0];
        self.memory.bank.inflate(&variance);
        self.antenna.inflate(&variance);
    }
}
