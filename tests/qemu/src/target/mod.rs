//! What target programs need: output, exit code, panic, files, the instruction counter.
#![allow(
    unsafe_code,
    reason = "semihosting calls and the interrupt table; each block says why it is sound"
)]

pub mod counting;
pub mod dma;
pub mod files;
pub mod interrupts;
#[path = "../../../../firmware/src/board/stm32f405/stream.rs"]
pub mod stream;

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};

use firmware::learn::{FixLearner, FixMemory, Learner, Settings};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// The learner; `None` when it has been handed out already.
pub fn learner() -> Option<&'static mut dyn Learner> {
    let memory = cortex_m::singleton!(: FixMemory = FixMemory::ZEROED)?;
    let learner = FixLearner::new(memory, Settings::MEDIUM);
    let learner = cortex_m::singleton!(: FixLearner<'static> = learner)?;
    Some(learner)
}

/// Largest value of SysTick.
const LARGEST: u32 = 0x00ff_ffff;

/// Starts the counter behind [`ticks`]; `false` when called a second time.
pub fn start_counter() -> bool {
    let Some(mut peripherals) = cortex_m::Peripherals::take() else {
        return false;
    };
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(LARGEST);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_counter();
    true
}

/// Ticks of SysTick, counting up, modulo 2^24.
#[inline(always)]
pub fn ticks() -> u32 {
    LARGEST - SYST::get_current()
}

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
