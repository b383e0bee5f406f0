//! Pins of the serial lines.
//!
//! DS8626 table 9: AF7 is USART1 to USART3, AF8 is UART4. The command link has PA0 and PA1 in every
//! set.
//!
//! | set | sensor | navigation computer | receiver | for |
//! |---|---|---|---|---|
//! | 0 | PB6, PB7 | PA2, PA3 | PB10, PB11 | pyboard 1.1, Olimex STM32-H405 |
//! | 1 | PA9, PA10 | PA2, PA3 | PB10, PB11 | boards that use PB6 and PB7 as an I2C bus |
//! | 2 | PB6, PB7 | PB10, PB11 | PA2, PA3 | Feather STM32F405 |
//!
//! The headers of a Feather STM32F405 have PB6 and PB7 as SCL and SDA, PB10 and PB11 as TX and RX
//! (`docs/wiring.md`). Set 1 is not for boards that use PA9 and PA10 for USB
//! (pyboard). PB6, PB7, PA9, PA10 are USART1, PA2, PA3 USART2, PB10, PB11 USART3.

use stm32f4::stm32f405::{GPIOA, GPIOB, RCC};

/// Sets to choose from.
pub const SETS: u8 = 3;
/// The set with the sensor at PA9 and PA10.
pub const OTHER: u8 = 1;
/// The set in which navigation computer and receiver are exchanged.
pub const EXCHANGED: u8 = 2;

/// The sensor's line at the pins of a set. Pins that it leaves become inputs without pull.
pub fn sensor(set: u8) {
    // SAFETY: `open` has set the ports up, no interrupt touches them, and each access changes the
    // sensor's pins only.
    let (a, b) = unsafe { (GPIOA::steal(), GPIOB::steal()) };
    if set == OTHER {
        b.moder().modify(|_, w| w.moder6().input().moder7().input());
        b.pupdr().modify(|_, w| w.pupdr7().floating());
        a.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
        a.pupdr().modify(|_, w| w.pupdr10().pull_up());
        a.moder()
            .modify(|_, w| w.moder9().alternate().moder10().alternate());
    } else {
        a.moder()
            .modify(|_, w| w.moder9().input().moder10().input());
        a.pupdr().modify(|_, w| w.pupdr10().floating());
        b.pupdr().modify(|_, w| w.pupdr7().pull_up());
        b.moder()
            .modify(|_, w| w.moder6().alternate().moder7().alternate());
    }
}

/// Turns the clocks of ports and lines on and gives them the pins of set 0. Inputs are
/// pulled up, so that an open line is silent.
pub fn open(rcc: &RCC, a: &GPIOA, b: &GPIOB) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().set_bit().gpioben().set_bit();
        w.dma1en().set_bit().dma2en().set_bit()
    });
    rcc.apb1enr().modify(|_, w| {
        w.usart2en()
            .set_bit()
            .usart3en()
            .set_bit()
            .uart4en()
            .set_bit()
    });
    rcc.apb2enr().modify(|_, w| w.usart1en().set_bit());
    a.afrl()
        .modify(|_, w| w.afrl0().af8().afrl1().af8().afrl2().af7().afrl3().af7());
    b.afrl().modify(|_, w| w.afrl6().af7().afrl7().af7());
    b.afrh().modify(|_, w| w.afrh10().af7().afrh11().af7());
    a.pupdr()
        .modify(|_, w| w.pupdr1().pull_up().pupdr3().pull_up());
    b.pupdr()
        .modify(|_, w| w.pupdr7().pull_up().pupdr11().pull_up());
    a.moder().modify(|_, w| {
        w.moder0()
            .alternate()
            .moder1()
            .alternate()
            .moder2()
            .alternate()
            .moder3()
            .alternate()
    });
    b.moder().modify(|_, w| {
        w.moder6()
            .alternate()
            .moder7()
            .alternate()
            .moder10()
            .alternate()
            .moder11()
            .alternate()
    });
}
