//! Which pieces of work are measured, under which names: one list for all that count on a target.

use core::fmt;

use lrnn_nostd::{Activation, Cubic, Rational, Tanh, kernel};

use crate::learning::{LearnerFixWork, LearnerSecondWork, LearnerStepWork};
use crate::navigation::{NavPieceWork, NavSecondWork, NavWordWork};
use crate::work::{ActivationWork, DescentWork, GradientWork, KernelWork, LearnWork, StepWork};

/// What counts.
pub trait Measure {
    /// Counts `work`, which takes an input and gives a result and whether it was good. `long`: a million instructions rather than a
    /// thousand.
    ///
    /// # Errors
    /// The work went wrong, so that its count would be of something else; or nothing can be printed.
    fn measure(
        &mut self,
        name: &'static str,
        long: bool,
        work: impl FnMut([f32; 3]) -> ([f32; 3], bool),
    ) -> fmt::Result;
}

/// Everything, in the order of `xtask/src/bench.rs`; before it `empty`, the loop without work.
///
/// # Errors
/// As [`Measure::measure`].
pub fn all(on: &mut impl Measure) -> fmt::Result {
    on.measure("empty", false, |input| (input, true))?;
    step::<Rational>(on, "step_rational")?;
    step::<Tanh>(on, "step_tanh")?;
    step::<Cubic>(on, "step_cubic")?;
    gradient::<Rational>(on, "gradient_rational")?;
    gradient::<Tanh>(on, "gradient_tanh")?;
    gradient::<Cubic>(on, "gradient_cubic")?;
    descent::<Rational>(on, "descent_rational")?;
    descent::<Tanh>(on, "descent_tanh")?;
    descent::<Cubic>(on, "descent_cubic")?;
    learn::<Rational>(on, "learn_rational")?;
    learn::<Tanh>(on, "learn_tanh")?;
    learn::<Cubic>(on, "learn_cubic")?;
    nav_word(on)?;
    nav_piece(on)?;
    nav_second(on)?;
    learner_step(on)?;
    learner_fix(on)?;
    learner_second(on)?;
    activation::<Rational>(on, "activation_rational")?;
    activation::<Tanh>(on, "activation_tanh")?;
    activation::<Cubic>(on, "activation_cubic")?;
    kernels(on)
}

// Each in a function of its own, so that the works' memory is not on the stack together.

#[inline(never)]
fn step<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = StepWork::<H>::new();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn gradient<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = GradientWork::<H>::new();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn descent<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = DescentWork::<H>::new();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn learn<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = LearnWork::<H>::new();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn nav_word(on: &mut impl Measure) -> fmt::Result {
    let mut work = NavWordWork::new().ok_or(fmt::Error)?;
    on.measure("nav_word", false, |input| work.run(input))
}

#[inline(never)]
fn nav_piece(on: &mut impl Measure) -> fmt::Result {
    let mut work = NavPieceWork::new().ok_or(fmt::Error)?;
    on.measure("nav_piece", false, |input| work.run(input))
}

#[inline(never)]
fn nav_second(on: &mut impl Measure) -> fmt::Result {
    let mut work = NavSecondWork::new().ok_or(fmt::Error)?;
    on.measure("nav_second", true, |input| work.run(input))
}

#[inline(never)]
fn learner_step(on: &mut impl Measure) -> fmt::Result {
    let mut work = LearnerStepWork::ZEROED;
    work.begin();
    on.measure("learner_step", false, |input| work.run(input))
}

#[inline(never)]
fn learner_fix(on: &mut impl Measure) -> fmt::Result {
    let mut work = LearnerFixWork::ZEROED;
    work.begin();
    on.measure("learner_fix", true, |input| work.run(input))
}

#[inline(never)]
fn learner_second(on: &mut impl Measure) -> fmt::Result {
    let mut work = LearnerSecondWork::ZEROED;
    work.begin();
    on.measure("learner_second", true, |input| work.run(input))
}

fn activation<H: Activation + Default>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = ActivationWork::<H>::default();
    on.measure(name, false, |input| work.run(input))
}

/// The kernel in its two forms.
#[inline(never)]
fn kernels(on: &mut impl Measure) -> fmt::Result {
    use kernel::{m4, m7};
    let mut work = KernelWork::new();
    on.measure("step_m4", false, |input| work.step(m4::step, input))?;
    on.measure("step_m7", false, |input| work.step(m7::step, input))?;
    on.measure("gradient_m4", false, |input| {
        work.gradient(m4::step_gradient, input)
    })?;
    on.measure("gradient_m7", false, |input| {
        work.gradient(m7::step_gradient, input)
    })?;
    on.measure("descent_m4", false, |input| {
        work.descent(m4::step_descend, input)
    })?;
    on.measure("descent_m7", false, |input| {
        work.descent(m7::step_descend, input)
    })
}
