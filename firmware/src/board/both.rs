//! What learns from references and from fixes.
//!
//! The learner from fixes would fit into the core-coupled memory of an STM32F405 ([`firmware::learn::ROOM`]); it is in RAM, where there
//! is room for it, since QEMU 7.2's machine has no such memory.

use firmware::learn::{Both, FixLearner, FixMemory, Settings, WindowLearner};

use static_cell::ConstStaticCell;

use crate::memory;

static FIXES: ConstStaticCell<FixMemory> = ConstStaticCell::new(FixMemory::BLANK);

/// Both; `None` when they have been handed out.
pub fn learner() -> Option<Both<'static, WindowLearner, FixLearner<'static>>> {
    Some(Both {
        references: memory::windows()?,
        fixes: FixLearner::new(FIXES.try_take()?, Settings::MEDIUM),
    })
}
