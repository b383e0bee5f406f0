//! What learns from references and from fixes.

use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};

use static_cell::ConstStaticCell;

use crate::memory;

static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::ZEROED);

/// Both, that from fixes in the memory given, else in RAM; `None` when they have been handed out.
pub fn learner(
    fixes: Option<&'static mut FixMemory>,
) -> Option<CombinedLearner<'static, WindowLearner, FixLearner<'static>>> {
    let fixes = fixes.or_else(|| FIXES.try_take())?;
    Some(CombinedLearner {
        references: memory::windows()?,
        fixes: FixLearner::new(fixes, Settings::MEDIUM),
    })
}
