//! What target programs need: output, exit code, panic, files, the instruction counter.
#![allow(
    unsafe_code,
    reason = "semihosting calls and the interrupt table; each block says why it is sound"
)]

#[path = "../../../../firmware/src/board/stm32f405/ccm.rs"]
pub mod ccm;
pub mod counting;
pub mod dma;
pub mod files;
pub mod interrupts;
#[path = "../../../../firmware/src/board/stm32f405/stream.rs"]
pub mod stream;

use cortex_m_semihosting::debug::{self, EXIT_FAILURE, EXIT_SUCCESS};
use cortex_m_semihosting::hio::{self, HostStream};

use firmware::learn::{FixLearner, Learner, Settings};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// The learner, whose matrices are in the same memory as the board's; `None` on a second call.
pub fn learner() -> Option<&'static mut dyn Learner> {
    let learner = FixLearner::new(ccm::learner()?, Settings::MEDIUM);
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

/// Bytes of the stack that were never used: those from its end on that still have the paint of
/// `cortex-m-rt`.
pub fn stack_left() -> usize {
    const PAINT: u32 = 0xcccc_cccc;
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let mut word = &raw const _stack_end;
    let mut left = 0;
    // SAFETY: the two symbols of the linker script bound the stack, which is aligned to words; what
    // lies below the frames in use is memory that nothing else has. A volatile read may return what
    // a frame left there.
    while word < &raw const _stack_start && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
        left += size_of::<u32>();
    }
    left
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
