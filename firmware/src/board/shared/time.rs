//! Time since start: SysTick, once a millisecond.

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
        milliseconds.set(milliseconds.get() + 1);
    });
    super::wake::wake();
}

/// The board's clock. It also wakes the main loop at least once a millisecond.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    ticks_per_ms: NonZeroU32,
    asleep_ticks: u64,
}

impl Time {
    /// Starts SysTick on a core of `core_hz`.
    pub fn start(mut syst: SYST, core_hz: u32) -> Self {
        let ticks_per_ms = NonZeroU32::new(core_hz / 1000).unwrap_or(NonZeroU32::MIN);
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(ticks_per_ms.get() - 1);
        syst.clear_current();
        syst.enable_counter();
        syst.enable_interrupt();
        Self {
            ticks_per_ms,
            asleep_ticks: 0,
        }
    }

    /// The main loop has slept for so many ticks.
    pub fn slept(&mut self, ticks: u32) {
        self.asleep_ticks += u64::from(ticks);
    }
}

impl Clock for Time {
    fn now_us(&self) -> u64 {
        interrupt::free(|cs| {
            let mut left = SYST::get_current();
            let mut milliseconds = MILLISECONDS.borrow(cs).get();
            if SCB::is_pendst_pending() {
                // It ran out, and the handler waits for this section: read again, now after that.
                left = SYST::get_current();
                milliseconds += 1;
            }
            let last = self.ticks_per_ms.get() - 1;
            let run = last - left.min(last);
            milliseconds * 1000 + u64::from(run * 1000 / self.ticks_per_ms)
        })
    }

    fn asleep_us(&self) -> Option<u64> {
        Some(self.asleep_ticks * 1000 / NonZeroU64::from(self.ticks_per_ms))
    }
}
