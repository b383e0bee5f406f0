//! The kernel compared with the portable network: random networks, ordinary and extreme, with
//! inputs of every kind, digested bit by bit. The desktop computes the digest with the portable
//! network, the target with the assembly.

use lrnn_nostd::kernel::{self, Net};
use lrnn_nostd::{Normalisation, Sensitivities, State, Step, Weights};

use crate::Digest;
use crate::network::feed;

/// Number of networks.
const NETS: u32 = 60;
/// Number of steps of each.
const STEPS: u32 = 24;

/// A function of the kernel that steps and descends.
pub type Descend = fn(&mut Net, &mut State, &mut Sensitivities, [f32; 3], &[f32; 3], f32) -> Step;
/// A function of the kernel that steps and differentiates.
pub type Differentiate = fn(&Net, &mut State, &mut Sensitivities, [f32; 3]) -> Step;
/// A function of the kernel that steps.
pub type Advance = fn(&Net, &mut State, [f32; 3]) -> Step;

/// [`digest`] of the form for the Cortex-M4F.
pub fn digest_m4() -> u64 {
    use kernel::m4::{step, step_descend, step_gradient};
    digest(4, step, step_gradient, step_descend)
}

/// [`digest`] of the form for the Cortex-M7.
pub fn digest_m7() -> u64 {
    use kernel::m7::{step, step_descend, step_gradient};
    digest(7, step, step_gradient, step_descend)
}

/// The digest of the portable network, with the seed of either form: 4 or 7.
pub fn digest_portable(seed: u64) -> u64 {
    digest(
        seed,
        |net, state, input| net.step(state, input),
        |net, state, sens, input| net.step_gradient(state, sens, input),
        |net, state, sens, input, target, rate| net.step_descend(state, sens, input, target, rate),
    )
}

/// Results, states, sensitivities and weights of all steps.
pub fn digest(seed: u64, step: Advance, differentiate: Differentiate, descend: Descend) -> u64 {
    let (mut digest, mut random) = (Digest::new(), Random(seed));
    let mut sens = Sensitivities::new();
    for index in 0..NETS {
        let wild = index % 3 == 2;
        let mut net = net(&mut random, wild);
        let (mut state, mut plain) = (State::new(), State::new());
        sens.reset();
        for k in 0..STEPS {
            let input = [(); 3].map(|()| input(&mut random, wild));
            feed(&mut digest, &step(&net, &mut plain, input));
            let found = if k % 2 == 0 {
                differentiate(&net, &mut state, &mut sens, input)
            } else {
                descend(&mut net, &mut state, &mut sens, input, &[0.25; 3], 0.0625)
            };
            plain = state;
            feed(&mut digest, &found);
            digest.numbers(state.layers().iter().flatten().copied());
            for theta in [0, 3, 8, 9, 17, 18, 20, 21, 30, 41, 42, 50, 52, 62] {
                digest.numbers(sens.output().iter().map(|row| row[theta]));
            }
            if k % 8 == 7 {
                digest.numbers(sens.output().iter().flatten().copied());
                digest.numbers(net.weights.iter());
            }
        }
    }
    digest.value()
}

fn net(random: &mut Random, wild: bool) -> Net {
    let normalisation = Normalisation {
        input_offset: [(); 3].map(|()| random.within(0.5)),
        input_scale: [(); 3].map(|()| random.within(4.0)),
        output_scale: [(); 3].map(|()| random.within(1e-3)),
    };
    // An extreme network has a weight of any size in one of eight: steps and sensitivities
    // overflow.
    let weight = |_| match random.next() % 8 {
        0 if wild => random.any(),
        1 if wild => random.within(1e6),
        _ => random.within(1.0),
    };
    Net::new(Weights::from_fn(weight), normalisation)
}

fn input(random: &mut Random, wild: bool) -> f32 {
    match random.next() % 32 {
        0 if wild => random.any(),
        1 => random.within(100.0),
        2 => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX][random.next() as usize % 4],
        _ => random.within(2.0),
    }
}

/// The upper half of a 64-bit linear congruential generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    /// Up to +-`limit`.
    fn within(&mut self, limit: f32) -> f32 {
        limit * ((self.next() >> 8) as f32 / (1 << 23) as f32 - 1.0)
    }

    /// Any bits: also infinite, NaN, subnormal.
    fn any(&mut self) -> f32 {
        f32::from_bits(self.next())
    }
}
