//! The main thread: the learner and the store, which the frame path interrupts.
//!
//! A board's `main` is made by [`main!`](crate::main): it runs the frame path in an executor of an
//! interrupt of the lowest priority, and then this.

use core::cell::{Cell, RefCell};

use cortex_m::interrupt;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::Instant;
use embedded_storage::nor_flash::NorFlash;
use firmware::app::run::{CarriesOut, MainThread};
use firmware::app::{GivesUpdates, Stores, Updates};
use firmware::learn::exchange::Background;
use firmware::store::Store;
use firmware::update::TakesUpdates;

/// What the frame path hands over when it begins.
struct Handed(MainThread<'static, 'static>);

// SAFETY: whoever makes one has no other way to what is in it and hands it over whole. The drivers
// of the flash are bound to no priority.
unsafe impl Send for Handed {}

static HANDED: Mutex<CriticalSectionRawMutex, RefCell<Option<Handed>>> =
    Mutex::new(RefCell::new(None));

/// Time asleep, microseconds.
static ASLEEP_US: Mutex<CriticalSectionRawMutex, Cell<u64>> = Mutex::new(Cell::new(0));

/// The main thread has the learner, the store and what takes updates from now on. Gives the frame
/// path's side of the updates.
///
/// # Safety
/// Store and updater stay where they are, and are not used by the caller any more.
pub unsafe fn hand_over<F: NorFlash, U: TakesUpdates>(
    background: Option<Background<'static>>,
    stores: Stores<'static>,
    store: &mut Option<Store<F>>,
    updater: &mut Option<U>,
    queues: &'static mut Updates,
) -> Option<GivesUpdates<'static>> {
    let store = store.as_mut().map(|store| {
        let store: *mut (dyn CarriesOut + '_) = store;
        // SAFETY: the caller keeps it where it is, for ever, and leaves it alone.
        unsafe {
            &mut *core::mem::transmute::<*mut (dyn CarriesOut + '_), *mut dyn CarriesOut>(store)
        }
    });
    let updater = updater.as_mut().map(|updater| {
        let updater: *mut (dyn TakesUpdates + '_) = updater;
        // SAFETY: as above.
        unsafe {
            &mut *core::mem::transmute::<*mut (dyn TakesUpdates + '_), *mut dyn TakesUpdates>(
                updater,
            )
        }
    });
    let (gives, updates) = updater.map(|updater| queues.split(updater)).unzip();
    let thread = MainThread {
        background,
        stores: Some(stores),
        store,
        updates,
    };
    HANDED.lock(|handed| handed.replace(Some(Handed(thread))));
    gives
}

/// How long the processor has slept, microseconds.
pub fn asleep_us() -> u64 {
    ASLEEP_US.lock(Cell::get)
}

/// The main thread, for ever. Its phases are not recorded: a crash names that of the frame path.
pub fn run() -> ! {
    let mut thread = None;
    loop {
        if thread.is_none() {
            thread = HANDED.lock(|handed| handed.borrow_mut().take());
        }
        let turned = thread
            .as_mut()
            .is_some_and(|Handed(thread)| thread.turn(|_| ()));
        if !turned {
            sleep(|| !thread.as_ref().is_some_and(|Handed(thread)| thread.waits()));
        }
    }
}

/// Until the next interrupt, if there is still nothing to do. The question and the sleep are one
/// step: an interrupt in between stays pending, ends the sleep and is served after it.
fn sleep(nothing_to_do: impl Fn() -> bool) {
    interrupt::free(|_| {
        if nothing_to_do() {
            let before = Instant::now();
            cortex_m::asm::wfi();
            // Time may go back here: `embassy-stm32` 0.6 takes the compare flags that starting its
            // timer has set for half a round (33 ms), so until each next half is served it reads
            // 65 ms less.
            let slept = Instant::now().saturating_duration_since(before);
            let us = slept.as_micros();
            ASLEEP_US.lock(|asleep| asleep.set(asleep.get().wrapping_add(us)));
        }
    });
}
