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

use cortex_m::peripheral::NVIC;
use firmware::app::Lines;

use self::uart::{COMMAND, GNSS, Interrupt, NAVIGATION, SENSOR};
use crate::shared::time::Time;
use crate::shared::wake;
use firmware::link::uart::Port;

/// Core and bus clock, Hz.
const CLOCK: u32 = 25_000_000;

/// The board, running.
pub struct Board {
    /// The four serial lines.
    pub lines: Lines<Port<'static>, Port<'static>, Port<'static>, Port<'static>>,
    /// Time since start.
    pub time: Time,
}

impl Board {
    /// Starts everything. `None` when called a second time.
    pub fn start() -> Option<Self> {
        let core = cortex_m::Peripherals::take()?;
        let lines = Lines {
            sensor: SENSOR.open(CLOCK / 921_600, || NVIC::pend(Interrupt(1))),
            navigation: NAVIGATION.open(CLOCK / 921_600, || NVIC::pend(Interrupt(3))),
            gnss: GNSS.open(CLOCK / 115_200, || NVIC::pend(Interrupt(5))),
            command: COMMAND.open(CLOCK / 921_600, || NVIC::pend(Interrupt(19))),
        };
        uart::unmask();
        Some(Self {
            lines,
            time: Time::start(core.SYST, CLOCK),
        })
    }

    /// To be called in every turn of the main loop. With nothing left to do, the board sleeps until
    /// the sensor has sent `needs` bytes more, another line has received something, or a
    /// millisecond is over.
    pub fn turned(&mut self, busy: bool, needs: usize) {
        if !busy && self.lines.sensor.want(needs) {
            self.time.slept(wake::sleep());
        }
    }
}
