//! Two priorities. The frame path has its turn in PendSV, the lowest of the interrupts, which the
//! others trigger. The main thread runs the learner and stores, and sleeps when it has nothing to
//! do.
#![allow(
    unsafe_code,
    reason = "what the main thread makes and PendSV uses; each block says why it is sound"
)]

use core::cell::{Cell, UnsafeCell};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt::{self, Mutex};
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::{SCB, SYST};

/// Below every other interrupt, however many bits a priority has.
const LOWEST: u8 = 0xFF;

/// Ticks of SysTick that the main thread has slept.
static ASLEEP: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// For interrupts: the frame path has its turn when they are served.
#[inline(always)]
pub fn wake() {
    SCB::set_pendsv();
}

/// What the frame path has, for PendSV alone, and whether it is there. All zeros before.
pub struct Frame<T>(UnsafeCell<MaybeUninit<T>>, AtomicBool);

// SAFETY: `start` writes it with interrupts masked. After that only PendSV uses it, which does not
// interrupt itself.
unsafe impl<T> Sync for Frame<T> {}

impl<T> Frame<T> {
    /// Nothing: PendSV does nothing.
    pub const fn new() -> Self {
        Self(
            UnsafeCell::new(MaybeUninit::uninit()),
            AtomicBool::new(false),
        )
    }

    /// PendSV has its turns from now on. Called once.
    #[inline(never)]
    pub fn start(&self, scb: &mut SCB, frame: T) {
        // SAFETY: no critical section relies on its priority, and all of them mask it.
        unsafe { scb.set_priority(SystemHandler::PendSV, LOWEST) };
        interrupt::free(|_| {
            // SAFETY: PendSV does not come meanwhile.
            unsafe { (*self.0.get()).write(frame) };
            self.1.store(true, Ordering::Relaxed);
        });
        wake();
    }

    /// For PendSV alone.
    #[inline(always)]
    pub fn turn(&self, turn: impl FnOnce(&mut T)) {
        if self.1.load(Ordering::Relaxed) {
            // SAFETY: `start` has written it. PendSV does not interrupt itself, and nobody else is
            // here after `start`.
            turn(unsafe { (*self.0.get()).assume_init_mut() });
        }
    }
}

/// For the main thread: sleeps until the next interrupt, if there is still nothing to do.
///
/// The question and the sleep are one step: an interrupt in between stays pending, ends the sleep
/// and is served after it.
pub fn sleep(nothing_to_do: impl Fn() -> bool) {
    interrupt::free(|cs| {
        if nothing_to_do() {
            let asleep = ASLEEP.borrow(cs);
            let ticks = ticks_of(cortex_m::asm::wfi);
            asleep.set(asleep.get().wrapping_add(ticks.into()));
        }
    });
}

/// Ticks of SysTick asleep, interrupts not counted.
pub fn asleep() -> u64 {
    interrupt::free(|cs| ASLEEP.borrow(cs).get())
}

/// Ticks that `asleep` takes, less than the millisecond after which SysTick ends every sleep.
/// Interrupts wait meanwhile.
fn ticks_of(asleep: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    asleep();
    let after = SYST::get_current();
    match before.checked_sub(after) {
        Some(ticks) => ticks,
        None => before + SYST::get_reload() + 1 - after, // it ran out, which woke us
    }
}
