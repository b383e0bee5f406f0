//! The measured pieces of work, one row each. The desktop, QEMU and the bench image for boards
//! measure them in this order and under these names; `cargo xtask bench` prints the descriptions. A
//! new row also needs a budget in `budgets.toml`.

use core::fmt;

use lrnn_nostd::{Activation, Cubic, MicroMath, Rational, Tanh};

use crate::learning::{
    AntennaSecondWork, LearnerFixWork, LearnerSecondWork, LearnerStepWork, ShadowSecondWork,
};
use crate::navigation::{NavPieceWork, NavSampleWork, NavSecondWork};
use crate::work::{Engine, LearnWork, M4, M7, NetworkWork, Portable, WorkResult, activate};

/// A way to measure work.
pub trait Measure {
    /// Measures `work`. `long`: a repetition takes a million instructions instead of a thousand.
    ///
    /// # Errors
    /// The work failed, so its figure would be wrong; or nothing can be printed.
    fn measure(
        &mut self,
        name: &'static str,
        long: bool,
        work: impl FnMut([f32; 3]) -> WorkResult,
    ) -> fmt::Result;

    /// As [`Self::measure`], for work that cannot be repeated for ever. A measurement with very
    /// many repetitions has to begin again from `start` now and then.
    ///
    /// # Errors
    /// As [`Self::measure`].
    #[inline(always)]
    fn measure_from<W: Clone>(
        &mut self,
        name: &'static str,
        long: bool,
        start: W,
        run: impl Fn(&mut W, [f32; 3]) -> WorkResult,
    ) -> fmt::Result {
        let mut work = start;
        self.measure(name, long, |input| run(&mut work, input))
    }
}

macro_rules! works {
    ($({ $($name:literal, $what:literal => $run:expr;)+ })+) => {
        /// Name and description of each piece of work. In a group each piece contains the previous
        /// one, or is much larger. A piece without a description has a table of its own.
        pub const GROUPS: &[&[(&str, &str)]] = &[$(&[$(($name, $what)),+]),+];

        /// Measures everything in the order of [`GROUPS`]; before it `empty`, the loop without
        /// work.
        ///
        /// # Errors
        /// As [`Measure::measure`].
        pub fn all(on: &mut impl Measure) -> fmt::Result {
            on.measure("empty", false, |input| (input, true))?;
            $($($run(on, $name)?;)+)+
            Ok(())
        }
    };
}

works! {
    {
        "step_rational", "step, rational" => step::<Portable<Rational>>;
        "gradient_rational", "step + gradient, rational" => gradient::<Portable<Rational>>;
        "descent_rational", "step + gradient + descent, rational" => descent::<Portable<Rational>>;
        "learn_rational", "a pass of one step, rational" => learn::<Rational>;
    }
    {
        "step_tanh", "step, tanh" => step::<Portable<Tanh>>;
        "gradient_tanh", "step + gradient, tanh" => gradient::<Portable<Tanh>>;
        "descent_tanh", "step + gradient + descent, tanh" => descent::<Portable<Tanh>>;
        "learn_tanh", "a pass of one step, tanh" => learn::<Tanh>;
    }
    {
        "step_cubic", "step, cubic" => step::<Portable<Cubic>>;
        "gradient_cubic", "step + gradient, cubic" => gradient::<Portable<Cubic>>;
        "descent_cubic", "step + gradient + descent, cubic" => descent::<Portable<Cubic>>;
        "learn_cubic", "a pass of one step, cubic" => learn::<Cubic>;
    }
    {
        "nav_sample", "sample of the navigator" => nav_sample;
        "nav_piece", "longest end of a piece of the navigator" => nav_piece;
        "nav_second", "second of the navigator, 200 samples" => nav_second;
    }
    { "shadow_nav_second", "second of eight shadow navigators: a coast" => shadow_nav_second; }
    {
        "learner_step", "step of 126 weights with gradient" => learner_step;
        "learner_fix", "fix, 126 weights and 6 biases" => learner_fix;
        "learner_second", "second of all eight hypotheses" => learner_second;
    }
    {
        "antenna_second", "second and fix of lever arm and delay" => antenna_second;
    }
    {
        "step_m4", "kernel m4: step" => step::<M4>;
        "gradient_m4", "kernel m4: step + gradient" => gradient::<M4>;
        "descent_m4", "kernel m4: step + gradient + descent" => descent::<M4>;
    }
    {
        "step_m7", "kernel m7: step" => step::<M7>;
        "gradient_m7", "kernel m7: step + gradient" => gradient::<M7>;
        "descent_m7", "kernel m7: step + gradient + descent" => descent::<M7>;
    }
    { "activation_rational", "" => activation::<Rational>; }
    { "activation_tanh", "" => activation::<Tanh>; }
    { "activation_cubic", "" => activation::<Cubic>; }
    { "activation_micromath", "" => activation::<MicroMath>; }
    { "step_micromath", "" => step::<Portable<MicroMath>>; }
}

// Each in a function of its own, so that the memory of the works is not on the stack together.

#[inline(never)]
fn step<E: Engine>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = NetworkWork::<E>::new();
    on.measure(name, false, |input| work.step(input))
}

#[inline(never)]
fn gradient<E: Engine>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = NetworkWork::<E>::new();
    on.measure(name, false, |input| work.gradient(input))
}

#[inline(never)]
fn descent<E: Engine>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = NetworkWork::<E>::new();
    on.measure(name, false, |input| work.descent(input))
}

#[inline(never)]
fn learn<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = LearnWork::<H>::new();
    on.measure(name, false, |input| work.run(input))
}

fn activation<H: Activation>(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    on.measure(name, false, activate::<H>)
}

#[inline(never)]
fn nav_sample(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let start = NavSampleWork::new().ok_or(fmt::Error)?;
    on.measure_from(name, false, start, NavSampleWork::run)
}

#[inline(never)]
fn nav_piece(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let start = NavPieceWork::new().ok_or(fmt::Error)?;
    on.measure_from(name, false, start, NavPieceWork::run)
}

#[inline(never)]
fn nav_second(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let start = NavSecondWork::new().ok_or(fmt::Error)?;
    on.measure_from(name, true, start, NavSecondWork::run)
}

#[inline(never)]
fn shadow_nav_second(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = ShadowSecondWork::<1>::ZEROED;
    work.begin();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn learner_step(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = LearnerStepWork::ZEROED;
    work.begin();
    on.measure(name, false, |input| work.run(input))
}

#[inline(never)]
fn learner_fix(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = LearnerFixWork::ZEROED;
    work.begin();
    on.measure(name, true, |input| work.run(input))
}

#[inline(never)]
fn learner_second(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let mut work = LearnerSecondWork::ZEROED;
    work.begin();
    on.measure(name, true, |input| work.run(input))
}

#[inline(never)]
fn antenna_second(on: &mut impl Measure, name: &'static str) -> fmt::Result {
    let start = AntennaSecondWork::new().ok_or(fmt::Error)?;
    on.measure_from(name, true, start, AntennaSecondWork::run)
}
