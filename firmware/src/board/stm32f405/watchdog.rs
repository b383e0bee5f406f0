//! The independent watchdog: restarts a board whose main loop no longer turns.

use stm32f4::stm32f405::{DBGMCU, IWDG};

/// Ticks of 8 ms (32 kHz / 256): 4 s. This is longer than the longest wait of the loop, the erasure
/// of a 128 KiB flash sector (2 s, DS8626 table 47), even with the oscillator at the fast end of
/// its 17 to 47 kHz.
const TICKS: u16 = 500;

/// Rounds of waiting until a register takes effect: 5 ticks of 32 kHz (RM0090 21.4.4), 26 000
/// cycles at most.
const PATIENCE: u32 = 20_000;

/// The running watchdog. It cannot be stopped.
pub struct Watchdog(IWDG);

impl Watchdog {
    /// Starts it. It stands still while a debugger holds the core.
    pub fn start(iwdg: IWDG, debug: &DBGMCU) -> Self {
        debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
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
        let mut watchdog = Self(iwdg);
        watchdog.feed();
        watchdog
    }

    /// The loop has turned.
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}
