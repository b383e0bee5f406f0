//! The receiver's time pulse at PB8: timer 4 captures the rising edge (RM0090 section 18.3.5).
//!
//! The timer counts microseconds and stores its count at the edge, so it does not matter when the
//! frame path looks, as long as it does within 65 ms. No interrupt is needed. An edge counts when
//! the line has been high for 3 us, so that a glitch is none. **Not tested on hardware**, only in a
//! model (`tests/qemu/judges/stm32f405.py`). QEMU's timer captures nothing.

use cortex_m::interrupt;
use firmware::link::Clock;
use stm32f4::stm32f405::{Peripherals, TIM4};

use super::clock::Clocks;
use crate::shared::time::Time;

/// Between two looks, microseconds, so that the count at the edge is not of a turn before: the
/// counter has 16 bits.
const MOST_US: u64 = 65_000;

/// Filter of the input: eight looks in a row, at the timer's clock divided by 32 (RM0090 18.4.8).
const FILTER: u8 = 0b1111;

/// The timer, and when it was looked at last, microseconds.
pub struct Pulse {
    looked_us: u64,
}

impl Pulse {
    /// The pin and the timer.
    pub fn open(peripherals: &Peripherals, clocks: &Clocks) -> Self {
        let Peripherals {
            RCC: rcc,
            GPIOB: b,
            TIM4: timer,
            ..
        } = peripherals;
        rcc.ahb1enr().modify(|_, w| w.gpioben().set_bit());
        rcc.apb1enr().modify(|_, w| w.tim4en().set_bit());
        // DS8626 table 9: AF2. An open line is low.
        b.afrh().modify(|_, w| w.afrh8().af2());
        b.pupdr().modify(|_, w| w.pupdr8().pull_down());
        b.moder().modify(|_, w| w.moder8().alternate());
        let psc = (clocks.timer1() / 1_000_000).saturating_sub(1);
        timer.psc().write(|w| w.psc().set(psc as u16));
        timer.arr().write(|w| w.arr().set(u16::MAX));
        timer.ccmr2_input().write(|w| {
            // SAFETY: two and four bits; 01: channel 3 is an input from its own pin.
            unsafe { w.cc3s().bits(0b01).ic3f().bits(FILTER) }
        });
        timer.ccer().write(|w| w.cc3e().set_bit()); // rising edges
        timer.egr().write(|w| w.ug().set_bit()); // takes the prescaler over
        timer.cr1().write(|w| w.cen().set_bit());
        Self { looked_us: 0 }
    }

    /// When the line has risen, if it has since the last look, microseconds.
    pub fn rose(&mut self, time: &Time) -> Option<u64> {
        // SAFETY: after `open` only this function uses the timer, and no interrupt does.
        let timer = unsafe { TIM4::steal() };
        let captured = timer.sr().read().cc3if().bit_is_set();
        let (now, count) = interrupt::free(|_| (time.now_us(), timer.cnt().read().cnt().bits()));
        let before = core::mem::replace(&mut self.looked_us, now);
        if !captured {
            return None;
        }
        let at = timer.ccr3().read().ccr().bits(); // clears the flag
        if timer.sr().read().cc3of().bit_is_set() {
            timer.sr().write(|w| w.cc3of().clear_bit()); // another edge came since
        }
        let since = count.wrapping_sub(at);
        (now.saturating_sub(before) <= MOST_US).then(|| now.saturating_sub(since.into()))
    }
}
