//! Arm MPS2 with the FPGA images AN386 (Cortex-M4F) and AN500 (Cortex-M7). It is the second board,
//! which shows that nothing outside the board folders depends on the first.
//!
//! Flash (here static memory) is at 0 and the clock is 25 MHz. CMSDK UARTs 0 to 3 are the sensor,
//! navigation, GNSS and command line (Arm DAI 0386 and DDI 0479, section 4.3). Tested in QEMU
//! (`mps2-an386`, `mps2-an500`).
#![allow(
    unsafe_code,
    reason = "registers and interrupt tables; each block says why it is sound"
)]

mod uart;

use cortex_m::peripheral::{NVIC, SCB};
use firmware::app::{Hardware, Lines, run};
use firmware::configuration::SerialLines;

use self::uart::{COMMAND, GNSS, Interrupt, NAVIGATION, SENSOR};
use crate::shared::time::Time;
use firmware::link::rates;
use firmware::link::uart::Port;

/// Core and bus clock, Hz.
const CLOCK: u32 = 25_000_000;

/// The four serial lines.
type FourLines = Lines<Port<'static>, Port<'static>, Port<'static>, Port<'static>>;

/// The board, running.
pub struct Board {
    /// The four serial lines.
    lines: FourLines,
    /// How they are open.
    open: SerialLines,
    /// Time since start.
    time: Time,
}

impl Board {
    /// Starts everything, and gives what sets the priority of PendSV. `None` when called a second
    /// time.
    pub fn start() -> Option<(SCB, Self)> {
        let core = cortex_m::Peripherals::take()?;
        let SerialLines {
            sensor_baud,
            receiver_baud,
            ..
        } = SerialLines::DEFAULT;
        let lines = Lines {
            sensor: SENSOR.open(divider(sensor_baud), || NVIC::pend(Interrupt(1))),
            navigation: NAVIGATION.open_cut(divider(sensor_baud), || NVIC::pend(Interrupt(3))),
            gnss: GNSS.open(divider(receiver_baud), || NVIC::pend(Interrupt(5))),
            command: COMMAND.open(divider(921_600), || NVIC::pend(Interrupt(19))),
        };
        uart::unmask();
        let board = Self {
            lines,
            open: SerialLines::DEFAULT,
            time: Time::start(core.SYST, CLOCK, None),
        };
        Some((core.SCB, board))
    }

    /// What the application must know. A CMSDK UART has neither parity nor a second stop bit.
    pub fn hardware() -> Hardware {
        Hardware {
            name: "mps2",
            clocks: [rates::Clock::cmsdk(CLOCK); 3],
            parity: false,
            pin_sets: 1,
            reset: None,
        }
    }
}

impl run::Board for Board {
    type Sensor = Port<'static>;
    type Navigation = Port<'static>;
    type Command = Port<'static>;
    type Gnss = Port<'static>;
    type Time = Time;

    fn lines(&mut self) -> (&mut FourLines, &Time) {
        (&mut self.lines, &self.time)
    }

    fn open(&mut self, lines: &SerialLines) {
        let old = core::mem::replace(&mut self.open, *lines);
        if old.sensor_baud != lines.sensor_baud {
            SENSOR.reopen(divider(lines.sensor_baud), [0, 1]);
            NAVIGATION.reopen(divider(lines.sensor_baud), [2, 3]);
        }
        if old.receiver_baud != lines.receiver_baud {
            GNSS.reopen(divider(lines.receiver_baud), [4, 5]);
        }
    }

    /// There is no watchdog.
    fn turned(&mut self, _: u8, _: bool) {}

    fn has(&mut self, bytes: usize) -> bool {
        !self.lines.sensor.want(bytes)
    }
}

/// The divider of a bit rate.
fn divider(baud: u32) -> u32 {
    rates::Clock::cmsdk(CLOCK).nearest(baud).divider
}
