//! Memory of the learners. It is static, since it is too large to be moved over the stack.

use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use static_cell::{ConstStaticCell, StaticCell};

/// The learner from references and from fixes.
pub type Combined = CombinedLearner<'static, WindowLearner, FixLearner<'static>>;

static WINDOWS: ConstStaticCell<WindowLearner> = ConstStaticCell::new(WindowLearner::new());
static COMBINED: StaticCell<Combined> = StaticCell::new();

/// The learner from references; `None` when it has been handed out.
pub fn windows() -> Option<&'static mut WindowLearner> {
    WINDOWS.try_take()
}

/// The learner from references and from fixes, with the board's memory for the latter. `None` when
/// it has been handed out.
///
/// Not inlined, so that the stack it is made on is free again afterwards.
#[inline(never)]
pub fn combined(fixes: fn() -> Option<&'static mut FixMemory>) -> Option<&'static mut Combined> {
    let (fixes, references) = (fixes()?, windows()?);
    COMBINED.try_init_with(|| CombinedLearner {
        references,
        // until the configuration tells others; without one it does not begin
        fixes: FixLearner::new(fixes, Settings::MEDIUM),
    })
}
