//! The crystal's frequency, measured against the internal oscillator (RM0090 section 7.2.11).
//!
//! Timer 11 counts the core's clock, which is the internal oscillator's here, and captures every
//! eighth edge of the crystal's clock divided by 31 (sections 19.6.12, TI1_RMP, and 7.3.3, RTCPRE).
//! **Not tested on hardware**, only in a model. Where the chip gives no edges, the crystal counts
//! as not measured, and the value that the firmware was built for is used.

use firmware::app::guard::crystal::measured_khz;
use stm32f4::stm32f405::Peripherals;

use super::clock::soon;

/// The crystal's clock is divided by so much before the timer ...
const DIVIDER: u8 = 31;
/// ... which counts as many edges a capture.
const EDGES: u32 = 8;
/// Intervals between captures: 4 ms of 4 MHz, 0.6 ms of 26 MHz. A tick more or less is 0.04 % of
/// the shortest.
const INTERVALS: u32 = 16;
/// Longest wait for a capture, microseconds: three times that of 4 MHz.
const WAIT_US: u32 = 200;

/// The crystal's frequency, kHz. The core and its buses run on the internal oscillator.
pub fn crystal(peripherals: &Peripherals) -> Option<u32> {
    let Peripherals {
        RCC: rcc,
        TIM11: timer,
        ..
    } = peripherals;
    // SAFETY: five bits; RM0090 7.3.3 allows 2 to 31. The RTC, which it is for, is not used.
    rcc.cfgr()
        .modify(|_, w| unsafe { w.rtcpre().bits(DIVIDER) });
    rcc.apb2enr().modify(|_, w| w.tim11en().set_bit());
    // SAFETY: two bits; 10: channel 1 is HSE_RTC.
    timer.or().write(|w| unsafe { w.rmp().bits(0b10) });
    timer.arr().write(|w| w.arr().set(u16::MAX));
    timer.ccmr1_input().write(|w| {
        // SAFETY: two bits each; 01: channel 1 is an input from its own source, 11: every eighth
        // edge.
        unsafe { w.cc1s().bits(0b01).ic1psc().bits(0b11) }
    });
    timer.ccer().write(|w| w.cc1e().set_bit());
    timer.cr1().write(|w| w.cen().set_bit());
    let capture = || {
        let came = soon(WAIT_US, || timer.sr().read().cc1if().bit_is_set());
        let at = timer.ccr1().read().ccr().bits(); // clears the flag
        let lost = timer.sr().read().cc1of().bit_is_set();
        (came && !lost).then_some(at)
    };
    let ticks = capture().and_then(|first| {
        let mut sum = 0u32;
        let mut last = first;
        for _ in 0..INTERVALS {
            let at = capture()?;
            sum = sum.saturating_add(at.wrapping_sub(last).into());
            last = at;
        }
        Some(sum)
    });
    timer.cr1().reset();
    timer.ccer().reset();
    rcc.apb2enr().modify(|_, w| w.tim11en().clear_bit());
    measured_khz(u32::from(DIVIDER) * EDGES * INTERVALS, ticks?)
}
