//! A network learns the error of a gyro triad on a Cortex-M4F, sample by sample, and becomes the
//! 304 bytes that a device would keep in flash. `cargo run --release` in this folder runs it in
//! QEMU.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use lrnn_nostd::{
    Full, Identity, Net, Normalisation, Rational, Sensitivities, State, Weights, image,
};

/// rad/s in a degree an hour.
const DEG_PER_HOUR: f32 = core::f32::consts::PI / (180.0 * 3600.0);

#[entry]
fn main() -> ! {
    // Rates up to 0.3 rad/s, errors up to 1e-5 rad/s: inputs and outputs of the network are near 1.
    let normalisation = Normalisation {
        input_scale: [3.0; 3],
        output_scale: [1e-5; 3],
        ..Normalisation::identity()
    };
    let weights = Weights::from_fn(|index| 0.02 * (index % 7) as f32 - 0.06);
    let mut net: Net = Net::new(weights, normalisation);
    let (mut state, mut sensitivities) = (State::new(), Sensitivities::new());

    // The gyro's true error: a bias that a reference gives, here 1e-5 rad/s on the first axis.
    let truth = [1e-5, -5e-6, 0.0];
    // The network's own units: error / output_scale.
    let target = [1.0, -0.5, 0.0];
    let mut error = [0.0; 3];
    for sample in 0..4000 {
        let rate = if sample % 200 < 100 { 0.1 } else { -0.1 };
        let input = [rate, 0.0, -rate]; // rad/s, from the gyro
        let step = net.step_descend(&mut state, &mut sensitivities, input, &target, 0.02);
        if step.fault.is_some() {
            fail("a step went wrong");
        }
        error = step.error; // rad/s, to be subtracted from the input
    }
    let [found, wanted] = [error[0], truth[0]].map(|rate| rate / DEG_PER_HOUR);
    hprintln!(
        "{:.2} deg/h of {:.2} found after 4000 samples",
        found,
        wanted
    );
    if (found - wanted).abs() > 0.05 {
        fail("it has not learnt");
    }

    // What it has learnt, as bytes and back.
    let bytes = image::encode(&net);
    match image::decode::<Rational, Identity, Full>(&bytes) {
        Ok(stored) if stored == net => hprintln!("stored in {} bytes", bytes.len()),
        Ok(_) => fail("another network came back"),
        Err(error) => {
            hprintln!("{}", error);
            fail("not stored");
        }
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::wfi();
    }
}

fn fail(why: &str) -> ! {
    hprintln!("{}", why);
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    hprintln!("{}", info);
    fail("a panic")
}
