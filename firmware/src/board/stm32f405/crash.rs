//! Why the board started, and its entries for a crash ([`crate::shared::crash`]): faults of the
//! core, the stopped crystal (NMI) and the window watchdog's early interrupt.

use firmware::wire::command::cause;
use stm32f4::stm32f405::RCC;

use super::counter;
use crate::shared::crash::{_stack_end, _stack_start, entry, record};

/// What the chip says of its last reset, which is cleared for the next one (RM0090 7.3.21).
pub fn causes(rcc: &RCC) -> u8 {
    let csr = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    rcc.csr().modify(|_, w| w.rmvf().clear_bit());
    [
        (csr.borrstf().bit_is_set(), cause::BROWN_OUT),
        (csr.padrstf().bit_is_set(), cause::PIN),
        (csr.porrstf().bit_is_set(), cause::POWER_ON),
        (csr.sftrstf().bit_is_set(), cause::SOFTWARE),
        (csr.wdgrstf().bit_is_set(), cause::WATCHDOG),
        (csr.wwdgrstf().bit_is_set(), cause::WINDOW),
        (csr.lpwrrstf().bit_is_set(), cause::LOW_POWER),
    ]
    .into_iter()
    .fold(0, |bits, (is, bit)| if is { bits | bit } else { bits })
}

extern "C" fn crashed(kind: u32, xpsr: u32, lr: u32, pc: u32) -> ! {
    record(kind, [xpsr, lr, pc], (counter::now_us() / 1000) as u32)
}

/// A panic.
pub fn panicked() -> ! {
    crashed(4, 0, 0, 0)
}

entry!(
    /// A fault of the core. Faults of memory, bus and usage are not enabled by themselves and come
    /// here, too.
    // SAFETY: `cortex-m-rt` expects this name, and nothing else in the image has it.
    #[unsafe(no_mangle)]
    HardFault, 0
);
entry!(
    /// The crystal has stopped (RM0090 7.2.7), and the core continues on the internal oscillator
    /// with wrong bit rates: it restarts without the crystal.
    // SAFETY: as above.
    #[unsafe(no_mangle)]
    NonMaskableInt, 2
);
entry!(
    /// The window watchdog is about to bite.
    pub wwdg, 3
);
