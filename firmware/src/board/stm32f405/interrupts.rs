//! The interrupt table (RM0090 table 62). Everything but the four serial lines goes to the default handler.

use stm32f4::stm32f405::Interrupt;

use super::serial::{uart4, usart1, usart2, usart3};

unsafe extern "C" {
    /// Of `cortex-m-rt`: stays in a loop, until the watchdog ends it.
    fn DefaultHandler();
}

const INTERRUPTS: usize = 82;

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its feature `device`; each entry
// is the address of a function of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = {
    let mut table = [DefaultHandler as unsafe extern "C" fn(); INTERRUPTS];
    table[Interrupt::USART1 as usize] = usart1;
    table[Interrupt::USART2 as usize] = usart2;
    table[Interrupt::USART3 as usize] = usart3;
    table[Interrupt::UART4 as usize] = uart4;
    table
};
