//! Clocks: 168 MHz from the crystal, else from the internal oscillator, else the internal
//! oscillator as it is.
//!
//! RM0090 section 7.2 (clocks), section 3.5.1 (flash wait states). Every wait is bounded: a crystal
//! that does not start, a PLL that does not lock or a simulator without clock registers must not
//! keep the board from working.

use stm32f4::stm32f405::{FLASH, RCC};

/// Frequency of the crystal: 12 MHz on the Adafruit Feather STM32F405 and the pyboard 1.1, 8 MHz on
/// the Olimex STM32-H405 (`LRNN_CRYSTAL_MHZ=8 cargo build ...`). A whole number of MHz, 4 to 26
/// (datasheet DS8626, section 6.3.8).
pub const CRYSTAL_MHZ: u8 = match option_env!("LRNN_CRYSTAL_MHZ") {
    None => 12,
    Some(text) => match u8::from_str_radix(text, 10) {
        Ok(megahertz @ 4..=26) => megahertz,
        _ => panic!("LRNN_CRYSTAL_MHZ: a whole number from 4 to 26"),
    },
};

/// The internal oscillator, +-1 % after factory trimming (DS8626, table 41).
const INTERNAL_MHZ: u8 = 16;

/// The core at full speed.
const FULL: u32 = 168_000_000;

/// Rounds of a waiting loop, of at least 4 cycles of 16 MHz each: at least 50 ms. A crystal needs 2
/// ms (DS8626, table 39) and a PLL 0.3 ms.
const PATIENCE: u32 = 200_000;

/// Where the core's clock comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Source {
    /// Crystal and PLL.
    Crystal,
    /// Internal oscillator and PLL: the crystal did not start.
    Internal,
    /// Internal oscillator: the PLL did not lock.
    InternalDirect,
    /// The registers read zero, which they never do on a running STM32. This is a simulator, whose
    /// core runs at full speed.
    NotThere,
}

/// Frequencies in Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub struct Clocks {
    /// Where they come from.
    pub source: Source,
    /// Core and SysTick.
    pub core: u32,
    /// USART2, USART3, UART4.
    pub apb1: u32,
    /// USART1.
    pub apb2: u32,
}

/// Starts the best clock there is.
pub fn start(rcc: &RCC, flash: &FLASH) -> Clocks {
    if rcc.cr().read().hsirdy().bit_is_clear() {
        return full_speed(Source::NotThere);
    }
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    let crystal = soon(|| rcc.cr().read().hserdy().bit_is_set());
    let (megahertz, source) = if crystal {
        (CRYSTAL_MHZ, Source::Crystal)
    } else {
        (INTERNAL_MHZ, Source::Internal)
    };
    // 1 MHz into the PLL, 336 out of its oscillator, halved; q for the 48 MHz of USB, unused.
    rcc.pllcfgr().modify(|_, w| {
        w.pllsrc().bit(crystal);
        // SAFETY: RM0090 7.3.2: m 2 to 63, n 50 to 432, q 2 to 15 are allowed.
        unsafe { w.pllm().bits(megahertz).plln().bits(336).pllq().bits(7) };
        w.pllp().div2()
    });
    // APB1 must not exceed 42 MHz, APB2 84 MHz. Flash needs five wait states at 168 MHz and 3.3 V,
    // set before the core gets faster.
    rcc.cfgr()
        .modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    flash.acr().modify(|_, w| {
        w.latency()
            .ws5()
            .prften()
            .set_bit()
            .icen()
            .set_bit()
            .dcen()
            .set_bit()
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    let locked = soon(|| rcc.cr().read().pllrdy().bit_is_set());
    if locked {
        rcc.cfgr().modify(|_, w| w.sw().pll());
    }
    if !(locked && soon(|| rcc.cfgr().read().sws().is_pll())) {
        // Both buses at full speed, which 16 MHz allows: the lines need it.
        rcc.cfgr()
            .modify(|_, w| w.sw().hsi().ppre1().div1().ppre2().div1());
        let core = u32::from(INTERNAL_MHZ) * 1_000_000;
        return Clocks {
            source: Source::InternalDirect,
            core,
            apb1: core,
            apb2: core,
        };
    }
    if crystal {
        // From now on a crystal that stops raises the NMI, which starts the board anew.
        rcc.cr().modify(|_, w| w.csson().set_bit());
    }
    full_speed(source)
}

fn full_speed(source: Source) -> Clocks {
    Clocks {
        source,
        core: FULL,
        apb1: FULL / 4,
        apb2: FULL / 2,
    }
}

/// Whether `ready` becomes true in time.
fn soon(ready: impl Fn() -> bool) -> bool {
    (0..PATIENCE).any(|_| ready())
}
