//! Passes of the three learning rules over the vectors, and their digest.

use lrnn_nostd::learn::{GaussNewton, Guarded, Learner, Paper, Pass, Rule, StepSizes};
use lrnn_nostd::{Activation, Weights};

use crate::{Digest, input, net};

/// Steps in a pass. It ends before the vectors with the largest finite numbers, which would
/// overflow and make the pass void. The non-finite ones are included; they are skipped.
const STEPS: usize = 220;
/// Steps in the window of a reference.
const WINDOW: usize = 4;
/// Seconds per step.
const DT: f32 = 1.0 / 128.0;
/// Passes of each rule.
const PASSES: usize = 4;

/// First step sizes of the two gradient rules; with them a pass on the vectors lowers the cost.
const STEP_SIZES: StepSizes = StepSizes::uniform(1.0 / 16.0);

/// Digest of four passes of each rule: cost, verdict, counts and all 63 next weights of each pass.
pub fn learner_digest<H: Activation>() -> u64 {
    let mut digest = Digest::new();
    let mut feed = |pass: Pass, weights: Weights| {
        digest.number(pass.cost);
        digest.byte(u8::from(pass.accepted));
        digest.numbers([pass.windows as f32, pass.faults as f32]);
        digest.numbers(weights.iter());
    };
    teach::<H, _>(paper(), &mut feed);
    teach::<H, _>(guarded(), &mut feed);
    teach::<H, _>(gauss_newton::<H>(), &mut feed);
    digest.value()
}

/// The rule as printed.
pub fn paper() -> Paper {
    Paper::new(STEP_SIZES, StepSizes::uniform(0.125))
}

/// The guarded rule.
pub fn guarded() -> Guarded {
    Guarded::new(STEP_SIZES)
}

/// Gauss-Newton around the fixed network's weights.
pub fn gauss_newton<H: Activation>() -> GaussNewton {
    GaussNewton::new(&net::<H>().weights, 1.0 / 1024.0)
}

/// Four passes of one rule; `each` receives the result of a pass and the weights of the next one.
pub fn teach<H: Activation, U: Rule<f32>>(rule: U, each: &mut impl FnMut(Pass, Weights)) {
    let mut learner = Learner::new(&net::<H>(), rule);
    for _ in 0..PASSES {
        learner.begin_pass();
        for first in (0..STEPS).step_by(WINDOW) {
            let mut sum = [0.0; 3];
            let mut whole = true;
            for index in first..first + WINDOW {
                let rates = input(index);
                whole &= learner.step(rates, DT).fault.is_none();
                for (sum, rate) in sum.iter_mut().zip(rates) {
                    *sum += sensor_error(rate) * DT;
                }
            }
            if whole {
                learner.reference(sum, 1.0);
            } else {
                learner.skip();
            }
        }
        let pass = learner.end_pass();
        each(pass, *learner.candidate());
    }
}

/// The error that the network is to learn, in rad/s: a bias of 2^-19 (0.4 deg/h) and a scale factor
/// error of 2^-20 (1 ppm).
fn sensor_error(rate: f32) -> f32 {
    const BIAS: f32 = 1.0 / (1 << 19) as f32;
    const SCALE: f32 = 1.0 / (1 << 20) as f32;
    BIAS + SCALE * rate
}
