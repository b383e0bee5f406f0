//! Interrupt table, and the handling of a fault of the core: a line in the log, then the program
//! ends.

use cortex_m::peripheral::SCB;
use cortex_m_rt::ExceptionFrame;

unsafe extern "C" {
    /// From `cortex-m-rt`: stays in a loop.
    fn DefaultHandler();
}

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its
// feature `device`; no interrupt is enabled.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); 1] = [DefaultHandler];

/// Every fault of the core arrives here, because the other handlers are not enabled.
#[cortex_m_rt::exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: a read of a register without effect.
    let cause = unsafe { (*SCB::PTR).cfsr.read() };
    defmt::println!(
        "fault at {=u32:#x}, CFSR {=u32:#x}; the works before it count",
        frame.pc(),
        cause
    );
    crate::end(false)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    defmt::println!("panic");
    crate::end(false)
}
