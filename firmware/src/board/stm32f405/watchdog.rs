//! The watchdogs: they restart a board that is not well.
//!
//! The independent one (RM0090 section 21) has its own oscillator. The window watchdog (section 22)
//! bites within 50 ms, before that its interrupt takes the crash record, and it bites as well when
//! it is fed too early: when the loop turns wildly or the clocks disagree. Both are fed only while
//! the application is well ([`firmware::app::App::unwell`]).

use cortex_m::peripheral::NVIC;
use firmware::app::guard::window::{FULL, OPEN, due_us};
use stm32f4::stm32f405::{DBGMCU, IWDG, Interrupt, RCC, WWDG};

use crate::shared::crash::unhealthy;

/// Ticks of 8 ms (32 kHz / 256): 4 s, and 2.7 s with the oscillator at the fast end of its 17 to 47
/// kHz. This is longer than the longest wait of the loop, the erasure of one 128 KiB flash sector
/// (2 s, DS8626 table 47).
const TICKS: u16 = 500;

/// Rounds of waiting until a register takes effect: 5 ticks of 32 kHz (RM0090 21.4.4), 26 000
/// cycles at most.
const PATIENCE: u32 = 20_000;

/// The running watchdogs.
pub struct Watchdog {
    independent: IWDG,
    window: WWDG,
    /// The window watchdog is to be fed after so long, microseconds.
    due_us: u64,
    /// When it was fed; `None`: it does not run.
    fed_us: Option<u64>,
}

impl Watchdog {
    /// Starts the independent one, which cannot be stopped. Both stand still while a debugger holds
    /// the core.
    pub fn start(iwdg: IWDG, wwdg: WWDG, debug: &DBGMCU, bus_hz: u32) -> Self {
        debug
            .apb1_fz()
            .modify(|_, w| w.dbg_iwdg_stop().set_bit().dbg_wwdg_stop().set_bit());
        iwdg.kr().write(|w| w.key().start());
        iwdg.kr().write(|w| w.key().unlock());
        iwdg.pr().write(|w| w.pr().divide_by256());
        iwdg.rlr().write(|w| w.rl().set(TICKS));
        let taken_over = |_| {
            let status = iwdg.sr().read();
            status.pvu().bit_is_clear() && status.rvu().bit_is_clear()
        };
        // if not, the reset values hold: 0.5 s, which only a slower start would notice
        let _ = (0..PATIENCE).any(taken_over);
        iwdg.kr().write(|w| w.key().feed());
        Self {
            independent: iwdg,
            window: wwdg,
            due_us: due_us(bus_hz),
            fed_us: None,
        }
    }

    /// The loop has turned. `unwell`: why they must not be fed; 0: all is well.
    pub fn turned(&mut self, now_us: u64, unwell: u8) {
        unhealthy(unwell);
        match self.fed_us {
            None if unwell == 0 => self.begin(now_us),
            Some(fed) if unwell == 0 && now_us.saturating_sub(fed) >= self.due_us => {
                self.window.cr().write(|w| w.wdga().enabled().t().set(FULL));
                self.fed_us = Some(now_us);
            }
            _ => {}
        }
        if unwell == 0 {
            self.feed();
        }
    }

    /// The independent one begins anew.
    pub fn feed(&mut self) {
        self.independent.kr().write(|w| w.key().feed());
    }

    /// The window watchdog begins. Its early interrupt is the only one of the highest priority.
    fn begin(&mut self, now_us: u64) {
        rcc().apb1enr().modify(|_, w| w.wwdgen().set_bit());
        self.window.cfr().write(|w| {
            let w = w.wdgtb().div8().ewi().enable();
            w.w().set(OPEN)
        });
        self.window.cr().write(|w| w.wdga().enabled().t().set(FULL));
        self.window.sr().reset();
        self.fed_us = Some(now_us);
        // SAFETY: the handler only takes the record and resets; no critical section relies on a
        // masked interrupt.
        unsafe { NVIC::unmask(Interrupt::WWDG) };
    }

    /// The window watchdog ends, before work that is known to take long. The independent one goes
    /// on, and the next [`Watchdog::turned`] restarts the window. Only a reset of the peripheral
    /// stops it (RM0090 22.3, 7.3.8).
    pub fn long_work(&mut self) {
        if self.fed_us.take().is_some() {
            NVIC::mask(Interrupt::WWDG);
            rcc().apb1rstr().modify(|_, w| w.wwdgrst().set_bit());
            rcc().apb1rstr().modify(|_, w| w.wwdgrst().clear_bit());
        }
    }
}

fn rcc() -> RCC {
    // SAFETY: only the frame path, at priority 0 of its own, changes these registers after start,
    // and no interrupt touches them.
    unsafe { RCC::steal() }
}
