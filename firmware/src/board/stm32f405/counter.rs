//! Timer 2 counts microseconds in 32 bits (RM0090 section 18), also while the core stands still.

use stm32f4::stm32f405::{RCC, TIM2};

use super::clock::Clocks;
use crate::shared::time::Free;

static FREE: Free = Free::new();

/// Starts it.
pub fn start(rcc: &RCC, timer: &TIM2, clocks: &Clocks) {
    rcc.apb1enr().modify(|_, w| w.tim2en().set_bit());
    let psc = (clocks.timer1() / 1_000_000).saturating_sub(1);
    timer.psc().write(|w| w.psc().set(psc as u16));
    timer.arr().write(|w| w.arr().set(u32::MAX));
    timer.egr().write(|w| w.ug().set_bit()); // takes the prescaler over
    timer.cr1().write(|w| w.cen().set_bit());
}

/// Its count, microseconds, which turns over.
pub fn low() -> u32 {
    // SAFETY: reading the count does nothing.
    unsafe { &*TIM2::ptr() }.cnt().read().bits()
}

/// Time since [`start`], microseconds.
pub fn now_us() -> u64 {
    FREE.now_us(low)
}
