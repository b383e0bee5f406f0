//! The record of a crash on an STM32, and why the board started.
//!
//! A panic, a fault of the core, and a loop that no longer turns leave a record in RAM that nothing
//! initialises ([`crate::record`]), and the chip restarts. SysTick looks for the last
//! of them: it bites before the watchdog, which leaves no record. Nothing here can panic.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::syst::SystClkSource;
use embassy_stm32::pac::RCC;
use embassy_stm32::{peripherals, rcc};
use embassy_time::Instant;
use firmware::app::COMMAND_BAUD;
use firmware::app::guard;
use firmware::app::guard::retained::{EARLY_US, Retained};
use firmware::link::rates::Clock;
use firmware::wire::command::{Reset, cause};

use crate::crystal;
pub use crate::record::during;
use crate::record::{_stack_end, _stack_start, entry, record, save_retained, unhealthy, words};

/// The loop has not turned well for so long, ms: longer than erasing a part of the store takes, and
/// shorter than the watchdog waits with its fastest clock.
const LATE_MS: u32 = 6000;
const _: () = assert!(LATE_MS + 500 < crate::WATCHDOG_MS * 32 / 47);
/// Between two looks of SysTick, cycles of the core: as many as it can count, 0.1 s at 168 MHz.
const LOOKS: u32 = 0xFF_FFFF;

/// When the loop turned well, ms.
static TURNED_MS: AtomicU32 = AtomicU32::new(0);

/// The chip's flags of its last reset, by their bits (RM0090 7.3.21; RM0433 8.7.39), and the bit
/// that clears them.
#[cfg(not(feature = "h7"))]
const FLAGS: ([u32; 7], u32) = ([25, 26, 27, 28, 29, 30, 31], 24);
#[cfg(feature = "h7")]
const FLAGS: ([u32; 7], u32) = ([21, 22, 23, 24, 26, 28, 30], 16);

fn causes() -> u8 {
    #[cfg(not(feature = "h7"))]
    let register = RCC.csr();
    #[cfg(feature = "h7")]
    let register = RCC.rsr();
    let (flags, clear) = FLAGS;
    let is = register.read().0;
    register.modify(|w| w.0 |= 1 << clear);
    register.modify(|w| w.0 &= !(1 << clear));
    let causes = [
        cause::BROWN_OUT,
        cause::PIN,
        cause::POWER_ON,
        cause::SOFTWARE,
        cause::WATCHDOG,
        cause::WINDOW,
        cause::LOW_POWER,
    ];
    let set = causes
        .iter()
        .zip(flags)
        .filter(|(_, bit)| is >> bit & 1 != 0);
    set.fold(0, |all, (cause, _)| all | cause)
}

/// Looks after the loop.
#[derive(Debug)]
pub struct Guard {
    /// `None`: the run is no longer an early one.
    retained: Option<Retained>,
    begun: bool,
}

impl Guard {
    /// At start: why, what was kept, and whether the board was switched on. `clock`: of the UART
    /// that has the command link.
    pub fn start(clock: &Clock) -> (Self, Option<Reset>, bool) {
        let causes = causes();
        let (retained, safe) = Retained::started(&words(), causes);
        save_retained(&retained);
        // SAFETY: it is only read, and stands for `embassy_stm32::init` having been called.
        let of = unsafe { peripherals::RCC::steal() };
        let sys: Option<embassy_stm32::time::Hertz> = rcc::clocks(&of).sys.into();
        let (clock_source, crystal) = crystal::found();
        let reset = Reset {
            causes,
            uptime_ms: 0,
            safe,
            clock: clock_source,
            core_hz: sys.map_or(0, |hz| hz.0),
            crystal,
            command_baud: clock.nearest(COMMAND_BAUD).baud,
            brown_out: None,
            supply_low: false,
            reopened: 0,
            crash: retained.crash,
        };
        if let Some(crash) = &retained.crash {
            defmt::println!(
                "crash {=u32}, {=u32} start(s) ago, at {=u32:#x}, CFSR {=u32:#x}",
                crash.number,
                crash.starts,
                crash.pc,
                crash.cfsr
            );
        }
        let looks = Self {
            retained: Some(retained),
            begun: false,
        };
        (looks, Some(reset), causes & cause::POWER_ON != 0)
    }

    /// The loop has turned. `unwell`: why the watchdog is not fed; 0: all is well.
    pub fn turned(&mut self, now_us: u64, unwell: u8) {
        unhealthy(unwell);
        if unwell == 0 {
            TURNED_MS.store((now_us / 1000) as u32, Ordering::Relaxed);
            if !core::mem::replace(&mut self.begun, true) {
                begin();
            }
        }
        if now_us >= EARLY_US
            && let Some(retained) = self.retained.take()
        {
            save_retained(&Retained {
                early: 0,
                ..retained
            });
        }
    }
}

/// SysTick begins to look. The drivers do not use it.
fn begin() {
    // SAFETY: nobody else uses this peripheral.
    let mut systick = unsafe { cortex_m::Peripherals::steal() }.SYST;
    systick.set_clock_source(SystClkSource::Core);
    systick.set_reload(LOOKS);
    systick.clear_current();
    systick.enable_interrupt();
    systick.enable_counter();
}

/// Whether the loop has not turned for too long.
extern "C" fn is_late() -> bool {
    let now = Instant::now().as_millis() as u32;
    guard::is_late(now, TURNED_MS.load(Ordering::Relaxed), LATE_MS)
}

extern "C" fn crashed(kind: u32, xpsr: u32, lr: u32, pc: u32) -> ! {
    record(kind, [xpsr, lr, pc], Instant::now().as_millis() as u32)
}

/// A panic.
pub fn panicked() -> ! {
    crashed(4, 0, 0, 0)
}

entry!(
    /// A fault of the core.
    // SAFETY: `cortex-m-rt` expects this name, and nothing else in the image has it.
    #[unsafe(no_mangle)]
    HardFault, 0
);
entry!(
    /// A look at the loop.
    // SAFETY: as above.
    #[unsafe(no_mangle)]
    SysTick, 3,
    first: "push {{r3, lr}}", "bl {late}", "pop {{r3, lr}}", "cbnz r0, 2f", "bx lr", "2:";
    late = is_late
);
