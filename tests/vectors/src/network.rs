//! The fixed network and the digests of its steps and gradients.

use lrnn_nostd::{Activation, Fault, Net, Normalisation, Sensitivities, State, Step, Weights};

use crate::{Digest, INPUTS};

/// Vector `index` in rad/s; from [`crate::VECTORS`] on they start again.
#[inline]
pub fn input(index: usize) -> [f32; 3] {
    INPUTS[index % INPUTS.len()].map(f32::from_bits)
}

/// The fixed network. Every parameter is a multiple of 2^-7 within +-0.5, so that the network
/// remembers for some steps and stays stable. Inputs are scaled by 1/2 s/rad; the output is of the
/// order of 1 deg/h (2^-18 rad/s).
pub fn net<H: Activation>() -> Net<H> {
    let weights = Weights::from_fn(|index| ((index * 37 + 11) % 129) as f32 / 128.0 - 0.5);
    let output_scale = [1.0 / (1 << 18) as f32; 3];
    Net::new(
        weights,
        Normalisation {
            input_offset: [0.0; 3],
            input_scale: [0.5; 3],
            output_scale,
        },
    )
}

/// Digest of one pass over the vectors: output, error and fault of each step.
pub fn step_digest<H: Activation>() -> u64 {
    let (net, mut state, mut digest) = (net::<H>(), State::new(), Digest::new());
    for index in 0..INPUTS.len() {
        feed(&mut digest, &net.step(&mut state, input(index)));
    }
    digest.value()
}

/// Digest of one pass with exact gradients: the step's numbers and all 3x63 sensitivities
/// dy_3/dtheta of each.
pub fn gradient_digest<H: Activation>() -> u64 {
    let (net, mut state, mut digest) = (net::<H>(), State::new(), Digest::new());
    let mut sensitivities = Sensitivities::new();
    for index in 0..INPUTS.len() {
        feed(
            &mut digest,
            &net.step_gradient(&mut state, &mut sensitivities, input(index)),
        );
        digest.numbers(sensitivities.output().iter().flatten().copied());
    }
    digest.value()
}

pub(crate) fn feed(digest: &mut Digest, step: &Step) {
    digest.numbers(step.output);
    digest.numbers(step.error);
    digest.byte(match step.fault {
        None => 0,
        Some(Fault::NonFiniteInput) => 1,
        Some(Fault::Overflow) => 2,
        Some(Fault::SensitivityOverflow) => 3,
    });
}
