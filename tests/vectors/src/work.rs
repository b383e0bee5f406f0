//! The pieces of work whose cost is measured, the same on the desktop (criterion) and on the target (instructions).
//!
//! Each repetition says whether it was good. A network that has diverged holds its last output, which is *cheaper* than a
//! step: a measurement that does not look at the faults would praise it.

use lrnn_nostd::learn::{Learner, Paper, StepSizes};
use lrnn_nostd::{Activation, Net, Sensitivities, State, Step, kernel};

use crate::{input, net};

/// The first of [`COUNT`] vectors without a non-finite or huge one.
const FIRST: usize = 10;
const COUNT: usize = 40;
/// What the descents go for, and how fast: so slow that they stay where they are good.
const TARGET: [f32; 3] = [1.0 / 64.0; 3];
const RATE: f32 = 1.0 / 65536.0;

/// Samples of the drive that desktops are compared on: 22 min at 200 Hz.
pub const DRIVE: usize = 22 * 60 * 200;

/// The input of a repetition, rad/s.
#[inline]
pub fn plausible(repetition: usize) -> [f32; 3] {
    input(FIRST + repetition % COUNT)
}

/// One step.
#[derive(Clone, Debug)]
pub struct StepWork<H> {
    net: Net<H>,
    state: State,
}

/// One step and its exact gradient.
#[derive(Clone, Debug)]
pub struct GradientWork<H> {
    net: Net<H>,
    state: State,
    sensitivities: Sensitivities,
}

/// One step, its exact gradient, and a descent of all 63 weights: learning word by word, the figure other libraries give.
#[derive(Clone, Debug)]
pub struct DescentWork<H> {
    net: Net<H>,
    state: State,
    sensitivities: Sensitivities,
}

/// Learning at every step, the most it can cost: a pass of one step by the paper's rule. All is cleared, a step is made with
/// its exact gradient and compared with a reference, and all 63 weights move. `begin_pass` belongs to it: without it the
/// gradients of all passes add up and the weights diverge.
#[derive(Clone, Debug)]
pub struct LearnWork<H>(Learner<Paper, H>);

/// The kernel's functions, each measured as the portable ones are.
#[derive(Clone, Debug)]
pub struct KernelWork {
    net: kernel::Net,
    state: State,
    sensitivities: Sensitivities,
}

/// One activation and its slope.
#[derive(Clone, Debug, Default)]
pub struct ActivationWork<H>(core::marker::PhantomData<H>);

impl<H: Activation> ActivationWork<H> {
    /// One repetition.
    #[inline(always)]
    pub fn run(&mut self, [x, y, z]: [f32; 3]) -> ([f32; 3], bool) {
        ([H::apply(x), y, z], true)
    }
}

impl KernelWork {
    /// At rest.
    pub fn new() -> Self {
        Self {
            net: net(),
            state: State::new(),
            sensitivities: Sensitivities::new(),
        }
    }

    /// One repetition of a step.
    #[inline(always)]
    pub fn step(
        &mut self,
        step: impl Fn(&kernel::Net, &mut State, [f32; 3]) -> Step,
        input: [f32; 3],
    ) -> ([f32; 3], bool) {
        let step = step(&self.net, &mut self.state, input);
        (step.error, step.fault.is_none())
    }

    /// One repetition of a step with its gradient.
    #[inline(always)]
    pub fn gradient(
        &mut self,
        step: impl Fn(&kernel::Net, &mut State, &mut Sensitivities, [f32; 3]) -> Step,
        input: [f32; 3],
    ) -> ([f32; 3], bool) {
        let step = step(&self.net, &mut self.state, &mut self.sensitivities, input);
        (step.error, step.fault.is_none())
    }

    /// One repetition with a descent.
    #[inline(always)]
    pub fn descent(
        &mut self,
        step: impl Fn(
            &mut kernel::Net,
            &mut State,
            &mut Sensitivities,
            [f32; 3],
            &[f32; 3],
            f32,
        ) -> Step,
        input: [f32; 3],
    ) -> ([f32; 3], bool) {
        let (state, sensitivities) = (&mut self.state, &mut self.sensitivities);
        let step = step(&mut self.net, state, sensitivities, input, &TARGET, RATE);
        (step.error, step.fault.is_none())
    }
}

impl Default for KernelWork {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation> StepWork<H> {
    /// At rest.
    pub fn new() -> Self {
        Self {
            net: net(),
            state: State::new(),
        }
    }

    /// One repetition: the estimated error, and whether the step was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        let step = self.net.step(&mut self.state, input);
        (step.error, step.fault.is_none())
    }
}

impl<H: Activation> GradientWork<H> {
    /// At rest.
    pub fn new() -> Self {
        Self {
            net: net(),
            state: State::new(),
            sensitivities: Sensitivities::new(),
        }
    }

    /// One repetition: the estimated error, and whether the step was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        let step = self
            .net
            .step_gradient(&mut self.state, &mut self.sensitivities, input);
        (step.error, step.fault.is_none())
    }
}

impl<H: Activation> DescentWork<H> {
    /// At rest.
    pub fn new() -> Self {
        Self {
            net: net(),
            state: State::new(),
            sensitivities: Sensitivities::new(),
        }
    }

    /// One repetition: the estimated error, and whether the step was good.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        let (state, sensitivities) = (&mut self.state, &mut self.sensitivities);
        let step = self
            .net
            .step_descend(state, sensitivities, input, &TARGET, RATE);
        (step.error, step.fault.is_none())
    }
}

impl<H: Activation> LearnWork<H> {
    /// With steps small enough to stay stable however often it is repeated.
    pub fn new() -> Self {
        let rule = Paper::new(StepSizes::uniform(1.0 / 4096.0), StepSizes::uniform(0.0));
        Self(Learner::new(&net(), rule))
    }

    /// One repetition: the estimated error, and whether the pass was accepted without a fault.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> ([f32; 3], bool) {
        self.0.begin_pass();
        let step = self.0.step(input, 1.0);
        self.0.reference([1.0 / (1 << 19) as f32; 3], 1.0); // rad: 0.4 deg/h for a second
        let pass = self.0.end_pass();
        (step.error, pass.accepted && pass.faults == 0)
    }
}

impl<H: Activation> Default for StepWork<H> {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation> Default for GradientWork<H> {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation> Default for DescentWork<H> {
    fn default() -> Self {
        Self::new()
    }
}

impl<H: Activation> Default for LearnWork<H> {
    fn default() -> Self {
        Self::new()
    }
}
