//! Memory of what learns: static, since it is too large to be moved over the stack.
//!
//! The learner from fixes would fit into the core-coupled memory of an STM32F405 ([`firmware::learn::ROOM`]); it is in RAM, where there
//! is room for it, since QEMU 7.2's machine has no such memory.
#![allow(unsafe_code, reason = "two statics that are handed out once")]

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, Ordering};

use firmware::learn::{Both, FixLearner, FixMemory, Settings, WindowLearner};

/// Handed out once.
struct Once<T>(UnsafeCell<T>, AtomicBool);

// SAFETY: the flag lets one caller have the contents, and never another.
unsafe impl<T> Sync for Once<T> {}

impl<T> Once<T> {
    const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value), AtomicBool::new(false))
    }

    #[expect(
        clippy::mut_from_ref,
        reason = "the flag lets one caller have the contents"
    )]
    fn take(&'static self) -> Option<&'static mut T> {
        if self.1.swap(true, Ordering::AcqRel) {
            return None;
        }
        // SAFETY: the flag was clear, so no other reference exists or will.
        Some(unsafe { &mut *self.0.get() })
    }
}

static WINDOWS: Once<WindowLearner> = Once::new(WindowLearner::new());
static FIXES: Once<FixMemory> = Once::new(FixMemory::BLANK);

/// The learner, from references and from fixes; `None` when it has been handed out.
pub fn learner() -> Option<Both<'static, WindowLearner, FixLearner<'static>>> {
    Some(Both {
        references: WINDOWS.take()?,
        fixes: FixLearner::new(FIXES.take()?, Settings::MEDIUM),
    })
}
