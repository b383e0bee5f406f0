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
use firmware::app::{Job, Stores};
use firmware::learn::exchange::Background;
use firmware::store::{Progress, Store};

/// A store on any flash.
trait Carries {
    fn carry_out(&mut self, job: &Job, background: Option<&Background>) -> Progress;
}

impl<F: NorFlash> Carries for Store<F> {
    fn carry_out(&mut self, job: &Job, background: Option<&Background>) -> Progress {
        let content = job.content(background.map(Background::learner));
        Store::carry_out(self, job.step, &content)
    }
}

/// What the frame path hands over when it begins.
struct Thread {
    background: Option<Background<'static>>,
    stores: Stores<'static>,
    store: Option<&'static mut dyn Carries>,
}

// SAFETY: whoever makes one has no other way to what is in it and hands it over whole. The drivers
// of the flash are bound to no priority.
unsafe impl Send for Thread {}

static HANDED: Mutex<CriticalSectionRawMutex, RefCell<Option<Thread>>> =
    Mutex::new(RefCell::new(None));

/// Time asleep, microseconds.
static ASLEEP_US: Mutex<CriticalSectionRawMutex, Cell<u64>> = Mutex::new(Cell::new(0));

/// The main thread has the learner and the store from now on.
///
/// # Safety
/// The store stays where it is, and is not used by the caller any more.
pub unsafe fn hand_over<F: NorFlash>(
    background: Option<Background<'static>>,
    stores: Stores<'static>,
    store: &mut Option<Store<F>>,
) {
    let store = store.as_mut().map(|store| {
        let store: *mut (dyn Carries + '_) = store;
        // SAFETY: the caller keeps it where it is, for ever, and leaves it alone.
        unsafe { &mut *core::mem::transmute::<*mut (dyn Carries + '_), *mut dyn Carries>(store) }
    });
    HANDED.lock(|handed| {
        handed.replace(Some(Thread {
            background,
            stores,
            store,
        }))
    });
}

/// How long the processor has slept, microseconds.
pub fn asleep_us() -> u64 {
    ASLEEP_US.lock(Cell::get)
}

/// The main thread, for ever.
pub fn run() -> ! {
    let mut thread = None;
    loop {
        if thread.is_none() {
            thread = HANDED.lock(|handed| handed.borrow_mut().take());
        }
        if !thread.as_mut().is_some_and(Thread::turn) {
            sleep(|| !thread.as_ref().is_some_and(Thread::waits));
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
            let us = before.elapsed().as_micros();
            ASLEEP_US.lock(|asleep| asleep.set(asleep.get().wrapping_add(us)));
        }
    });
}

impl Thread {
    /// False: nothing was to be done.
    fn turn(&mut self) -> bool {
        let Self {
            background,
            stores,
            store,
        } = self;
        let learned = background.as_mut().is_some_and(Background::turn);
        let stored = stores.turn(|job| match store {
            Some(store) => store.carry_out(job, background.as_ref()),
            None => Progress::Failed,
        });
        learned || stored
    }

    fn waits(&self) -> bool {
        self.background.as_ref().is_some_and(Background::waits) || self.stores.waits()
    }
}
