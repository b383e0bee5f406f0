//! Memory of the learners. It is static, since it is too large to be moved over the stack.

use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use static_cell::ConstStaticCell;

static WINDOWS: ConstStaticCell<WindowLearner> = ConstStaticCell::new(WindowLearner::new());
static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::ZEROED);

/// The learner from references; `None` when it has been handed out.
pub fn windows() -> Option<&'static mut WindowLearner> {
    WINDOWS.try_take()
}

/// The learner from references and from fixes. Its fixes are in the memory given, else in RAM.
/// `None` when it has been handed out.
pub fn combined(
    fixes: Option<&'static mut FixMemory>,
) -> Option<CombinedLearner<'static, WindowLearner, FixLearner<'static>>> {
    let fixes = fixes.or_else(|| FIXES.try_take())?;
    Some(CombinedLearner {
        references: windows()?,
        // until the configuration tells others; without one it does not begin
        fixes: FixLearner::new(fixes, Settings::MEDIUM),
    })
}
