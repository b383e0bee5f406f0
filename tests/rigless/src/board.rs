//! The boards: a chip of rigless with the peers at its pins.
use std::num::NonZeroU64;

use anyhow::{Context, Result};
use rigless::chip::spi::Peer;
use rigless::device::Level;
use rigless::machine::stm32f427_bench::Stm32f427Bench;
use rigless::machine::stm32h743_bench::Stm32h743Bench;
use rigless::machine::{Board, Target};
use rigless::mcu::Mcu;
use rigless::snapshot::Store;
use rigless::soc::stm32f427::generated::rcc as rcc_f427;
use rigless::soc::stm32f427::peripherals::{self as f427, PORTS, SERIAL_PORTS};
use rigless::soc::stm32h743::generated::otg1_hs_global::Register as Usb;
use rigless::soc::stm32h743::generated::rcc as rcc_h743;
use rigless::soc::stm32h743::peripherals::{gpio, spi, usart};
use rigless::time::VirtualNanos;

use crate::adis::Adis;
use crate::line::Line;
use crate::request::{Chip, RunRequest};

/// The H743's USB at PA11 and PA12, and where its flags are.
const USB: &str = "OTG2_HS_GLOBAL";
const USB_FLAGS: u64 = 0x4008_0014;

/// A board.
#[derive(Debug)]
pub struct Ours {
    bench: Bench,
    instructions: NonZeroU64,
    crystal: bool,
    /// The sensor, and the pin of its data-ready.
    pub adis: Option<(Adis, (String, u8))>,
}

#[derive(Debug)]
enum Bench {
    F427(Box<Stm32f427Bench>),
    H743(Box<Stm32h743Bench>),
}

impl Store for Ours {}

impl Ours {
    /// A board for a run.
    pub fn new(request: &RunRequest) -> Result<Self> {
        let mut bench = match request.chip {
            Chip::F427 => Bench::F427(Box::new(Stm32f427Bench::new()?)),
            Chip::H743 => Bench::H743(Box::new(Stm32h743Bench::new()?)),
        };
        match &mut bench {
            Bench::F427(bench) => {
                bench.mcu.rcc.attach_crystals(request.crystal, 0);
                for port in &mut bench.mcu.usart {
                    port.attach(Line::default());
                }
            }
            Bench::H743(bench) => {
                bench.mcu.rcc.attach_crystals(request.crystal, 0);
                for port in &mut bench.mcu.usart {
                    port.attach(Line::default());
                }
            }
        }
        let adis = request
            .adis
            .as_ref()
            .map(|request| (Adis::new(request), request));
        if let Some((adis, request)) = &adis {
            bench.attach(adis.clone(), &request.select)?;
        }
        Ok(Self {
            bench,
            instructions: request.instructions.try_into().context("no instructions")?,
            crystal: request.crystal != 0,
            adis: adis.map(|(adis, request)| (adis, request.ready.clone())),
        })
    }

    /// Corrects what rigless does not model, after every event. In rigless an oscillator without a
    /// crystal becomes ready; here it never does. Each read by the core comes after such a
    /// correction.
    pub fn mend(&mut self) {
        if self.crystal {
            return;
        }
        match &mut self.bench {
            Bench::F427(bench) => {
                let (_, registers) = bench.mcu.clocks();
                let held = registers.get(rcc_f427::Register::Cr);
                let held = rcc_f427::cr::HSERDY.set(held, 0);
                registers.set(rcc_f427::Register::Cr, held);
            }
            Bench::H743(bench) => {
                let (_, registers) = bench.mcu.clocks();
                let held = registers.get(rcc_h743::Register::Cr);
                let held = rcc_h743::cr::HSERDY.set(held, 0);
                registers.set(rcc_h743::Register::Cr, held);
            }
        }
    }

    /// Follows a write of the core. In rigless the USB of the H743 is plain memory, in which
    /// a flag that is cleared by writing 1 (RM0433 57.14.6) would stay set for ever.
    pub fn written(&mut self, address: u64, value: u64) {
        let Bench::H743(bench) = &mut self.bench else {
            return;
        };
        if address != USB_FLAGS {
            return;
        }
        let bus = bench.mcu.bus_mut();
        let slot = bus.peripherals().position(|found| found.name == USB);
        let Some(slot) = slot else { return };
        let registers = bus.slot_mut(slot).registers_mut();
        let held = registers.get(Usb::OtgHsGintsts);
        registers.set(Usb::OtgHsGintsts, held & !value);
    }

    /// Drives a pin from outside.
    pub fn drive(&mut self, at: VirtualNanos, (port, pin): &(String, u8), level: Level) {
        match &mut self.bench {
            Bench::F427(bench) => {
                let Some(nth) = PORTS.iter().position(|name| name == port) else {
                    return;
                };
                bench.mcu.drive_port(at, nth, |port, registers, context| {
                    if let Some(pin) = f427::gpio::Pin::new(*pin) {
                        port.drive(pin, Some(level), registers, context);
                    }
                });
            }
            Bench::H743(bench) => {
                let Some(nth) = PORTS.iter().position(|name| name == port) else {
                    return;
                };
                bench.mcu.drive_port(at, nth, |port, registers, context| {
                    if let Some(pin) = gpio::Pin::new(*pin) {
                        port.drive(pin, Some(level), registers, context);
                    }
                });
            }
        }
    }

    /// The other end of a UART.
    pub fn line(&mut self, name: &str) -> Result<&mut Line> {
        let line = match &mut self.bench {
            Bench::F427(bench) => {
                let n = SERIAL_PORTS.iter().position(|port| port.instance == name);
                bench.mcu.usart[n.with_context(|| name.to_owned())?].chip_mut()
            }
            Bench::H743(bench) => {
                let n = usart::INSTANCES.iter().position(|port| *port == name);
                bench.mcu.usart[n.with_context(|| name.to_owned())?].chip_mut()
            }
        };
        line.context("another end")
    }
}

impl Bench {
    /// Connects a chip at SPI1 with this chip select, instead of the bench's own.
    fn attach(&mut self, peer: impl Peer, (port, pin): &(String, u8)) -> Result<()> {
        match self {
            Self::F427(bench) => {
                let (first, others) = bench.mcu.spi.split_at_mut(1);
                others[4].inherit(&mut first[0]);
                let port = PORTS.iter().find(|name| *name == port);
                let select = f427::spi::Select {
                    port: port.context("a port")?,
                    pin: f427::gpio::Pin::new(*pin).context("a pin")?,
                    active: Level::Low,
                };
                first[0].attach_selected(peer, select);
            }
            Self::H743(bench) => {
                let (first, others) = bench.mcu.spi.split_at_mut(1);
                others[4].inherit(&mut first[0]);
                let port = PORTS.iter().find(|name| *name == port);
                let select = spi::Select {
                    port: port.context("a port")?,
                    pin: gpio::Pin::new(*pin).context("a pin")?,
                    active: Level::Low,
                };
                first[0].attach_selected(peer, select);
            }
        }
        Ok(())
    }

    fn board(&mut self) -> &mut dyn Board {
        match self {
            Self::F427(bench) => bench.as_mut(),
            Self::H743(bench) => bench.as_mut(),
        }
    }
}

impl Board for Ours {
    fn name(&self) -> &'static str {
        "ours"
    }

    fn target_names(&self) -> Vec<&'static str> {
        match &self.bench {
            Bench::F427(bench) => bench.target_names(),
            Bench::H743(bench) => bench.target_names(),
        }
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        self.bench.board().mcu(target)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let mut targets = self.bench.board().targets();
        for target in &mut targets {
            target.core.instructions_per_second = self.instructions;
        }
        targets
    }
}
