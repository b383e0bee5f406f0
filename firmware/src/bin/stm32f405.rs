//! Board `stm32f405`: self-test of the arithmetic. It steps the network, its gradient and its learners over the vectors
//! embedded in the image, compares every digest with the one the desktop computed, and leaves through semihosting with
//! exit code 0 when all are equal.
//!
//! The compensation loop (UART in, UART out) is not here yet; until then this image needs QEMU or a debug probe that
//! serves semihosting.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod target {
    use cortex_m_rt::entry;
    use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS, ExitStatus};
    use cortex_m_semihosting::{hio, hprintln};

    #[entry]
    fn main() -> ! {
        let equal = match hio::hstdout() {
            Ok(mut out) => vectors::compare(&vectors::CHECKS, &mut out),
            Err(()) => false,
        };
        leave(if equal { EXIT_SUCCESS } else { EXIT_FAILURE })
    }

    fn leave(status: ExitStatus) -> ! {
        debug::exit(status);
        loop {
            cortex_m::asm::wfi(); // the debugger did not end us
        }
    }

    #[panic_handler]
    fn panic(info: &core::panic::PanicInfo) -> ! {
        hprintln!("{}", info);
        leave(EXIT_FAILURE)
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("stm32f405 is a board binary; run it in QEMU with");
    println!(
        "  cargo run --profile firmware -p firmware --bin stm32f405 --target thumbv7em-none-eabihf"
    );
}
