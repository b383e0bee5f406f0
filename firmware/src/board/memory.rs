//! Memory of what learns: static, since it is too large to be moved over the stack.
#![allow(unsafe_code, reason = "statics that are handed out once")]

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, Ordering};

use firmware::learn::WindowLearner;

/// Handed out once.
pub struct Once<T>(UnsafeCell<T>, AtomicBool);

// SAFETY: the flag lets one caller have the contents, and never another.
unsafe impl<T> Sync for Once<T> {}

impl<T> Once<T> {
    /// With these contents.
    pub const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value), AtomicBool::new(false))
    }

    #[expect(
        clippy::mut_from_ref,
        reason = "the flag lets one caller have the contents"
    )]
    /// The contents, the first time.
    pub fn take(&'static self) -> Option<&'static mut T> {
        if self.1.swap(true, Ordering::AcqRel) {
            return None;
        }
        // SAFETY: the flag was clear, so no other reference exists or will.
        Some(unsafe { &mut *self.0.get() })
    }
}

static WINDOWS: Once<WindowLearner> = Once::new(WindowLearner::new());

/// The learner from references; `None` when it has been handed out.
pub fn windows() -> Option<&'static mut WindowLearner> {
    WINDOWS.take()
}
