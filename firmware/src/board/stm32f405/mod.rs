//! STM32F405 at 168 MHz: Adafruit Feather STM32F405, pyboard, Olimex STM32-H405; QEMU's `netduinoplus2`.
//!
//! The same image runs on all of them. What QEMU does not have (clock and pin registers, DMA, watchdog, wait states) reads zero
//! there, and nothing waits for it for long.
#![allow(
    unsafe_code,
    reason = "registers and interrupt tables; each block says why it is sound"
)]

pub mod clock;
mod flash;
mod interrupts;
mod log;
pub mod run;
mod serial;
mod stream;
mod watchdog;

use cortex_m::peripheral::SCB;
use firmware::app::Lines;
use firmware::store::Store;
use stm32f4::stm32f405::Peripherals;

use self::clock::Clocks;
use self::flash::Sectors;
use self::serial::{Port, Ports, Rates};
use self::watchdog::Watchdog;
use crate::time::Time;
use crate::uart;

/// Sensor and navigation computer at 921 600 bit/s (STIM300, KVH); receiver at 115 200; command link at 921 600.
const RATES: Rates = Rates {
    sensor: 921_600,
    gnss: 115_200,
    command: 921_600,
};

/// Bytes of log that are kept.
const LOG_SIZE: usize = 1024;

/// The board, running.
pub struct Board {
    /// The four serial lines.
    pub lines: Lines<Port, Port, Port, Port>,
    /// Time since start.
    pub time: Time,
    /// What the clocks became.
    pub clocks: Clocks,
    /// Whether DMA moves the lines' bytes.
    pub dma: bool,
    /// The weights that were stored; `None` if flash does not have the shape it has.
    pub store: Option<Store<Sectors>>,
    watchdog: Watchdog,
}

impl Board {
    /// Starts everything. `None` when called a second time.
    pub fn start() -> Option<Self> {
        let core = cortex_m::Peripherals::take()?;
        let peripherals = Peripherals::take()?;
        let clocks = clock::start(&peripherals.RCC, &peripherals.FLASH);
        let time = Time::start(core.SYST, clocks.core);
        let (ports, dma) = serial::open(&peripherals, clocks, &RATES);
        let Ports {
            sensor,
            navigation,
            gnss,
            command,
        } = ports;
        Some(Self {
            lines: Lines {
                sensor,
                navigation,
                command,
                gnss,
            },
            time,
            clocks,
            dma,
            store: Store::new(Sectors::new(peripherals.FLASH)).ok(),
            watchdog: Watchdog::start(peripherals.IWDG, &peripherals.DBGMCU),
        })
    }

    /// The loop has turned. With nothing left to do it sleeps until the sensor has sent `needs` bytes more, something has come on
    /// another line, or a millisecond is over.
    pub fn turned(&mut self, busy: bool, needs: usize) {
        self.watchdog.feed();
        if !busy && self.lines.sensor.want(needs) {
            uart::sleep();
        }
    }
}

/// The crystal has stopped and the core runs on from the internal oscillator, with wrong bit rates: start anew without it.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    SCB::sys_reset();
}

/// A fault: start anew. The watchdog would, only later.
#[cortex_m_rt::exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    SCB::sys_reset();
}
