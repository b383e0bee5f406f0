//! One network that learns at each step: its flash, and whether anything in it can panic.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod program {
    use core::hint::black_box;

    use alone::machine::exit;
    use lrnn_nostd::{Net, Normalisation, Sensitivities, State, Weights};

    #[allow(unsafe_code, reason = "nothing else has this name")]
    #[unsafe(no_mangle)]
    extern "C" fn main() -> ! {
        let mut net: Net = Net::new(
            black_box(Weights::zero()),
            black_box(Normalisation::identity()),
        );
        let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());
        let (input, target, rate) = black_box(([0.0; 3], [0.0; 3], 1e-3));
        let step = net.step_descend(&mut state, &mut sensitivities, input, &target, rate);
        exit(black_box(step).fault.is_none())
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("this is a program for QEMU; `cargo xtask alone` runs it");
}
