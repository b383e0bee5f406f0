//! Inference alone. No function of this image may panic (`budgets.toml`).
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use core::hint::black_box;

    use lrnn_nostd::{Net, Normalisation, Rational, Sensitivities, State, Tanh, Weights};

    // The optimiser does not know weights, scales and inputs, so every existing path is reachable.
    let weights: Weights = black_box(Weights::zero());
    let normalisation: Normalisation = black_box(Normalisation::identity());
    let rational: Net<Rational> = Net::new(weights, normalisation);
    let tanh: Net<Tanh> = Net::new(weights, normalisation);
    let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
    let mut good = true;
    for _ in 0..black_box(3) {
        let steps = [
            rational.step(&mut state, black_box([0.0; 3])),
            tanh.step(&mut state, black_box([0.0; 3])),
            rational.step_gradient(&mut state, &mut sensitivities, black_box([0.0; 3])),
            tanh.step_gradient(&mut state, &mut sensitivities, black_box([0.0; 3])),
        ];
        good &= black_box(steps).iter().all(|step| step.fault.is_none());
    }
    qemu::target::exit(good)
}

#[cfg(not(target_os = "none"))]
fn main() {
    qemu::only_in_qemu();
}
