//! The record of a crash, and why the board started.
//!
//! Faults of the core, the stopped crystal (NMI) and the window watchdog's early interrupt end
//! here. They leave a record in RAM that nothing initialises ([`Kept`]) and start the board anew.
//!
//! The entries first move the stack pointer to the top of the stack: after an overflow there is no
//! stack to run on, and nobody returns to what was there. What the core has stacked is read before,
//! if the stack pointer is within the stack. If it is not, the stack has overflowed.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, Ordering};

use cortex_m::peripheral::SCB;
use firmware::app::guard::kept::{Kept, WORDS, phase};
use firmware::wire::command::{Crash, CrashKind, LoopPhase, cause};
use stm32f4::stm32f405::RCC;

use super::{counter, watchdog};

// SAFETY: nothing is loaded into this section and nothing zeroes it (`link.x`), which suits
// `MaybeUninit`. Any bits are good words.
#[unsafe(link_section = ".uninit.kept")]
static mut KEPT: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

/// What the frame path is doing.
static PHASE: AtomicU8 = AtomicU8::new(LoopPhase::Starting as u8);

/// The frame path begins with this.
pub fn during(phase: LoopPhase) {
    PHASE.store(phase as u8, Ordering::Relaxed);
}

/// What the main thread does at this moment, for [`resume`].
pub fn interrupted() -> u8 {
    PHASE.load(Ordering::Relaxed)
}

/// The main thread goes on with that.
pub fn resume(phase: u8) {
    PHASE.store(phase, Ordering::Relaxed);
}

/// What is kept.
pub fn words() -> [u32; WORDS] {
    let place = (&raw const KEPT).cast::<[u32; WORDS]>();
    // SAFETY: aligned and in RAM, and any bits are good words. Volatile, since they come from
    // before the start. Only the frame path and the entries below use it, which do not return.
    unsafe { place.read_volatile() }
}

/// Keeps this.
pub fn keep(kept: &Kept) {
    let place = (&raw mut KEPT).cast::<[u32; WORDS]>();
    // SAFETY: as in `words`.
    unsafe { place.write_volatile(kept.words()) };
}

/// What the chip says of its last reset, which is cleared for the next one (RM0090 7.3.21).
pub fn causes(rcc: &RCC) -> u8 {
    let csr = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    rcc.csr().modify(|_, w| w.rmvf().clear_bit());
    [
        (csr.borrstf().bit_is_set(), cause::BROWN_OUT),
        (csr.padrstf().bit_is_set(), cause::PIN),
        (csr.porrstf().bit_is_set(), cause::POWER_ON),
        (csr.sftrstf().bit_is_set(), cause::SOFTWARE),
        (csr.wdgrstf().bit_is_set(), cause::WATCHDOG),
        (csr.wwdgrstf().bit_is_set(), cause::WINDOW),
        (csr.lpwrrstf().bit_is_set(), cause::LOW_POWER),
    ]
    .into_iter()
    .fold(0, |bits, (is, bit)| if is { bits | bit } else { bits })
}

/// Takes the record and starts anew.
extern "C" fn crashed(kind: u32, xpsr: u32, lr: u32, pc: u32) -> ! {
    let kind = match kind {
        0 => CrashKind::Fault,
        1 => CrashKind::StackOverflow,
        2 => CrashKind::ClockStopped,
        3 => CrashKind::NotFed,
        _ => CrashKind::Panic,
    };
    // SAFETY: reading these registers does nothing.
    let scb = unsafe { &*SCB::PTR };
    let crash = Crash {
        kind,
        phase: phase(PHASE.load(Ordering::Relaxed)),
        unwell: watchdog::unwell(),
        pc,
        lr,
        xpsr,
        cfsr: scb.cfsr.read(),
        hfsr: scb.hfsr.read(),
        mmfar: scb.mmfar.read(),
        bfar: scb.bfar.read(),
        uptime_ms: (counter::now_us() / 1000) as u32,
        number: 0,
        starts: 0,
    };
    let kept = Kept::from_words(&words()).unwrap_or_default();
    keep(&kept.crashed(crash));
    SCB::sys_reset()
}

/// A panic.
pub fn panicked() -> ! {
    crashed(4, 0, 0, 0)
}

/// An entry of the core: reads the frame that it has stacked (Armv7-M B1.5.6), if the stack pointer
/// is within the stack, and goes on from the top of the stack. The core pushes 32 bytes even where
/// it cannot (PM0214 section 4.4), so an overflow always leaves the stack pointer below the stack.
macro_rules! entry {
    ($(#[$attribute:meta])* $visible:vis $name:ident, $kind:literal) => {
        $(#[$attribute])*
        #[unsafe(naked)]
        $visible unsafe extern "C" fn $name() {
            core::arch::naked_asm!(
                "mrs r0, msp",
                "ldr r1, ={bottom}",
                "cmp r0, r1",
                "blo 1f",
                "ldr r1, ={top}",
                "mov sp, r1",
                "subs r1, #32",
                "cmp r0, r1",
                "bhi 1f",
                "ldr r1, [r0, #28]",
                "ldr r2, [r0, #20]",
                "ldr r3, [r0, #24]",
                concat!("movs r0, #", $kind),
                "b {crashed}",
                "1:",
                "ldr r1, ={top}",
                "mov sp, r1",
                "movs r0, #1",
                "movs r1, #0",
                "movs r2, #0",
                "movs r3, #0",
                "b {crashed}",
                bottom = sym _stack_end,
                top = sym _stack_start,
                crashed = sym crashed,
            )
        }
    };
}

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

entry!(
    /// A fault of the core. Faults of memory, bus and usage are not enabled by themselves and come
    /// here, too.
    // SAFETY: `cortex-m-rt` expects this name, and nothing else in the image has it.
    #[unsafe(no_mangle)]
    HardFault, 0
);
entry!(
    /// The crystal has stopped (RM0090 7.2.7), and the core continues on the internal oscillator
    /// with wrong bit rates: it starts anew without the crystal.
    // SAFETY: as above.
    #[unsafe(no_mangle)]
    NonMaskableInt, 2
);
entry!(
    /// The window watchdog is about to bite.
    pub wwdg, 3
);
