//! STM32F405 at 168 MHz: Adafruit Feather STM32F405, pyboard, Olimex STM32-H405; QEMU's
//! `netduinoplus2`.
//!
//! The same image runs on all of them. What QEMU does not have (clock and pin registers, DMA,
//! watchdog, wait states) reads zero there, and no wait for it is long.
#![allow(
    unsafe_code,
    reason = "registers and interrupt tables; each block says why it is sound"
)]

#[allow(dead_code, reason = "an image without the learner from fixes")]
pub mod ccm;
pub mod clock;
mod flash;
mod frame;
mod interrupts;
mod log;
mod pins;
mod pulse;
mod random;
pub mod run;
mod serial;
mod spi;
mod stream;
mod watchdog;

use cortex_m::peripheral::SCB;
use firmware::app::{Hardware, Lines};
use firmware::configuration::SerialLines;
use firmware::link::Clock;
use firmware::link::rates;
use firmware::store::Store;
use firmware::wire::adis::Found;
use firmware::wire::adis::spi::LONGEST;
use stm32f4::stm32f405::Peripherals;

use self::clock::Clocks;
use self::flash::Sectors;
use self::pulse::Pulse;
use self::serial::{Port, Ports};
use self::spi::Spi;
use self::watchdog::Watchdog;
use crate::shared::time::Time;
use crate::shared::wake;

/// Between two looks for an ADIS, which takes up to 0.3 s to start.
const LOOK_US: u64 = 100_000;

/// Bytes of log that are kept.
const LOG_SIZE: usize = 1024;

/// The board, running.
pub struct Board {
    /// The four serial lines.
    pub lines: Lines<Port, Port, Port, Port>,
    /// How they are open.
    open: SerialLines,
    /// Time since start.
    pub time: Time,
    /// What the clocks became.
    pub clocks: Clocks,
    /// The receiver's time pulse.
    pulse: Pulse,
    /// An ADIS, if there is one.
    spi: Spi,
    /// When it was last looked for, microseconds; `None`: it is not looked for any more.
    looked_us: Option<u64>,
    /// Whether DMA moves the lines' bytes.
    pub dma: bool,
    /// What is stored; `None` if the store does not fit the flash.
    pub store: Option<Store<Sectors>>,
    /// Random bytes, if there is a generator.
    pub random: Option<[u8; 32]>,
    watchdog: Watchdog,
}

impl Board {
    /// Starts everything. `None` when called a second time.
    pub fn start() -> Option<Self> {
        let core = cortex_m::Peripherals::take()?;
        let peripherals = Peripherals::take()?;
        let clocks = clock::start(&peripherals.RCC, &peripherals.FLASH);
        let time = Time::start(core.SYST, clocks.core);
        let (ports, dma) = serial::open(&peripherals, clocks);
        let Ports {
            usart1,
            usart2,
            usart3,
            uart4,
        } = ports;
        let spi = Spi::open(&peripherals, clocks);
        let pulse = Pulse::open(&peripherals, clocks);
        Some(Self {
            spi,
            pulse,
            looked_us: Some(0),
            lines: Lines {
                sensor: usart1,
                navigation: usart2,
                command: uart4,
                gnss: usart3,
            },
            open: SerialLines::DEFAULT,
            time,
            clocks,
            dma,
            store: Store::new(Sectors::new(peripherals.FLASH)).ok(),
            random: random::bytes(&peripherals.RCC, &peripherals.RNG),
            watchdog: Watchdog::start(peripherals.IWDG, &peripherals.DBGMCU),
        })
    }

    /// What the application must know.
    pub fn hardware(&self) -> Hardware {
        let Clocks { apb1, apb2, .. } = self.clocks;
        Hardware {
            name: "stm32f405",
            clocks: [apb2, apb1, apb1].map(rates::Clock::stm32),
            parity: true,
            pin_sets: pins::SETS,
        }
    }

    /// Opens the lines anew as they are told to be. The command link goes on.
    pub fn open(&mut self, lines: &SerialLines) {
        let exchanged = |lines: &SerialLines| lines.pins == pins::EXCHANGED;
        if exchanged(&self.open) != exchanged(lines) {
            core::mem::swap(&mut self.lines.navigation, &mut self.lines.gnss);
        }
        serial::reopen(self.clocks, &self.open, lines);
        self.open = *lines;
    }

    /// An ADIS that answers at the SPI, once. The board looks for it until then, or until something
    /// has come on the sensor's line.
    pub fn look_for_adis(&mut self) -> Option<Found> {
        let looked = self.looked_us?;
        let now = self.time.now_us();
        if now.saturating_sub(looked) < LOOK_US {
            return None;
        }
        self.looked_us = self.lines.sensor.is_silent().then_some(now);
        self.looked_us?;
        let found = self.spi.find();
        if found.is_some() {
            self.looked_us = None;
        }
        found
    }

    /// When the receiver's time pulse has risen, if it has since the last turn, microseconds.
    pub fn pulse(&mut self) -> Option<u64> {
        self.pulse.rose(&self.time)
    }

    /// A new burst of the ADIS.
    pub fn burst<'b>(&mut self, frame: &'b mut [u8; LONGEST]) -> Option<&'b mut [u8]> {
        self.spi.burst(frame)
    }

    /// To be called in every turn of the main loop. With nothing left to do, the board sleeps until
    /// the sensor has sent `needs` bytes more, another line has received something, or a
    /// millisecond is over.
    pub fn turned(&mut self, busy: bool, needs: usize) {
        self.watchdog.feed();
        if !busy && self.lines.sensor.want(needs) {
            self.time.slept(wake::sleep());
        }
    }
}

/// The crystal has stopped, and the core continues on the internal oscillator with wrong bit rates:
/// start anew without the crystal.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    SCB::sys_reset();
}

/// A fault: start anew. The watchdog would do so later.
#[cortex_m_rt::exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    SCB::sys_reset();
}
