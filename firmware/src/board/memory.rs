//! Memory of what learns: static, since it is too large to be moved over the stack.
#![allow(unsafe_code, reason = "one static that is handed out once")]

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, Ordering};

use firmware::learn::WindowLearner;

/// Handed out once.
struct Once(UnsafeCell<WindowLearner>, AtomicBool);

// SAFETY: the flag lets one caller have the contents, and never another.
unsafe impl Sync for Once {}

static LEARNER: Once = Once(
    UnsafeCell::new(WindowLearner::new()),
    AtomicBool::new(false),
);

/// The learner; `None` when it has been handed out.
pub fn learner() -> Option<&'static mut WindowLearner> {
    if LEARNER.1.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: the flag was clear, so no other reference exists or will.
    Some(unsafe { &mut *LEARNER.0.get() })
}
