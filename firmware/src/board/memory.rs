//! Memory of what learns: static, since it is too large to be moved over the stack.

use firmware::learn::WindowLearner;
use static_cell::ConstStaticCell;

static WINDOWS: ConstStaticCell<WindowLearner> = ConstStaticCell::new(WindowLearner::new());

/// The learner from references; `None` when it has been handed out.
pub fn windows() -> Option<&'static mut WindowLearner> {
    WINDOWS.try_take()
}
