//! Clocks: 168 MHz from the crystal, else from the internal oscillator, else the internal
//! oscillator as it is.
//!
//! RM0090 section 7.2 (clocks), section 3.5.1 (flash wait states). Every wait is bounded by
//! SysTick, which counts the internal oscillator meanwhile: a crystal that does not start, a PLL
//! that does not lock or a simulator without clock registers must not keep the board from working,
//! and bytes pass 50 ms after a reset.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use firmware::app::guard::crystal;
use firmware::wire::command::{ClockSource, Crystal};
use stm32f4::stm32f405::{FLASH, Peripherals, RCC};

use super::measure;

/// Frequency of the crystal: 12 MHz on the Adafruit Feather STM32F405 and the pyboard 1.1, 8 MHz on
/// the Olimex STM32-H405 (`LRNN_CRYSTAL_MHZ=8 cargo build ...`). A whole number of MHz, 4 to 26
/// (datasheet DS8626, section 6.3.8). Another crystal is found by measuring it.
const CRYSTAL_MHZ: u8 = match option_env!("LRNN_CRYSTAL_MHZ") {
    None => 12,
    Some(text) => match u8::from_str_radix(text, 10) {
        Ok(megahertz @ 4..=26) => megahertz,
        _ => panic!("LRNN_CRYSTAL_MHZ: a whole number from 4 to 26"),
    },
};

/// The internal oscillator, MHz. How exact it is: [`crystal`].
const INTERNAL_MHZ: u8 = 16;

/// The core at full speed.
const FULL: u32 = 168_000_000;

/// Longest waits, microseconds. A crystal needs 2 ms (DS8626, table 39), a PLL 0.3 ms (table 43).
const CRYSTAL_US: u32 = 20_000;
const PLL_US: u32 = 2_000;

/// Frequencies in Hz.
#[derive(Clone, Copy, Debug)]
pub struct Clocks {
    /// Where they come from.
    pub source: ClockSource,
    /// Core and SysTick.
    pub core: u32,
    /// USART2, USART3, UART4.
    pub apb1: u32,
    /// USART1.
    pub apb2: u32,
    /// The crystal.
    pub crystal: Crystal,
}

impl Clocks {
    /// The clock of a timer at APB1: twice that of a bus that is divided (RM0090 7.2).
    pub fn timer1(&self) -> u32 {
        match self.source {
            // its timers count nanoseconds, whatever the clock registers say
            ClockSource::Simulator => 1_000_000_000,
            _ if self.apb1 < self.core => self.apb1.saturating_mul(2),
            _ => self.apb1,
        }
    }
}

/// Starts the best clock there is. SysTick is free again afterwards.
pub fn start(peripherals: &Peripherals, syst: &mut SYST) -> Clocks {
    let (rcc, flash) = (&peripherals.RCC, &peripherals.FLASH);
    let mut known = Crystal {
        built_mhz: CRYSTAL_MHZ,
        used_mhz: 0,
        measured_khz: 0,
    };
    // a running STM32 never reads zero here
    if rcc.cr().read().hsirdy().bit_is_clear() {
        return full_speed(ClockSource::Simulator, known);
    }
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(COUNTS);
    syst.clear_current();
    syst.enable_counter();
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    let runs = soon(CRYSTAL_US, || rcc.cr().read().hserdy().bit_is_set());
    let mut used = None;
    if runs {
        let khz = measure::crystal(peripherals);
        known.measured_khz = khz.unwrap_or(0);
        used = khz.map_or(Some(CRYSTAL_MHZ), |khz| crystal::choose(CRYSTAL_MHZ, khz));
    }
    if used.is_none() {
        rcc.cr().modify(|_, w| w.hseon().clear_bit());
    }
    known.used_mhz = used.unwrap_or(0);
    // 1 MHz into the PLL, 336 out of its oscillator, halved; q for the 48 MHz of USB, unused.
    rcc.pllcfgr().modify(|_, w| {
        w.pllsrc().bit(used.is_some());
        // SAFETY: RM0090 7.3.2: m 2 to 63, n 50 to 432, q 2 to 15 are allowed.
        unsafe {
            w.pllm().bits(used.unwrap_or(INTERNAL_MHZ)).plln().bits(336);
            w.pllq().bits(7)
        };
        w.pllp().div2()
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    if !soon(PLL_US, || rcc.cr().read().pllrdy().bit_is_set()) || !switched(rcc, flash) {
        known.used_mhz = 0;
        syst.disable_counter();
        return alone(rcc, flash, known);
    }
    syst.disable_counter();
    if used.is_none() {
        return full_speed(ClockSource::Internal, known);
    }
    // From now on a crystal that stops raises the NMI, which restarts the board.
    rcc.cr().modify(|_, w| w.csson().set_bit());
    full_speed(ClockSource::Crystal, known)
}

/// To the PLL. APB1 must not exceed 42 MHz, APB2 84 MHz. Flash needs five wait states at 168 MHz
/// and 3.3 V, set before the core gets faster.
fn switched(rcc: &RCC, flash: &FLASH) -> bool {
    rcc.cfgr()
        .modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    flash.acr().modify(|_, w| w.latency().ws5());
    flash.acr().modify(|_, w| {
        let w = w.prften().set_bit();
        w.icen().set_bit().dcen().set_bit()
    });
    rcc.cfgr().modify(|_, w| w.sw().pll());
    soon(PLL_US, || rcc.cfgr().read().sws().is_pll())
}

/// The internal oscillator without PLL: both buses at full speed, which 16 MHz allows and the lines
/// need, and no wait states.
fn alone(rcc: &RCC, flash: &FLASH, crystal: Crystal) -> Clocks {
    rcc.cfgr()
        .modify(|_, w| w.sw().hsi().ppre1().div1().ppre2().div1());
    rcc.cr()
        .modify(|_, w| w.pllon().clear_bit().hseon().clear_bit());
    flash.acr().modify(|_, w| w.latency().ws0());
    let core = u32::from(INTERNAL_MHZ) * 1_000_000;
    Clocks {
        source: ClockSource::InternalDirect,
        core,
        apb1: core,
        apb2: core,
        crystal,
    }
}

fn full_speed(source: ClockSource, crystal: Crystal) -> Clocks {
    Clocks {
        source,
        core: FULL,
        apb1: FULL / 4,
        apb2: FULL / 2,
        crystal,
    }
}

/// SysTick counts 24 bits: one second of 16 MHz.
const COUNTS: u32 = 0xFF_FFFF;

/// Whether `ready` becomes true within so many microseconds of the internal oscillator. At full
/// speed the time is a tenth of that, still enough for a switch of clocks. A round takes longer
/// than a tick, so that a SysTick that does not count does not hold the board either.
pub(super) fn soon(us: u32, ready: impl Fn() -> bool) -> bool {
    let ticks = us.saturating_mul(INTERNAL_MHZ.into()).min(COUNTS / 2);
    let begun = SYST::get_current();
    for _ in 0..ticks {
        if ready() {
            return true;
        }
        if begun.wrapping_sub(SYST::get_current()) & COUNTS > ticks {
            return false;
        }
    }
    false
}
