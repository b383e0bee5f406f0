//! The bus of the core: the emulator's, except for the peripherals of this program.

use std::ops::Range;
use std::sync::Arc;

use rp2350_emu::Bus;
use rp2350_emu::core::CoreBus;
use rp2350_emu::threaded::CoreAtomics;

use crate::gaps::known;
use crate::uart::Uart;
use crate::usb::Usb;

const UARTS: [u32; 2] = [0x4007_0000, 0x4007_8000];
/// Address of UART1 in the emulator.
const THEIR_UART: u32 = 0x4007_4000;
const USB: u32 = 0x5011_0000;
const USB_MEMORY: u32 = 0x5010_0000;
/// Address where the boot ROM leaves the function that enables execution from flash.
const BOOT_RAM: u32 = 0x400E_0000;
/// SSPCR1 of SPI0. The emulator's SPI receives only what it sends, by this bit. So a search for a
/// sensor reads its own command, which is no product number.
const SPI_CONTROL: u32 = 0x4008_0004;
const LOOP_BACK: u32 = 1;
/// STIR: triggers the interrupt of this number. The emulator does not have it.
const TRIGGER: u32 = 0xE000_EF00;
/// NVIC_IPR, a byte for each interrupt. The emulator has word access only.
const PRIORITIES: Range<u32> = 0xE000_E400..0xE000_E434;
/// Two instructions `BX LR`: return.
const RETURN: u32 = 0x4770_4770;
const TICKS: u32 = 0x4010_8000;
/// Interrupts of the two UARTs and of USB.
pub const LINES: [u32; 3] = [33, 34, 14];

/// The peripherals of this program.
#[derive(Debug, Default)]
pub struct Own {
    /// UART0, the sensor's, and UART1, the navigation computer's.
    pub uarts: [Uart; 2],
    /// The command link.
    pub usb: Usb,
    /// Address of the instruction that the core is about to run.
    pub pc: u32,
    /// Whether UART1 is the emulator's.
    pub theirs: bool,
    /// The cycle now.
    pub now: u64,
    /// The next cycle at which a UART does something.
    pub next: u64,
    /// An interrupt and its priority, written by the last instruction.
    pub priority: Option<(usize, u8)>,
    /// Levels of the interrupt lines as last reported.
    pub reported: [bool; 3],
    /// Whether one of them has changed.
    pub changed: bool,
}

/// A decoded address: peripheral and offset in it.
enum Decoded {
    Uart(usize, u32),
    Usb(u32),
    UsbMemory(u32),
    BootRam,
}

impl Own {
    fn decode(&self, address: u32) -> Option<Decoded> {
        if !matches!(address >> 20, 0x400 | 0x501) {
            return None;
        }
        let offset = address & 0xFFF;
        match address & !0x3FFF {
            block if block == UARTS[0] => Some(Decoded::Uart(0, offset)),
            block if block == UARTS[1] && !self.theirs => Some(Decoded::Uart(1, offset)),
            USB => Some(Decoded::Usb(offset)),
            USB_MEMORY => Some(Decoded::UsbMemory(offset)),
            BOOT_RAM => Some(Decoded::BootRam),
            _ => None,
        }
    }

    fn read(&mut self, address: u32, bytes: usize) -> Option<u32> {
        let decoded = self.decode(address)?;
        self.changed = true;
        Some(match decoded {
            Decoded::Uart(which, offset) => {
                let uart = &mut self.uarts[which];
                uart.advance(self.now);
                uart.read(offset)
            }
            Decoded::Usb(offset) => self.usb.read(offset),
            Decoded::UsbMemory(offset) => self.usb.load(offset, bytes),
            Decoded::BootRam => RETURN,
        })
    }

    /// Writes a register. Returns true if it belongs to one of these.
    fn write(&mut self, address: u32, value: u32, bytes: usize) -> bool {
        let Some(decoded) = self.decode(address) else {
            return false;
        };
        self.changed = true;
        let alias = address >> 12 & 3;
        let value = |old: u32| match alias {
            0 => value,
            1 => old ^ value,
            2 => old | value,
            _ => old & !value,
        };
        match decoded {
            Decoded::Uart(which, offset) => {
                let uart = &mut self.uarts[which];
                uart.advance(self.now);
                let old = if alias == 0 { 0 } else { uart.read(offset) };
                uart.write(offset, value(old), self.now);
            }
            Decoded::Usb(offset) => self.usb.write(offset, value(self.usb.read(offset))),
            Decoded::UsbMemory(offset) => self.usb.store(offset, value(0), bytes),
            Decoded::BootRam => {}
        }
        true
    }

    /// Advances the UARTs to this cycle.
    pub fn advance(&mut self, now: u64) {
        self.now = now;
        if now < self.next {
            return;
        }
        for uart in &mut self.uarts {
            uart.advance(now);
        }
        self.changed = true;
    }

    /// Levels of the interrupt lines. Also updates the time of the next event.
    pub fn settle(&mut self) -> [bool; 3] {
        self.changed = false;
        self.next = self.uarts.iter().map(Uart::next).min().unwrap_or(u64::MAX);
        let [first, second] = [0, 1].map(|n: usize| self.uarts[n].interrupts());
        [first, second, self.usb.interrupts()]
    }
}

/// The emulator's bus and our peripherals.
pub struct Fabric<'a> {
    /// The emulator's.
    pub bus: &'a mut Bus,
    /// Ours.
    pub own: &'a mut Own,
}

impl Fabric<'_> {
    /// Converts core cycles, which the emulator counts, to the chip's ticks (12 MHz).
    fn ticks(&self, cycles: u32) -> u32 {
        let by = u64::from(self.bus.sys_clk_hz()) * u64::from(cycles);
        (by / u64::from(self.bus.ref_clk_hz())) as u32
    }
}

/// The emulator's address for an address of the chip.
const fn theirs(address: u32) -> u32 {
    match address & !0x3FFF == UARTS[1] {
        true => address - UARTS[1] + THEIR_UART,
        false => address,
    }
}

/// Whether an address is a CYCLES register of the tick generators.
const fn is_ticks(address: u32) -> bool {
    address & !0x3FFF == TICKS && (address & 0x7F) % 12 == 4
}

macro_rules! forward {
    ($($name:ident(&self $(, $argument:ident: $of:ty)*) $(-> $returns:ty)?;)*) => {
        $(fn $name(&self $(, $argument: $of)*) $(-> $returns)? {
            CoreBus::$name(self.bus $(, $argument)*)
        })*
    };
    ($($name:ident(&mut self $(, $argument:ident: $of:ty)*) $(-> $returns:ty)?;)*) => {
        $(fn $name(&mut self $(, $argument: $of)*) $(-> $returns)? {
            CoreBus::$name(self.bus $(, $argument)*)
        })*
    };
}

impl CoreBus for Fabric<'_> {
    fn set_active_pc(&mut self, pc: u32, core: u8) {
        self.own.pc = pc;
        self.bus.set_active_pc(pc, core);
    }

    fn read8(&mut self, address: u32, core: u8) -> u8 {
        let own = self.own.read(address, 1);
        own.map_or_else(|| self.bus.read8(address, core), |word| word as u8)
    }

    fn read16(&mut self, address: u32, core: u8) -> u16 {
        // an instruction, half by half
        if let half @ (0 | 2) = address.wrapping_sub(self.own.pc) {
            let [first, second] = [0, 2].map(|at| self.bus.read16(self.own.pc + at, core));
            return known(first, second)[half as usize / 2];
        }
        let own = self.own.read(address, 2);
        own.map_or_else(|| self.bus.read16(address, core), |word| word as u16)
    }

    fn read32(&mut self, address: u32, core: u8) -> u32 {
        let own = self.own.read(address, 4);
        own.unwrap_or_else(|| self.bus.read32(theirs(address), core))
    }

    fn write8(&mut self, address: u32, value: u8, core: u8) {
        if !self.own.write(address, value.into(), 1) {
            self.bus.write8(address, value, core);
        }
    }

    fn write16(&mut self, address: u32, value: u16, core: u8) {
        if !self.own.write(address, value.into(), 2) {
            self.bus.write16(address, value, core);
        }
    }

    fn write32(&mut self, address: u32, value: u32, core: u8) {
        if self.own.write(address, value, 4) {
            return;
        }
        if address == UARTS[1] {
            self.own.uarts[1].sent.push(value as u8);
            self.own.uarts[1].began.push(self.own.now);
        }
        let address = theirs(address);
        let value = match address {
            SPI_CONTROL => value | LOOP_BACK,
            _ if is_ticks(address) => self.ticks(value),
            _ => value,
        };
        self.bus.write32(address, value, core);
    }

    /// With the trace, the core reports accesses to its own registers, which do not reach the bus.
    fn mmio_trace_enabled(&self) -> bool {
        true
    }

    fn emit_mmio_trace(&mut self, rw: char, bytes: u32, address: u32, value: u32, _: u8) {
        if rw == 'W' && address == TRIGGER {
            self.bus.atomics.assert_irq(0, value & 0x1FF);
        }
        if rw == 'W' && bytes == 1 && PRIORITIES.contains(&address) {
            let number = (address - PRIORITIES.start) as usize;
            self.own.priority = Some((number, value as u8));
        }
    }

    forward! {
        bus_fault(&self, core: u8) -> bool;
        bus_fault_addr(&self, core: u8) -> u32;
        atomics(&self) -> &Arc<CoreAtomics>;
        gpio_read_out(&self) -> u32;
        gpio_read_oe(&self) -> u32;
        gpio_read_in(&self) -> u32;
        extra_wait_states(&self) -> u32;
        last_fetch_addr(&self) -> u32;
    }

    forward! {
        clear_bus_fault(&mut self, core: u8);
        set_burst_mode(&mut self, on: bool);
        add_extra_wait_states(&mut self, n: u32);
        take_extra_wait_states(&mut self) -> u32;
        gpio_write_out(&mut self, value: u32);
        gpio_set_out(&mut self, mask: u32);
        gpio_clear_out(&mut self, mask: u32);
        gpio_xor_out(&mut self, mask: u32);
        gpio_write_oe(&mut self, value: u32);
        gpio_set_oe(&mut self, mask: u32);
        gpio_clear_oe(&mut self, mask: u32);
        gpio_xor_oe(&mut self, mask: u32);
        reset_extra_wait_states(&mut self);
        set_last_fetch_addr(&mut self, address: u32);
    }
}
