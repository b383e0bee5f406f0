//! What the boards over third-party drivers share: the loop of [`firmware::app::run`] in a task,
//! serial lines, flash, USB, an ADIS, memory.
//!
//! A board is a manifest, a memory map and a function that opens its peripherals and calls [`run`],
//! which [`main!`] runs above the main thread.
//! docs/add-a-board.md goes through one.
//!
//! What these boards do not have, and the board `stm32f405` has: cut-through, an interrupt with a
//! frame's last byte, the measured crystal, a window watchdog, an image without code that can panic
//! (docs/BOARDS.md). What the STM32s have, and the others do not: an ADIS by DMA, the time pulse, a
//! record of a crash and a safe start.
#![no_std]

pub mod adis;
#[allow(dead_code, reason = "an image without a learner")]
#[path = "../../../src/board/shared/blackbox.rs"]
pub mod blackbox;
#[cfg(feature = "stm32")]
#[allow(
    unsafe_code,
    reason = "memory over a reset, entries of the core; each block says why it is sound"
)]
mod crash;
#[cfg(not(feature = "stm32"))]
#[path = "no_crash.rs"]
mod crash;
#[cfg(feature = "stm32")]
pub mod crystal;
#[cfg(feature = "stm32")]
pub mod dma;
pub mod flash;
#[path = "../../../src/board/shared/learners.rs"]
pub mod learners;
pub mod line;
#[cfg(feature = "rp")]
pub mod pio;
#[cfg(feature = "stm32")]
pub mod pulse;
#[cfg(feature = "rng")]
pub mod random;
#[cfg(feature = "stm32")]
#[allow(dead_code, reason = "the board `stm32f405` uses more of it")]
#[path = "../../../src/board/shared/crash.rs"]
mod record;
mod run;
#[cfg(feature = "stm32")]
pub mod spi;
#[allow(
    unsafe_code,
    reason = "what the frame path hands to the main thread; each block says why it is sound"
)]
pub mod thread;
#[cfg(any(feature = "rp", feature = "usb"))]
pub mod through;
pub mod update;
#[cfg(feature = "usb")]
pub mod usb;

pub use cortex_m_rt;
pub use embassy_executor;
pub use firmware;

pub use adis::{Adis, NoAdis, Source};
pub use run::{Board, run, run_updatable};

#[cfg(not(feature = "stm32"))]
use cortex_m::peripheral::SCB;
use defmt_rtt as _;
use firmware::learn::FixMemory;
use static_cell::ConstStaticCell;

/// The watchdog bites when it was not fed for so long, ms: longer than erasing a part of the store
/// takes, which halts most of these chips. The oscillator of an STM32F4 or F7 has 17 to 47 kHz for
/// 32 (their data sheets), so it takes 6.8 to 18.8 s.
pub const WATCHDOG_MS: u32 = if cfg!(feature = "stm32") {
    10_000
} else {
    8000
};

/// `main` of a board: runs the async function `$path` in an executor of the interrupt `$irq`, which
/// the chip does not use and which gets the lowest priority, and the learner and the store in the
/// main thread. `$hal` is the crate of drivers, `$lowest` its name of that priority.
#[macro_export]
macro_rules! main {
    ($path:ident, $hal:ident, $irq:ident, $lowest:ident) => {
        static EXECUTOR: $crate::embassy_executor::InterruptExecutor =
            $crate::embassy_executor::InterruptExecutor::new();

        // SAFETY: the interrupt table has a weak entry of this name, and nothing else defines it.
        #[unsafe(no_mangle)]
        extern "C" fn $irq() {
            // SAFETY: this is the interrupt's handler, and it comes only after `start`.
            unsafe { EXECUTOR.on_interrupt() }
        }

        #[embassy_executor::task]
        async fn path() {
            $path().await;
        }

        #[embassy_executor::task]
        async fn begin() {
            // SAFETY: the executor's own context.
            let spawner = unsafe { embassy_executor::Spawner::for_current_executor() }.await;
            spawner.spawn(path().expect("one such task"));
        }

        #[$crate::cortex_m_rt::entry]
        fn main() -> ! {
            use $hal::interrupt::{InterruptExt, Priority};
            $hal::interrupt::$irq.set_priority(Priority::$lowest);
            let spawner = EXECUTOR.start($hal::interrupt::$irq);
            spawner.spawn(begin().expect("one such task"));
            $crate::thread::run()
        }
    };
}

/// Memory that is handed out once, of so many bytes.
#[macro_export]
macro_rules! bytes {
    ($len:expr) => {{
        static BYTES: $crate::StaticBytes<{ $len }> = $crate::StaticBytes::new([0; $len]);
        BYTES.take()
    }};
}

/// Of [`bytes!`].
pub type StaticBytes<const N: usize> = ConstStaticCell<[u8; N]>;

/// The learner from references and from fixes.
///
/// # Panics
/// It has been handed out.
pub fn whole_learner() -> &'static mut learners::Combined {
    static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::ZEROED);
    learners::combined(|| FIXES.try_take()).expect("called once")
}

/// The learner from references, for chips without room for the other.
///
/// # Panics
/// It has been handed out.
pub fn small_learner() -> &'static mut firmware::learn::WindowLearner {
    learners::windows().expect("called once")
}

/// Turns the caches of a Cortex-M7 on. Region 0 of the MPU keeps what DMA reads and writes out of
/// the data cache (normal memory, not cacheable; Armv7-M B3.5); [`flash::Region`] looks after the
/// flash. Called before anything else.
#[cfg(feature = "m7")]
#[allow(unsafe_code, reason = "the registers of the MPU")]
pub fn turn_caches_on() {
    const VALID: u32 = 1 << 4;
    const NO_CODE: u32 = 1 << 28;
    const READ_AND_WRITE: u32 = 0b011 << 24;
    const NOT_CACHED: u32 = 0b001 << 19;
    const ENABLE: u32 = 1;
    const DEFAULT_ELSEWHERE: u32 = 1 << 2;
    let Some(mut core) = cortex_m::Peripherals::take() else {
        return;
    };
    let (begin, bits) = dma::region();
    // SAFETY: the region is as long as it is aligned, and what is there stays readable and writable
    // for the core. The cache is off, so it holds nothing of it.
    unsafe {
        core.MPU.rbar.write(begin | VALID);
        let size = (bits - 1) << 1;
        let attributes = NO_CODE | READ_AND_WRITE | NOT_CACHED;
        core.MPU.rasr.write(attributes | size | ENABLE);
        core.MPU.ctrl.write(DEFAULT_ELSEWHERE | ENABLE);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

/// The drivers of these boards can panic. The chip restarts.
#[panic_handler]
fn panic(what: &core::panic::PanicInfo) -> ! {
    if let Some(place) = what.location() {
        defmt::println!("panic: {=str}, line {=u32}", place.file(), place.line());
    }
    crash::panicked()
}

/// A fault of the core: the chip restarts.
#[cfg(not(feature = "stm32"))]
#[allow(
    unsafe_code,
    reason = "the attribute asks for it; nothing here needs it"
)]
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    SCB::sys_reset()
}
