//! Time since start: a counter of microseconds that the board has, else SysTick. SysTick gives the
//! frame path its turn once a millisecond in both cases.
//!
//! SysTick loses time when the core stands still for more than a millisecond, as it does while
//! flash is erased: it can be pending only once. A free counter goes on, so that the gap is seen.

use core::cell::Cell;
use core::num::{NonZeroU32, NonZeroU64};

use cortex_m::interrupt::{self, Mutex};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use firmware::link::Clock;

static MILLISECONDS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

#[cortex_m_rt::exception]
fn SysTick() {
    interrupt::free(|cs| {
        let milliseconds = MILLISECONDS.borrow(cs);
        milliseconds.set(milliseconds.get().wrapping_add(1));
    });
    super::wake::wake();
}

/// A free counter of 32 bits, extended to 64.
pub struct Free {
    /// The count at the last look, and all of it since start.
    seen: Mutex<Cell<(u32, u64)>>,
}

impl Free {
    /// At zero.
    pub const fn new() -> Self {
        Self {
            seen: Mutex::new(Cell::new((0, 0))),
        }
    }

    /// The time, microseconds; `count` reads the counter, which may turn over once between two
    /// looks: at one megahertz after 71 minutes.
    pub fn now_us(&self, count: impl FnOnce() -> u32) -> u64 {
        interrupt::free(|cs| {
            let seen = self.seen.borrow(cs);
            let (last, all) = seen.get();
            let count = count();
            let all = all.wrapping_add(count.wrapping_sub(last).into());
            seen.set((count, all));
            all
        })
    }
}

/// The board's clock. It also gives the frame path its turn once a millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    /// The time by a counter of the board; `None`: by SysTick.
    free: Option<fn() -> u64>,
    ticks_per_ms: NonZeroU32,
}

impl Time {
    /// Starts SysTick on a core of `core_hz`. `free`: the board's own time, microseconds.
    pub fn start(mut syst: SYST, core_hz: u32, free: Option<fn() -> u64>) -> Self {
        let ticks_per_ms = NonZeroU32::new(core_hz / 1000).unwrap_or(NonZeroU32::MIN);
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(ticks_per_ms.get() - 1);
        syst.clear_current();
        syst.enable_counter();
        syst.enable_interrupt();
        Self { free, ticks_per_ms }
    }

    fn by_systick(&self) -> u64 {
        interrupt::free(|cs| {
            let mut left = SYST::get_current();
            let mut milliseconds = MILLISECONDS.borrow(cs).get();
            if SCB::is_pendst_pending() {
                // It ran out, and the handler waits for this section: read again, now after that.
                left = SYST::get_current();
                milliseconds = milliseconds.wrapping_add(1);
            }
            let last = self.ticks_per_ms.get() - 1;
            let run = last - left.min(last);
            let within = run.wrapping_mul(1000) / self.ticks_per_ms;
            milliseconds.wrapping_mul(1000).wrapping_add(within.into())
        })
    }
}

impl Clock for Time {
    fn now_us(&self) -> u64 {
        self.free.map_or_else(|| self.by_systick(), |free| free())
    }

    fn asleep_us(&self) -> Option<u64> {
        let ticks = super::wake::asleep();
        Some(ticks.wrapping_mul(1000) / NonZeroU64::from(self.ticks_per_ms))
    }
}
