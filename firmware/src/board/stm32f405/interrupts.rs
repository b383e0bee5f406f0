//! The interrupt table (RM0090 table 62). The default handler serves everything but the four serial
//! lines, their DMA streams, the ADIS's data-ready and burst, and the window watchdog.

use stm32f4::stm32f405::Interrupt;

use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::{NVIC, SCB};

use super::{crash, serial, spi};

unsafe extern "C" {
    /// Of `cortex-m-rt`: stays in a loop, until the watchdog ends it.
    fn DefaultHandler();
}

const INTERRUPTS: usize = 82;

/// Priority of the sensor's and the navigation line (without `pins = 2`), whose bytes are cut
/// through with a constant delay. Among themselves they do not interrupt each other, as `link`
/// requires. Only the window watchdog's is higher, which comes through a handler that does not end.
/// Four bits are there (RM0090 12.1).
const CUT: u8 = 0x10;

/// Priority of the rest, which do not interrupt each other either. They share nothing with those
/// above but the mark that wakes the frame path.
const USUAL: u8 = 0x20;

/// Gives all but the window watchdog's their priority, before any is let through.
pub fn prioritise(nvic: &mut NVIC, scb: &mut SCB) {
    for (interrupts, priority) in [(&CUT_THROUGH[..], CUT), (&OTHERS, USUAL)] {
        for interrupt in interrupts {
            // SAFETY: no critical section relies on a priority.
            unsafe { nvic.set_priority(*interrupt, priority) };
        }
    }
    // SAFETY: as above.
    unsafe { scb.set_priority(SystemHandler::SysTick, USUAL) };
}

const CUT_THROUGH: [Interrupt; 6] = [
    Interrupt::USART1,
    Interrupt::DMA2_STREAM2,
    Interrupt::DMA2_STREAM7,
    Interrupt::USART2,
    Interrupt::DMA1_STREAM5,
    Interrupt::DMA1_STREAM6,
];

const OTHERS: [Interrupt; 8] = [
    Interrupt::USART3,
    Interrupt::DMA1_STREAM1,
    Interrupt::DMA1_STREAM3,
    Interrupt::UART4,
    Interrupt::DMA1_STREAM2,
    Interrupt::DMA1_STREAM4,
    Interrupt::EXTI4,
    Interrupt::DMA2_STREAM0,
];

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its
// feature `device`. Each entry is the address of a function of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = {
    let mut table = [DefaultHandler as unsafe extern "C" fn(); INTERRUPTS];
    table[Interrupt::WWDG as usize] = crash::wwdg;
    table[Interrupt::USART1 as usize] = serial::usart1;
    table[Interrupt::USART2 as usize] = serial::usart2;
    table[Interrupt::USART3 as usize] = serial::usart3;
    table[Interrupt::UART4 as usize] = serial::uart4;
    table[Interrupt::DMA2_STREAM2 as usize] = serial::usart1_in_end;
    table[Interrupt::DMA2_STREAM7 as usize] = serial::usart1_out_end;
    table[Interrupt::DMA1_STREAM5 as usize] = serial::usart2_in_end;
    table[Interrupt::DMA1_STREAM6 as usize] = serial::usart2_out_end;
    table[Interrupt::DMA1_STREAM1 as usize] = serial::usart3_in_end;
    table[Interrupt::DMA1_STREAM3 as usize] = serial::usart3_out_end;
    table[Interrupt::DMA1_STREAM2 as usize] = serial::uart4_in_end;
    table[Interrupt::DMA1_STREAM4 as usize] = serial::uart4_out_end;
    table[Interrupt::EXTI4 as usize] = spi::exti4;
    table[Interrupt::DMA2_STREAM0 as usize] = spi::dma2_stream0;
    table
};
