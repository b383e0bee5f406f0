//! The record of a crash.
//!
//! Faults of the core, a panic and the entries of a board ([`entry`]) leave a record in RAM that
//! nothing initialises ([`Retained`]) and restart the board. Nothing here can panic.
//!
//! The entries first move the stack pointer to the top of the stack: after an overflow there is no
//! stack to run on, and nobody returns to what was there. What the core has stacked is read before,
//! if the stack pointer is within the stack. If it is not, the stack has overflowed; so it has if
//! the bus fault is just below it ([`overflowed`]).
#![allow(
    unsafe_code,
    reason = "memory over a reset; each block says why it is sound"
)]

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU8, Ordering};

use cortex_m::peripheral::SCB;
use firmware::app::guard::retained::{Retained, WORDS, phase};
use firmware::wire::command::{Crash, CrashKind, LoopPhase};

// SAFETY: nothing is loaded into this section and nothing zeroes it (`link.x`), which suits
// `MaybeUninit`. Any bits are good words. A line of a Cortex-M7's cache holds nothing else of it.
#[unsafe(link_section = ".uninit.kept")]
static mut KEPT: MaybeUninit<Words> = MaybeUninit::uninit();

#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Words([u32; WORDS]);

static PHASE: AtomicU8 = AtomicU8::new(LoopPhase::Starting as u8);
static UNHEALTHY: AtomicU8 = AtomicU8::new(0);

/// A phase begins.
pub fn during(phase: LoopPhase) {
    PHASE.store(phase as u8, Ordering::Relaxed);
}

/// The phase of the main thread that the frame path interrupts, for [`resume`].
pub fn interrupted() -> u8 {
    PHASE.load(Ordering::Relaxed)
}

/// The main thread goes on with this phase.
pub fn resume(phase: u8) {
    PHASE.store(phase, Ordering::Relaxed);
}

/// Why the watchdog is not fed, for the record: bits of `unwell`.
pub fn unhealthy(bits: u8) {
    UNHEALTHY.store(bits, Ordering::Relaxed);
}

/// What survived the reset.
pub fn words() -> [u32; WORDS] {
    let place = (&raw const KEPT).cast::<Words>();
    // SAFETY: aligned and in RAM, and any bits are good words. Volatile, since they come from
    // before the start. Only the frame path and the entries below use it, which do not return.
    unsafe { place.read_volatile() }.0
}

/// Stores what survives the next reset.
pub fn save_retained(retained: &Retained) {
    let place = (&raw mut KEPT).cast::<Words>();
    // SAFETY: as in `words`.
    unsafe { place.write_volatile(Words(retained.words())) };
    #[cfg(feature = "m7")]
    // SAFETY: maintenance by address, which keeps what memory means: a reset forgets the cache.
    unsafe { cortex_m::Peripherals::steal() }
        .SCB
        .clean_dcache_by_address(place as usize, size_of::<Words>());
}

/// Whether a precise bus fault was just below the stack (PM0214 section 4.4.2): what has overflowed
/// was a push of more than the 32 bytes that the core then stacked without an error.
fn overflowed(scb: &cortex_m::peripheral::scb::RegisterBlock) -> bool {
    const LARGEST_PUSH: u32 = 128; // vpush {d0-d15}
    const PRECISE: u32 = 0x8200; // BFARVALID, PRECISERR
    let bottom = (&raw const _stack_end) as u32;
    let below = bottom.wrapping_sub(scb.bfar.read());
    scb.cfsr.read() & PRECISE == PRECISE && (1..=LARGEST_PUSH).contains(&below)
}

/// Stores the record of a crash and restarts the board. `kind`: as the entries count them;
/// `frame`: PSR, LR and PC, 0 where unknown.
pub fn record(kind: u32, [xpsr, lr, pc]: [u32; 3], uptime_ms: u32) -> ! {
    // SAFETY: reading these registers does nothing.
    let scb = unsafe { &*SCB::PTR };
    let kind = match kind {
        0 if overflowed(scb) => CrashKind::StackOverflow,
        0 => CrashKind::Fault,
        1 => CrashKind::StackOverflow,
        2 => CrashKind::ClockStopped,
        3 => CrashKind::NotFed,
        _ => CrashKind::Panic,
    };
    let crash = Crash {
        kind,
        phase: phase(PHASE.load(Ordering::Relaxed)),
        unwell: UNHEALTHY.load(Ordering::Relaxed),
        pc,
        lr,
        xpsr,
        cfsr: scb.cfsr.read(),
        hfsr: scb.hfsr.read(),
        mmfar: scb.mmfar.read(),
        bfar: scb.bfar.read(),
        uptime_ms,
        number: 0,
        starts: 0,
    };
    let retained = Retained::from_words(&words()).unwrap_or_default();
    save_retained(&retained.crashed(crash));
    SCB::sys_reset()
}

unsafe extern "C" {
    /// Bottom of the stack.
    pub static _stack_end: u32;
    /// Top of the stack.
    pub static _stack_start: u32;
}

/// An entry of the core: reads the frame that it has stacked (Armv7-M B1.5.6), if the stack pointer
/// is within the stack, and goes on from the top of the stack with the board's `crashed(kind, xpsr,
/// lr, pc)`. The core pushes 32 bytes even where it cannot (PM0214 section 4.4), so an overflow
/// leaves the stack pointer below the stack, unless those just fit. `first`: instructions before.
#[allow(unused_macros, reason = "a board without a record of crashes")]
macro_rules! entry {
    (
        $(#[$attribute:meta])* $visible:vis $name:ident, $kind:literal
        $(, first: $($first:literal),+; $symbol:ident = $of:path)?
    ) => {
        $(#[$attribute])*
        #[unsafe(naked)]
        $visible unsafe extern "C" fn $name() {
            core::arch::naked_asm!(
                $($($first,)+)?
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
                $($symbol = sym $of,)?
            )
        }
    };
}
#[allow(unused_imports, reason = "as above")]
pub(crate) use entry;
