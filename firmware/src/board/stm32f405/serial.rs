//! The four serial lines: pins, bit rates, interrupts.
//!
//! DMA moves the bytes, and an interrupt comes with the last byte of a frame
//! (`firmware::link::dma`). Where there is no controller (QEMU), an interrupt of some forty
//! instructions moves each byte. In both cases the main loop sleeps until the frame may be
//! complete. **The DMA path has not run on a chip yet**, only in a model written from the same
//! manual (`tests/qemu/judges/stm32f405.py`).
//!
//! All interrupts have the priority they have after reset, so none interrupts another, as `link`
//! requires.

use cortex_m::peripheral::NVIC;
use firmware::link::dma::Stream as _;
use firmware::link::uart::{self, Uart};
use stm32f4::stm32f405::{
    DMA1, DMA2, GPIOA, GPIOB, Interrupt, Peripherals, RCC, UART4, USART1, USART2, USART3,
};

use super::clock::Clocks;
use super::stream::{Left, Stream, reaches};
use crate::shared::wake::wake;

/// The main loop's end of a line.
pub type Port = uart::Port<'static, Left>;

/// Bit rates of the lines (8 data bits, no parity, one stop bit). Sensor and navigation computer
/// have the same rate: bytes leave as fast as they come.
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
    pub sensor: Port,
    /// USART2: PA2 out, PA3 in.
    pub navigation: Port,
    /// USART3: PB10 out, PB11 in.
    pub gnss: Port,
    /// UART4: PA0 out, PA1 in.
    pub command: Port,
}

static SENSOR: Uart = Uart::new();
static NAVIGATION: Uart = Uart::new();
static GNSS: Uart = Uart::new();
static COMMAND: Uart = Uart::new();

/// Opens all four; called once. Whether DMA moves their bytes.
pub fn open(peripherals: &Peripherals, clocks: Clocks, rates: &Rates) -> (Ports, bool) {
    pins(&peripherals.RCC, &peripherals.GPIOA, &peripherals.GPIOB);
    let mut all = true;
    macro_rules! line {
        ($line:ident, $uart:ident, $bus:expr, $rate:expr, $in:ident, $in_interrupt:ident, $out:ident, $out_interrupt:ident, $idle:expr) => {{
            let uart = &peripherals.$uart;
            // Mantissa and fraction together are clock / rate, rounded (RM0090 30.3.4). The largest
            // is 42 MHz / 115 200 = 365.
            let divider = ($bus + $rate / 2) / $rate;
            uart.brr().write(|w| {
                w.div_mantissa().set((divider >> 4) as u16);
                w.div_fraction().set((divider & 0xf) as u8)
            });
            let data = uart.dr().as_ptr() as u32;
            let ring = reaches((&raw const $line) as usize);
            let dma = ring && $in().set_up(data) && $out().set_up(data);
            if dma {
                // The requests first, then the UART. EIE makes errors interrupt and needs DMAR
                // (RM0090 30.4).
                uart.cr3()
                    .write(|w| w.dmar().set_bit().dmat().set_bit().eie().set_bit());
            }
            uart.cr1().write(|w| {
                w.ue().set_bit().te().set_bit().re().set_bit();
                w.rxneie().bit(!dma).idleie().bit(dma && $idle)
            });
            for interrupt in [
                Interrupt::$uart,
                Interrupt::$in_interrupt,
                Interrupt::$out_interrupt,
            ] {
                if dma || interrupt == Interrupt::$uart {
                    // SAFETY: what the handlers use is set up, and no critical section relies on a
                    // masked interrupt.
                    unsafe { NVIC::unmask(interrupt) };
                }
            }
            all &= dma;
            let sync = || pend(Interrupt::$in_interrupt); // masked without DMA
            let port = if dma {
                $line.port_over($in().progress(), sync, || pend(Interrupt::$out_interrupt))
            } else {
                $line.port_over($in().progress(), sync, || pend(Interrupt::$uart))
            };
            sync(); // the first transfer
            port
        }};
    }
    let Rates {
        sensor,
        gnss,
        command,
    } = *rates;
    let Clocks { apb1, apb2, .. } = clocks;
    let ports = Ports {
        sensor: line!(
            SENSOR,
            USART1,
            apb2,
            sensor,
            usart1_in,
            DMA2_STREAM2,
            usart1_out,
            DMA2_STREAM7,
            false
        ),
        navigation: line!(
            NAVIGATION,
            USART2,
            apb1,
            sensor,
            usart2_in,
            DMA1_STREAM5,
            usart2_out,
            DMA1_STREAM6,
            true
        ),
        gnss: line!(
            GNSS,
            USART3,
            apb1,
            gnss,
            usart3_in,
            DMA1_STREAM1,
            usart3_out,
            DMA1_STREAM3,
            true
        ),
        command: line!(
            COMMAND,
            UART4,
            apb1,
            command,
            uart4_in,
            DMA1_STREAM2,
            uart4_out,
            DMA1_STREAM4,
            true
        ),
    };
    (ports, all)
}

/// The interrupt is served before this returns (PM0214 section 4.3.9: the barriers).
fn pend(interrupt: Interrupt) {
    NVIC::pend(interrupt);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Turns the clocks of ports and lines on and sets pins to their alternate function. Inputs are
/// pulled up, so that an open line is silent.
fn pins(rcc: &RCC, a: &GPIOA, b: &GPIOB) {
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

/// The streams of a line (RM0090 tables 42 and 43).
macro_rules! streams {
    ($in:ident, $out:ident, $controller:ident, $n_in:literal, $n_out:literal) => {
        fn $in() -> Stream<$n_in, false> {
            // SAFETY: these registers exist for ever. This stream is this line's alone, and after
            // `open` its handlers'.
            Stream::of(unsafe { &*$controller::ptr() })
        }
        fn $out() -> Stream<$n_out, true> {
            // SAFETY: as above.
            Stream::of(unsafe { &*$controller::ptr() })
        }
    };
}

streams!(usart1_in, usart1_out, DMA2, 2, 7);
streams!(usart2_in, usart2_out, DMA1, 5, 6);
streams!(usart3_in, usart3_out, DMA1, 1, 3);
streams!(uart4_in, uart4_out, DMA1, 2, 4);

/// The interrupts of a line: of its two streams, and of its UART.
///
/// The order of reads (status, then data) clears the UART's flags (RM0090 30.6.1).
///
/// With DMA, the UART interrupts at errors, and on some lines when it falls idle, since the number
/// of bytes of a request is not known. Reading the data register clears the flags. The DMA has
/// mostly taken its byte before; else both read the same one. Only when the ring is full the byte
/// is lost, and that is reported.
///
/// Without DMA, the interrupt takes the byte that came, then gives the transmitter what it has room
/// for. The main loop makes the interrupt pending when it has written something. From then on the
/// empty transmitter interrupts by itself.
macro_rules! handlers {
    ($name:ident, $uart:ident, $line:ident, $in:ident, $in_handler:ident, $out:ident, $out_handler:ident) => {
        pub extern "C" fn $in_handler() {
            if $line.received_by(&$in()) {
                wake();
            }
        }

        pub extern "C" fn $out_handler() {
            $line.sent_by(&$out());
        }

        pub extern "C" fn $name() {
            // SAFETY: after `open` only this handler uses this UART's registers, and it does not
            // interrupt itself.
            let uart = unsafe { $uart::steal() };
            let status = uart.sr().read();
            let torn = status.fe().bit_is_set() || status.nf().bit_is_set();
            if uart.cr3().read().dmar().bit_is_set() {
                let _ = uart.dr().read();
                let untaken = status.rxne().bit_is_set() && !$in().is_running();
                if torn || status.ore().bit_is_set() || untaken {
                    $line.lost();
                }
                if status.idle().bit_is_set() {
                    $line.received_by(&$in());
                }
                return wake();
            }
            if status.rxne().bit_is_set() || status.ore().bit_is_set() {
                let byte = uart.dr().read().dr().bits() as u8; // 8 data bits: the ninth reads 0
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

handlers!(
    usart1,
    USART1,
    SENSOR,
    usart1_in,
    usart1_in_end,
    usart1_out,
    usart1_out_end
);
handlers!(
    usart2,
    USART2,
    NAVIGATION,
    usart2_in,
    usart2_in_end,
    usart2_out,
    usart2_out_end
);
handlers!(
    usart3,
    USART3,
    GNSS,
    usart3_in,
    usart3_in_end,
    usart3_out,
    usart3_out_end
);
handlers!(
    uart4,
    UART4,
    COMMAND,
    uart4_in,
    uart4_in_end,
    uart4_out,
    uart4_out_end
);
