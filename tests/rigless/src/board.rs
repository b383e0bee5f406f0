//! The boards: a chip of rigless, a crystal, and the other ends of the lines.
use anyhow::{Context, Result};
use rigless::machine::stm32f427_bench::Stm32f427Bench;
use rigless::machine::stm32h743_bench::Stm32h743Bench;
use rigless::machine::{Board, Target};
use rigless::mcu::Mcu;
use rigless::snapshot::Store;
use rigless::soc::stm32f427::peripherals::SERIAL_PORTS;
use rigless::soc::stm32h743::generated::otg1_hs_global::Register;
use rigless::soc::stm32h743::peripherals::usart;

use crate::asked::Chip;
use crate::line::Line;

/// The H743's USB at PA11 and PA12, and where its flags are.
const USB: &str = "OTG2_HS_GLOBAL";
const USB_FLAGS: u64 = 0x4008_0014;

/// A board.
#[derive(Debug)]
pub struct Ours {
    bench: Bench,
    instructions: std::num::NonZeroU64,
}

#[derive(Debug)]
enum Bench {
    F427(Box<Stm32f427Bench>),
    H743(Box<Stm32h743Bench>),
}

impl Store for Ours {}

impl Ours {
    pub fn new(chip: Chip, crystal: u64, instructions: u64) -> Result<Self> {
        let mut bench = match chip {
            Chip::F427 => Bench::F427(Box::new(Stm32f427Bench::new()?)),
            Chip::H743 => Bench::H743(Box::new(Stm32h743Bench::new()?)),
        };
        match &mut bench {
            Bench::F427(bench) => {
                bench.mcu.rcc.attach_crystals(crystal, 0);
                for port in &mut bench.mcu.usart {
                    port.attach(Line::default());
                }
            }
            Bench::H743(bench) => {
                bench.mcu.rcc.attach_crystals(crystal, 0);
                for port in &mut bench.mcu.usart {
                    port.attach(Line::default());
                }
            }
        }
        let instructions = instructions.try_into().context("no instructions")?;
        Ok(Self { bench, instructions })
    }

    /// What rigless leaves out of a write that the core has made: its USB of the H743 is memory, in
    /// which a flag that is cleared by writing 1 (RM0433 57.14.6) stays set for ever.
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
        let held = registers.get(Register::OtgHsGintsts);
        registers.set(Register::OtgHsGintsts, held & !value);
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
        match &mut self.bench {
            Bench::F427(bench) => bench.mcu(target),
            Bench::H743(bench) => bench.mcu(target),
        }
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let mut targets = match &mut self.bench {
            Bench::F427(bench) => bench.targets(),
            Bench::H743(bench) => bench.targets(),
        };
        for target in &mut targets {
            target.core.instructions_per_second = self.instructions;
        }
        targets
    }
}
