//! The four serial lines: pins, bit rates, interrupts.
//!
//! Bytes go one by one through an interrupt of some forty instructions. The main loop is not woken before the frame may be whole.
//! DMA would save the interrupts (about 2000 instructions a STIM300 word), but QEMU has no DMA controller to test it with, and its
//! buffers hold bytes back until the line falls silent, while the correction must leave as soon as the last byte is in.

use firmware::link::uart::{Port, Uart};
use stm32f4::stm32f405::{
    GPIOA, GPIOB, Interrupt, Peripherals, RCC, UART4, USART1, USART2, USART3,
};

use super::clock::Clocks;
use crate::uart::wake;

/// Bit rates of the lines (8 data bits, no parity, one stop bit). The sensor's own rate is the navigation computer's: bytes
/// leave as fast as they come.
pub struct Rates {
    /// Sensor and navigation computer.
    pub sensor: u32,
    /// GNSS receiver.
    pub gnss: u32,
    /// Command link.
    pub command: u32,
}

/// The main loop's ends.
pub struct Ports {
    /// USART1: PB6 out, PB7 in.
    pub sensor: Port<'static>,
    /// USART2: PA2 out, PA3 in.
    pub navigation: Port<'static>,
    /// USART3: PB10 out, PB11 in.
    pub gnss: Port<'static>,
    /// UART4: PA0 out, PA1 in.
    pub command: Port<'static>,
}

static SENSOR: Uart = Uart::new();
static NAVIGATION: Uart = Uart::new();
static GNSS: Uart = Uart::new();
static COMMAND: Uart = Uart::new();

/// Opens all four; called once.
pub fn open(peripherals: &Peripherals, clocks: Clocks, rates: &Rates) -> Ports {
    pins(&peripherals.RCC, &peripherals.GPIOA, &peripherals.GPIOB);
    macro_rules! line {
        ($uart:ident, $bus:expr, $rate:expr, $line:ident) => {{
            let port = $line.port(|| cortex_m::peripheral::NVIC::pend(Interrupt::$uart));
            let uart = &peripherals.$uart;
            // Mantissa and fraction together are clock / rate, rounded (RM0090 30.3.4); 42 MHz / 115 200 is the largest, 365.
            let divider = ($bus + $rate / 2) / $rate;
            uart.brr().write(|w| {
                w.div_mantissa().set((divider >> 4) as u16);
                w.div_fraction().set((divider & 0xf) as u8)
            });
            uart.cr1().write(|w| {
                w.ue().set_bit().te().set_bit().re().set_bit().rxneie().set_bit()
            });
            port
        }};
    }
    let ports = Ports {
        sensor: line!(USART1, clocks.apb2, rates.sensor, SENSOR),
        navigation: line!(USART2, clocks.apb1, rates.sensor, NAVIGATION),
        gnss: line!(USART3, clocks.apb1, rates.gnss, GNSS),
        command: line!(UART4, clocks.apb1, rates.command, COMMAND),
    };
    for interrupt in [
        Interrupt::USART1,
        Interrupt::USART2,
        Interrupt::USART3,
        Interrupt::UART4,
    ] {
        // SAFETY: the lines are open, and no critical section relies on a masked interrupt.
        unsafe { cortex_m::peripheral::NVIC::unmask(interrupt) };
    }
    ports
}

/// Clocks of ports and lines on; pins to their alternate function, inputs pulled up so that an open line is silent.
fn pins(rcc: &RCC, a: &GPIOA, b: &GPIOB) {
    rcc.ahb1enr()
        .modify(|_, w| w.gpioaen().set_bit().gpioben().set_bit());
    rcc.apb1enr().modify(|_, w| {
        w.usart2en()
            .set_bit()
            .usart3en()
            .set_bit()
            .uart4en()
            .set_bit()
    });
    rcc.apb2enr().modify(|_, w| w.usart1en().set_bit());
    // DS8626 table 9: AF7 is USART1 to USART3, AF8 is UART4.
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

/// The interrupts: takes the byte that came, then gives the transmitter what it has room for.
///
/// The order of reads (status, then data) clears the error flags as well (RM0090 30.6.1). The main loop makes the interrupt
/// pending when it has written something; from then on the empty transmitter asks by itself.
macro_rules! handler {
    ($name:ident, $uart:ident, $line:ident) => {
        pub extern "C" fn $name() {
            // SAFETY: after `open` only this handler uses this UART's registers, and it does not interrupt itself.
            let uart = unsafe { $uart::steal() };
            let status = uart.sr().read();
            if status.rxne().bit_is_set() || status.ore().bit_is_set() {
                let byte = uart.dr().read().dr().bits() as u8; // 8 data bits: the ninth reads 0
                let torn = status.fe().bit_is_set() || status.nf().bit_is_set();
                if torn || status.ore().bit_is_set() {
                    $line.lost();
                    wake();
                }
                if status.rxne().bit_is_set() && !torn && $line.came(byte) {
                    wake();
                }
            }
            let asks = uart.cr1().read().txeie().bit_is_set();
            while uart.sr().read().txe().bit_is_set() {
                let Some(byte) = $line.next() else {
                    if asks {
                        uart.cr1().modify(|_, w| w.txeie().clear_bit());
                    }
                    return;
                };
                uart.dr().write(|w| w.dr().set(byte.into()));
            }
            if !asks {
                uart.cr1().modify(|_, w| w.txeie().set_bit());
            }
        }
    };
}

handler!(usart1, USART1, SENSOR);
handler!(usart2, USART2, NAVIGATION);
handler!(usart3, USART3, GNSS);
handler!(uart4, UART4, COMMAND);
