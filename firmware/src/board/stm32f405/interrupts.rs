//! The interrupt table (RM0090 table 62). The default handler serves everything but the four serial
//! lines, their DMA streams and the ADIS's data-ready.

use stm32f4::stm32f405::Interrupt;

use super::{serial, spi};

unsafe extern "C" {
    /// Of `cortex-m-rt`: stays in a loop, until the watchdog ends it.
    fn DefaultHandler();
}

const INTERRUPTS: usize = 82;

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its
// feature `device`. Each entry is the address of a function of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = {
    let mut table = [DefaultHandler as unsafe extern "C" fn(); INTERRUPTS];
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
    table
};
