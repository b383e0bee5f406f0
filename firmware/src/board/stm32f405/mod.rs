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
mod counter;
pub mod crash;
mod flash;
mod frame;
mod interrupts;
mod log;
mod measure;
mod pins;
mod pulse;
mod random;
mod serial;
mod spi;
pub mod start;
mod stream;
mod supply;
mod watchdog;

use cortex_m::peripheral::SCB;
use firmware::app::guard::output::{self, Verdict};
use firmware::app::guard::retained::{EARLY_US, Retained};
use firmware::app::{COMMAND_BAUD, Hardware, Lines, run};
use firmware::configuration::SerialLines;
use firmware::link::rates;
use firmware::link::{Clock, Lost};
use firmware::store::Store;
use firmware::wire::adis::spi::LONGEST;
use firmware::wire::adis::{DetectedSensor, Rate};
use firmware::wire::command::{LoopPhase, Reset, unwell};
use stm32f4::stm32f405::Peripherals;

use self::clock::Clocks;
use self::flash::Sectors;
use self::pulse::Pulse;
use self::serial::{Port, Ports};
use self::spi::Spi;
use self::watchdog::Watchdog;
use crate::shared::crash as record;
use crate::shared::time::Time;

/// Between two looks for an ADIS, which takes up to 0.3 s to start.
const LOOK_US: u64 = 100_000;

/// Bytes of log that are kept.
const LOG_SIZE: usize = 896;

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
    /// Look for one.
    adis: bool,
    /// A burst was lost.
    lost: bool,
    /// There was one: it is at the bus, whatever comes on the sensor's line.
    has_adis: bool,
    /// When it was last looked for, microseconds; `None`: it is not looked for any more.
    looked_us: Option<u64>,
    /// Whether DMA moves the lines' bytes.
    pub dma: bool,
    /// Why and how it started.
    pub reset: Reset,
    /// What survives the next reset; `None`: the run is no longer an early one.
    retained: Option<Retained>,
    /// Whether the navigation line sends, and how often it was reopened since it did not.
    output: output::Watch,
    reopened: u16,
    /// Random bytes, if there is a generator.
    pub random: Option<[u8; 32]>,
    watchdog: Watchdog,
}

impl Board {
    /// Starts everything, and gives what sets the priority of PendSV, and the store; `None` of that
    /// if it does not fit the flash. `None` of all when called a second time. `adis`: look for one
    /// at the SPI.
    pub fn start(adis: bool) -> Option<(SCB, Option<Store<Sectors>>, Self)> {
        let mut core = cortex_m::Peripherals::take()?;
        let peripherals = Peripherals::take()?;
        let causes = crash::causes(&peripherals.RCC);
        let (retained, safe) = Retained::started(&record::words(), causes);
        record::save_retained(&retained);
        supply::watch(&peripherals.RCC, &peripherals.PWR);
        let clocks = &clock::start(&peripherals, &mut core.SYST);
        counter::start(&peripherals.RCC, &peripherals.TIM2, clocks);
        interrupts::prioritise(&mut core.NVIC, &mut core.SCB);
        let time = Time::start(core.SYST, clocks.core, Some(counter::now_us));
        let (ports, dma) = serial::open(&peripherals, clocks);
        let Ports {
            usart1,
            usart2,
            usart3,
            uart4,
        } = ports;
        let spi = Spi::open(&peripherals, clocks);
        let pulse = Pulse::open(&peripherals, clocks);
        let board = Self {
            spi,
            adis,
            pulse,
            lost: false,
            has_adis: false,
            looked_us: Some(0),
            lines: Lines {
                sensor: usart1,
                navigation: usart2,
                command: uart4,
                gnss: usart3,
            },
            open: SerialLines::DEFAULT,
            time,
            clocks: *clocks,
            dma,
            reset: Reset {
                causes,
                uptime_ms: 0,
                safe,
                clock: clocks.source,
                core_hz: clocks.core,
                crystal: clocks.crystal,
                command_baud: rates::Clock::stm32(clocks.apb1).nearest(COMMAND_BAUD).baud,
                brown_out: supply::brown_out(&peripherals.FLASH),
                supply_low: supply::is_low(),
                reopened: 0,
                crash: retained.crash,
            },
            retained: Some(retained),
            output: output::Watch::default(),
            reopened: 0,
            random: random::bytes(&peripherals.RCC, &peripherals.RNG),
            watchdog: Watchdog::start(
                peripherals.IWDG,
                peripherals.WWDG,
                &peripherals.DBGMCU,
                clocks.apb1,
            ),
        };
        let store = Store::new(Sectors::new(peripherals.FLASH)).ok();
        Some((core.SCB, store, board))
    }

    /// What the application must know.
    pub fn hardware(&self) -> Hardware {
        let Clocks { apb1, apb2, .. } = self.clocks;
        Hardware {
            name: "stm32f405",
            clocks: [apb2, apb1, apb1].map(rates::Clock::stm32),
            parity: true,
            pin_sets: pins::SETS,
            reset: Some(self.reset),
        }
    }

    /// Feeds the watchdogs if the application is healthy and the navigation line sends. In a safe
    /// start the line is no reason to restart any more.
    fn guard(&mut self, application: u8) {
        let now = self.time.now_us();
        let (left, waits) = serial::sent(&self.open);
        let output = match self.output.look(now, left, waits) {
            Verdict::Fine => 0,
            Verdict::Broken if self.reset.safe => 0,
            Verdict::Broken => unwell::OUTPUT,
            Verdict::Reopen => {
                serial::unstick(&self.clocks, &self.open);
                self.output.reopened(serial::sent(&self.open).0);
                self.reopened = self.reopened.saturating_add(1);
                0
            }
        };
        self.watchdog.turned(now, application | output);
        if now >= EARLY_US
            && let Some(retained) = self.retained.take()
        {
            record::save_retained(&Retained {
                early: 0,
                ..retained
            });
        }
    }
}

impl run::Board for Board {
    type Sensor = Port;
    type Navigation = Port;
    type Command = Port;
    type Gnss = Port;
    type Time = Time;

    fn lines(&mut self) -> (&mut Lines<Port, Port, Port, Port>, &Time) {
        (&mut self.lines, &self.time)
    }

    fn open(&mut self, lines: &SerialLines) {
        let exchanged = |lines: &SerialLines| lines.pins == pins::EXCHANGED;
        if exchanged(&self.open) != exchanged(lines) {
            core::mem::swap(&mut self.lines.navigation, &mut self.lines.gnss);
        }
        self.watchdog.long_work(); // the bytes to be sent may take 20 ms a line
        serial::reopen(&self.clocks, self.dma, &self.open, lines);
        self.open = *lines;
        self.output.reopened(serial::sent(lines).0);
    }

    /// While the flash is erased, no turn comes in time.
    fn turned(&mut self, unhealthy: u8, erases: bool) {
        if !erases {
            self.guard(unhealthy);
        }
    }

    fn during(&mut self, phase: LoopPhase) {
        record::during(phase);
    }

    fn burst<'f>(&mut self, frame: &'f mut [u8; LONGEST]) -> Option<&'f mut [u8]> {
        if !self.adis {
            return None;
        }
        spi::burst(frame).unwrap_or_else(|Lost| {
            self.lost = true;
            None
        })
    }

    fn has_lost(&mut self) -> bool {
        core::mem::take(&mut self.lost)
    }

    /// Until a sensor is found, or until something has come on the sensor's line.
    fn look_for_adis(&mut self, rate: impl FnOnce() -> Option<Rate>) -> Option<DetectedSensor> {
        if !self.adis {
            return None;
        }
        let looked = self.looked_us?;
        let now = self.time.now_us();
        if now.saturating_sub(looked) < LOOK_US {
            return None;
        }
        let may_be = self.has_adis || self.lines.sensor.is_silent();
        self.looked_us = may_be.then_some(now);
        self.looked_us?;
        self.watchdog.long_work();
        let found = self.spi.find(rate())?;
        defmt::println!("ADIS, {=f64} bursts a second", found.rate);
        (self.looked_us, self.has_adis) = (None, true);
        Some(found)
    }

    fn forget_adis(&mut self) {
        if self.adis {
            self.spi.forget();
            self.looked_us = Some(0);
        }
    }

    fn has(&mut self, bytes: usize) -> bool {
        !self.lines.sensor.want(bytes)
    }

    fn pulse(&mut self) -> Option<u64> {
        self.pulse.rose(&self.time)
    }

    /// A job of two records erases twice, and each erasure has the whole time.
    fn long_work(&mut self) {
        self.watchdog.long_work();
        self.watchdog.feed();
    }

    fn state(&self) -> (bool, u16) {
        (supply::is_low(), self.reopened)
    }
}
