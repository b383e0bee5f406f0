//! The networks' pieces of work whose cost is measured, the same on the desktop (criterion) and on
//! the target (instructions).
//!
//! Each repetition reports whether it was good. A network that has diverged repeats its last
//! output, which is *cheaper* than a step, so a measurement that ignored the faults would come out
//! too low.

use core::marker::PhantomData;

use lrnn_nostd::learn::{Learner, Paper, StepSizes};
use lrnn_nostd::{Activation, Cubic, Net, Sensitivities, State, Step, kernel};

use crate::{input, net};

/// The first of [`COUNT`] consecutive vectors without a non-finite or huge number.
const FIRST: usize = 10;
const COUNT: usize = 40;
/// Target and rate of the descents: so slow that the weights stay in a good range.
const TARGET: [f32; 3] = [1.0 / 64.0; 3];
const RATE: f32 = 1.0 / 65536.0;

/// Samples of the drive that desktops are compared on: 22 min at 200 Hz.
pub const DRIVE: usize = 22 * 60 * 200;

/// The result of a repetition, and whether it was good.
pub type WorkResult = ([f32; 3], bool);

/// The input of a repetition, rad/s.
#[inline]
pub fn plausible(repetition: usize) -> [f32; 3] {
    input(FIRST + repetition % COUNT)
}

/// An implementation of the network: [`Portable`], or the kernel's form [`M4`] or [`M7`].
pub trait Engine {
    /// Activation of its hidden layers.
    type Hidden: Activation;

    /// [`Net::step`].
    fn step(net: &Net<Self::Hidden>, state: &mut State, input: [f32; 3]) -> Step;

    /// [`Net::step_gradient`].
    fn step_gradient(
        net: &Net<Self::Hidden>,
        state: &mut State,
        sensitivities: &mut Sensitivities,
        input: [f32; 3],
    ) -> Step;

    /// [`Net::step_descend`].
    fn step_descend(
        net: &mut Net<Self::Hidden>,
        state: &mut State,
        sensitivities: &mut Sensitivities,
        input: [f32; 3],
    ) -> Step;
}

/// The portable network with hidden layers of activation `H`.
#[derive(Clone, Copy, Debug)]
pub struct Portable<H>(PhantomData<H>);

impl<H: Activation> Engine for Portable<H> {
    type Hidden = H;

    #[inline(always)]
    fn step(net: &Net<H>, state: &mut State, input: [f32; 3]) -> Step {
        net.step(state, input)
    }

    #[inline(always)]
    fn step_gradient(
        net: &Net<H>,
        state: &mut State,
        sensitivities: &mut Sensitivities,
        input: [f32; 3],
    ) -> Step {
        net.step_gradient(state, sensitivities, input)
    }

    #[inline(always)]
    fn step_descend(
        net: &mut Net<H>,
        state: &mut State,
        sensitivities: &mut Sensitivities,
        input: [f32; 3],
    ) -> Step {
        net.step_descend(state, sensitivities, input, &TARGET, RATE)
    }
}

macro_rules! kernel_form {
    ($(#[$doc:meta])* $name:ident, $form:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name;

        impl Engine for $name {
            type Hidden = Cubic;

            #[inline(always)]
            fn step(net: &kernel::Net, state: &mut State, input: [f32; 3]) -> Step {
                kernel::$form::step(net, state, input)
            }

            #[inline(always)]
            fn step_gradient(
                net: &kernel::Net,
                state: &mut State,
                sensitivities: &mut Sensitivities,
                input: [f32; 3],
            ) -> Step {
                kernel::$form::step_gradient(net, state, sensitivities, input)
            }

            #[inline(always)]
            fn step_descend(
                net: &mut kernel::Net,
                state: &mut State,
                sensitivities: &mut Sensitivities,
                input: [f32; 3],
            ) -> Step {
                kernel::$form::step_descend(net, state, sensitivities, input, &TARGET, RATE)
            }
        }
    };
}
kernel_form!(
    /// The kernel's form for the Cortex-M4F.
    M4,
    m4
);
kernel_form!(
    /// The kernel's form for the Cortex-M7.
    M7,
    m7
);

/// A network with everything that its steps need.
#[derive(Clone, Debug)]
pub struct NetworkWork<E: Engine> {
    net: Net<E::Hidden>,
    state: State,
    sensitivities: Sensitivities,
}

impl<E: Engine> NetworkWork<E> {
    /// In the state before the first step.
    pub fn new() -> Self {
        Self {
            net: net(),
            state: State::new(),
            sensitivities: Sensitivities::new(),
        }
    }

    /// A repetition with one step: the estimated error.
    #[inline(always)]
    pub fn step(&mut self, input: [f32; 3]) -> WorkResult {
        found(E::step(&self.net, &mut self.state, input))
    }

    /// A repetition with one step and its exact gradient.
    #[inline(always)]
    pub fn gradient(&mut self, input: [f32; 3]) -> WorkResult {
        let (state, sensitivities) = (&mut self.state, &mut self.sensitivities);
        found(E::step_gradient(&self.net, state, sensitivities, input))
    }

    /// A repetition with one step, its exact gradient, and a descent of all 63 weights: learning
    /// sample by sample, for which other libraries give figures.
    #[inline(always)]
    pub fn descent(&mut self, input: [f32; 3]) -> WorkResult {
        let (state, sensitivities) = (&mut self.state, &mut self.sensitivities);
        found(E::step_descend(&mut self.net, state, sensitivities, input))
    }
}

impl<E: Engine> Default for NetworkWork<E> {
    fn default() -> Self {
        Self::new()
    }
}

#[inline(always)]
fn found(step: Step) -> WorkResult {
    (step.error, step.fault.is_none())
}

/// Learning at every step, the most that it can cost: a pass of one step by the paper's rule. The
/// pass clears all sums, makes a step with its exact gradient, compares it with a reference and
/// moves all 63 weights. Without `begin_pass` the gradients of all passes would add up and the
/// weights diverge.
#[derive(Clone, Debug)]
pub struct LearnWork<H>(Learner<Paper, H>);

impl<H: Activation> LearnWork<H> {
    /// With steps small enough to stay stable however often the work is repeated.
    pub fn new() -> Self {
        let rule = Paper::new(StepSizes::uniform(1.0 / 4096.0), StepSizes::uniform(0.0));
        Self(Learner::new(&net(), rule))
    }

    /// One repetition. It is good if the pass was accepted without a fault.
    #[inline(always)]
    pub fn run(&mut self, input: [f32; 3]) -> WorkResult {
        self.0.begin_pass();
        let step = self.0.step(input, 1.0);
        self.0.reference([1.0 / (1 << 19) as f32; 3], 1.0); // rad: 0.4 deg/h for one second
        let pass = self.0.end_pass();
        (step.error, pass.accepted && pass.faults == 0)
    }
}

impl<H: Activation> Default for LearnWork<H> {
    fn default() -> Self {
        Self::new()
    }
}

/// One activation.
#[inline(always)]
pub fn activate<H: Activation>([x, y, z]: [f32; 3]) -> WorkResult {
    ([H::apply(x), y, z], true)
}
