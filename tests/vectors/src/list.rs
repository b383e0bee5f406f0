//! Which pieces of work are measured, under which names: one list for all that count on a target.

use core::fmt;

use lrnn_nostd::{Activation, Rational, Tanh};

use crate::learning::{LearnerFixWork, LearnerSecondWork, LearnerStepWork};
use crate::navigation::{NavPieceWork, NavSecondWork, NavWordWork};
use crate::work::{DescentWork, GradientWork, LearnWork, StepWork};

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
    gradient::<Rational>(on, "gradient_rational")?;
    gradient::<Tanh>(on, "gradient_tanh")?;
    descent::<Rational>(on, "descent_rational")?;
    descent::<Tanh>(on, "descent_tanh")?;
    learn::<Rational>(on, "learn_rational")?;
    learn::<Tanh>(on, "learn_tanh")?;
    nav_word(on)?;
    nav_piece(on)?;
    nav_second(on)?;
    learner_step(on)?;
    learner_fix(on)?;
    learner_second(on)
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
    let mut work = LearnerStepWork::BLANK;
    work.begin();
    on.measure("learner_step", false, |input| work.run(input))
}

#[inline(never)]
fn learner_fix(on: &mut impl Measure) -> fmt::Result {
    let mut work = LearnerFixWork::BLANK;
    work.begin();
    on.measure("learner_fix", true, |input| work.run(input))
}

#[inline(never)]
fn learner_second(on: &mut impl Measure) -> fmt::Result {
    let mut work = LearnerSecondWork::BLANK;
    work.begin();
    on.measure("learner_second", true, |input| work.run(input))
}
