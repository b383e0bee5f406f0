//! Memory of the learners. It is static, since it is too large to be moved over the stack.

use firmware::app::App;
use firmware::learn::exchange::{Background, Exchange};
use firmware::learn::{CombinedLearner, FixLearner, FixMemory, Settings, WindowLearner};
use static_cell::{ConstStaticCell, StaticCell};

/// The learner from references and from fixes.
pub type Combined = CombinedLearner<'static, WindowLearner, FixLearner<'static>>;

static WINDOWS: ConstStaticCell<WindowLearner> = ConstStaticCell::new(WindowLearner::new());
static COMBINED: StaticCell<Combined> = StaticCell::new();
static EXCHANGE: ConstStaticCell<Exchange> = ConstStaticCell::new(Exchange::new());

/// The application's learner, to be run by itself; `None`: there is none, or it is apart already.
pub fn apart(app: &mut App<'static>) -> Option<Background<'static>> {
    app.split(EXCHANGE.try_take()?)
}

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
        // until the configuration gives others; without one it does not begin
        fixes: FixLearner::new(fixes, Settings::MEDIUM),
    })
}
