//! What every target program needs: output, exit code, panic.

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};

/// Standard output of QEMU.
pub fn output() -> HostStream {
    match hio::hstdout() {
        Ok(stream) => stream,
        Err(()) => exit(false),
    }
}

/// Leaves QEMU with exit code 0 or 1.
pub fn exit(success: bool) -> ! {
    debug::exit(if success { EXIT_SUCCESS } else { EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi(); // only without semihosting
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    use core::fmt::Write;
    let _ = writeln!(output(), "{info}");
    exit(false)
}
