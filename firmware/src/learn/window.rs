//! Learning from references over windows (way B), in constant memory and in a single pass.
//!
//! A window is ten blocks without a gap. While it lasts each network's copy steps with its exact
//! gradient, and A = sum y dt and Psi = sum dy/dtheta dt are summed. The reference comes within the
//! next window and gives three scalar residuals a network,
//!
//! ```text
//! measured - true = scale (A + Psi delta) + v
//! ```
//!
//! each of which updates delta and its covariance ([`UdCovariance`]). The copy's weights move by
//! delta where a window begins and nowhere else, so no result depends on when within a window the
//! reference came.

use super::learnt_weights::{self, LEARNT};
use super::{Learner, Report, Settings};
use crate::compensator::Block;
use crate::control::{self, Reason};
use crate::inputs::{Inputs, OWN, Source};
use crate::model::Nets;
use crate::sample::{Lsb, StreamScale};
use lrnn_nostd::learn::{UdCovariance, Window};
use lrnn_nostd::{Fault, Net, Normalisation, Sensitivities, State, Weights};

/// Blocks in a window.
pub const BLOCKS: u16 = 10;

/// A residual beyond this many standard deviations is refused as an outlier.
pub const GATE: f32 = 6.0;

const PACKED: usize = LEARNT * (LEARNT - 1) / 2;

/// One network's copy and the knowledge of its weights.
#[derive(Debug)]
struct Side {
    net: Net,
    state: State,
    sensitivities: Sensitivities,
    /// Sums of the window in progress and of the one before it.
    open: Window,
    closed: Window,
    known: UdCovariance<LEARNT, PACKED>,
    /// The best weights are those of `net` plus this.
    delta: [f32; LEARNT],
    /// Move of the weights since those that `closed` was made with.
    moved: [f32; LEARNT],
    estimate: [f32; 3],
}

/// The samples of a window.
#[derive(Debug, Clone, Copy)]
struct Span {
    first: u32,
    last: u32,
    blocks: u16,
    /// Sum of the samples, in steps.
    sum: [[i64; 3]; 2],
    /// Counts in a step.
    step: f32,
}

/// A reference: what A should be, in output units times s, and its variance.
#[derive(Debug, Clone, Copy)]
struct Measured {
    sum: [[f32; 3]; 2],
    variance: [[f32; 3]; 2],
}

/// Learns both networks from the navigation computer's references.
#[derive(Debug)]
pub struct WindowLearner {
    sides: [Side; 2],
    stream: StreamScale,
    /// Inputs of the networks, once configured; not an `Option`, since that is not all zeros.
    inputs: Inputs,
    configured: bool,
    open: Span,
    closed: Option<Span>,
    taken: Option<(u32, u32)>,
    used: u32,
    doubted: u32,
}

impl Side {
    const EMPTY: Side = Side {
        net: Net::new(
            Weights::zero(),
            Normalisation {
                input_offset: [0.0; 3],
                input_scale: [0.0; 3],
                output_scale: [0.0; 3],
            },
        ),
        state: State::new(),
        sensitivities: Sensitivities::new(),
        open: Window::new(),
        closed: Window::new(),
        known: UdCovariance::zero(),
        delta: [0.0; LEARNT],
        moved: [0.0; LEARNT],
        estimate: [0.0; 3],
    };

    fn begin(&mut self, net: &Net) {
        self.net = *net;
        let sigma = learnt_weights::sigma(&net.weights).to_array();
        self.known.set(&learnt_weights::pick(&sigma));
        self.delta = [0.0; LEARNT];
        self.moved = [0.0; LEARNT];
    }

    fn restart(&mut self) {
        self.state.reset();
        self.sensitivities.reset();
        self.estimate = [0.0; 3];
    }

    /// One step. False: it failed, and the window must not be used.
    fn step(&mut self, input: [f32; 3], dt: f32) -> bool {
        let step = self
            .net
            .step_gradient(&mut self.state, &mut self.sensitivities, input);
        self.open.add(&step.output, &self.sensitivities, dt);
        self.estimate = step.error;
        if step.fault == Some(Fault::Overflow) {
            self.sensitivities.reset();
        }
        step.fault.is_none()
    }

    fn close(&mut self) {
        self.closed = self.open;
        self.open.reset();
        learnt_weights::add(&mut self.net.weights, &self.delta);
        self.moved = core::mem::replace(&mut self.delta, [0.0; LEARNT]);
    }

    /// Learns from one axis of a reference. False: refused as an outlier. An axis whose output is
    /// switched off is skipped.
    fn learn(&mut self, axis: usize, sum: f32, variance: f32) -> bool {
        let (Some(psi), Some(is)) = (self.closed.psi().get(axis), self.closed.sum().get(axis))
        else {
            return true;
        };
        if self.net.normalisation.output_scale.get(axis) == Some(&0.0) {
            return true;
        }
        let h = learnt_weights::pick(psi);
        let moved = self.delta.iter().zip(&self.moved);
        let expected = h
            .iter()
            .zip(moved)
            .fold(*is, |sum, (h, (a, b))| sum + h * (a + b));
        self.known
            .update(&mut self.delta, &h, sum - expected, variance, GATE)
    }

    fn best(&self) -> Net {
        let mut net = self.net;
        learnt_weights::add(&mut net.weights, &self.delta);
        net
    }
}

impl Span {
    const EMPTY: Span = Span {
        first: 0,
        last: 0,
        blocks: 0,
        sum: [[0; 3]; 2],
        step: 0.0,
    };

    fn ends(&self) -> (u32, u32) {
        (self.first, self.last)
    }
}

impl WindowLearner {
    /// A learner that waits for [`Learner::begin`]. All zeros, so that it takes no room in flash.
    pub const fn new() -> WindowLearner {
        WindowLearner {
            sides: [Side::EMPTY; 2],
            stream: StreamScale {
                lsb: Lsb { rad: 0.0, mps: 0.0 },
                period_s: 0.0,
                block_samples: 0,
            },
            inputs: [[Source::RateX; 3]; 2],
            configured: false,
            open: Span::EMPTY,
            closed: None,
            taken: None,
            used: 0,
            doubted: 0,
        }
    }

    /// Gives up the window in progress.
    fn drop_open(&mut self) {
        self.open = Span::EMPTY;
        self.sides.iter_mut().for_each(|side| side.open.reset());
    }

    /// Learns from a reference, axis by axis.
    fn learn(&mut self, measured: &Measured) {
        let mut doubted = false;
        let values = measured.sum.iter().zip(&measured.variance);
        for (network, (sums, variances)) in self.sides.iter_mut().zip(values) {
            for (axis, (sum, variance)) in sums.iter().zip(variances).enumerate() {
                doubted |= !network.learn(axis, *sum, *variance);
            }
        }
        self.used = self.used.saturating_add(1);
        self.doubted = self.doubted.saturating_add(u32::from(doubted));
    }
}

impl Default for WindowLearner {
    fn default() -> WindowLearner {
        WindowLearner::new()
    }
}

impl Learner for WindowLearner {
    /// It needs the inputs of the networks: the scales are those of the networks.
    fn configure(&mut self, settings: &Settings) {
        (self.inputs, self.configured) = (settings.inputs, true);
        self.taken = None; // the numbers of the samples restart
        self.restart();
    }

    fn begin(&mut self, nets: &Nets, stream: StreamScale) {
        self.stream = stream;
        let [gyro, accel] = &mut self.sides;
        gyro.begin(&nets.gyro);
        accel.begin(&nets.accel);
        self.restart();
    }

    fn restart(&mut self) {
        self.closed = None;
        self.drop_open();
        self.sides.iter_mut().for_each(Side::restart);
    }

    fn block(&mut self, last: u32, block: &Block) {
        let dt = self.stream.block_s();
        let inputs = if self.configured { self.inputs } else { OWN };
        let [of_gyro, of_accel] = inputs.map(|which| block.sources.select(&which));
        let [gyro, accel] = &mut self.sides;
        let good = gyro.step(of_gyro, dt) & accel.step(of_accel, dt);
        let open = &mut self.open;
        if open.blocks == 0 {
            open.first = last.wrapping_sub(u32::from(self.stream.block_samples) - 1);
        }
        open.last = last;
        open.blocks += 1;
        open.step = block.step;
        for (sums, of_block) in open.sum.iter_mut().zip(&block.sum) {
            for (sum, value) in sums.iter_mut().zip(of_block) {
                *sum = sum.saturating_add(*value);
            }
        }
        if !good {
            return self.drop_open();
        }
        if open.blocks >= BLOCKS {
            self.closed = Some(self.open);
            self.open = Span::EMPTY;
            self.sides.iter_mut().for_each(Side::close);
        }
    }

    fn gap(&mut self) {
        if self.open.blocks > 0 {
            self.drop_open();
        }
    }

    fn reference(&mut self, window: &control::Window) -> Result<(), Reason> {
        let ends = (window.first, window.last);
        if self.taken == Some(ends) {
            return Ok(()); // sent again, because the answer was lost
        }
        let span = self
            .closed
            .filter(|span| span.ends() == ends)
            .ok_or(Reason::Window)?;
        let positive = |x: f32| x.is_finite() && x > 0.0;
        let finite = window.angle.iter().chain(&window.velocity);
        if !finite.copied().all(f64::is_finite)
            || !positive(window.angle_sigma)
            || !positive(window.velocity_sigma)
        {
            return Err(Reason::Range);
        }
        let lsb = [self.stream.lsb.rad, self.stream.lsb.mps];
        let truth = [window.angle, window.velocity];
        let sigma = [window.angle_sigma, window.velocity_sigma];
        let mut measured = Measured {
            sum: [[0.0; 3]; 2],
            variance: [[0.0; 3]; 2],
        };
        for (side, network) in self.sides.iter().enumerate() {
            let scale = network.net.normalisation.output_scale;
            for (axis, scale) in scale.into_iter().enumerate() {
                let (is, should) = (at(&span.sum, side, axis), at(&truth, side, axis));
                let unit = lsb.get(side).copied().unwrap_or(0.0) * f64::from(span.step);
                let error = (is.unwrap_or(0) as f64 * unit - should.unwrap_or(0.0)) as f32;
                let noise = sigma.get(side).copied().unwrap_or(0.0) / scale;
                set(&mut measured.sum, side, axis, error / scale);
                set(&mut measured.variance, side, axis, noise * noise);
            }
        }
        self.closed = None;
        self.taken = Some(ends);
        self.learn(&measured);
        Ok(())
    }

    fn learnt(&mut self) -> (Nets, [State; 2]) {
        let [gyro, accel] = &self.sides;
        let nets = Nets {
            maps: Nets::NONE.maps,
            gyro: gyro.best(),
            accel: accel.best(),
        };
        (nets, [gyro.state, accel.state])
    }

    fn report(&self) -> Report {
        let [gyro, accel] = &self.sides;
        Report {
            window: self.closed.as_ref().map(Span::ends),
            estimate: [gyro.estimate, accel.estimate],
            used: self.used,
            doubted: self.doubted,
            ..Report::default()
        }
    }
}

fn at<T: Copy>(of: &[[T; 3]; 2], side: usize, axis: usize) -> Option<T> {
    of.get(side).and_then(|triad| triad.get(axis)).copied()
}

fn set(of: &mut [[f32; 3]; 2], side: usize, axis: usize, value: f32) {
    if let Some(place) = of.get_mut(side).and_then(|triad| triad.get_mut(axis)) {
        *place = value;
    }
}
