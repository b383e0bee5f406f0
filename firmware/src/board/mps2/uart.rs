//! CMSDK APB UART: registers and interrupts.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use volatile_register::RW;

use crate::shared::cut::{masked, masked_cut};
use crate::shared::wake::wake;
use firmware::link::cut::Cut;
use firmware::link::uart::{self, Port};

/// Registers (Arm DDI 0479, table 4-5).
#[repr(C)]
struct Registers {
    data: RW<u32>,
    /// Bit 0: the transmitter is full; 1: a byte has come; 2, 3: one was overrun, sending and
    /// receiving (write 1 to clear).
    state: RW<u32>,
    /// Bits 0, 1: sending, receiving enabled; 2, 3: their interrupts.
    control: RW<u32>,
    /// Bits 0, 1: sending, receiving; write 1 to clear.
    interrupt: RW<u32>,
    /// Clock divided by bit rate, at least 16.
    divider: RW<u32>,
}

const FULL: u32 = 1 << 0;
const CAME: u32 = 1 << 1;
const OVERRUN: u32 = 1 << 3;
const ENABLE: u32 = 0b1111;
const BOTH: u32 = 0b11;

/// Rounds of waiting until what is to be sent has left: some 20 ms.
const PATIENCE: u32 = 50_000;

/// One UART.
pub struct Uart {
    address: usize,
    line: uart::Uart,
}

/// Sensor.
pub static SENSOR: Uart = Uart::at(0x4000_4000);
/// Navigation computer.
pub static NAVIGATION: Uart = Uart::at(0x4000_5000);
/// Receiver.
pub static GNSS: Uart = Uart::at(0x4000_6000);
/// Command link.
pub static COMMAND: Uart = Uart::at(0x4000_7000);

/// An input of the interrupt controller (Arm DAI 0386, table 3-4: receive, transmit of UART 0, 1,
/// 2, 3).
#[derive(Clone, Copy)]
pub struct Interrupt(pub u16);
const LINES: [u16; 8] = [0, 1, 2, 3, 4, 5, 18, 19];

// SAFETY: these numbers are inputs of this board's controller and do not change.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self.0
    }
}

/// Lets the interrupts through.
pub fn unmask() {
    for line in LINES {
        // SAFETY: the lines are open, and no critical section relies on a masked interrupt.
        unsafe { NVIC::unmask(Interrupt(line)) };
    }
}

impl Uart {
    const fn at(address: usize) -> Self {
        Self {
            address,
            line: uart::Uart::new(),
        }
    }

    fn registers(&self) -> &Registers {
        // SAFETY: `at` is private and called with the addresses of UARTs, which exist for ever.
        // Access is volatile.
        unsafe { &*(self.address as *const Registers) }
    }

    fn write(register: &RW<u32>, value: u32) {
        // SAFETY: no value of these registers touches memory.
        unsafe { register.write(value) };
    }

    /// Starts it; called once.
    pub fn open(&'static self, divider: u32, pend: fn()) -> Port<'static> {
        Self::write(&self.registers().divider, divider);
        Self::write(&self.registers().control, ENABLE);
        self.line.port(pend)
    }

    /// Reopens it with another divider. `interrupts`: its numbers. What has come stays; what is
    /// to be sent has some time to leave, and the rest is lost.
    pub fn reopen(&self, divider: u32, interrupts: [u16; 2]) {
        let left = || self.line.has_sent() && self.registers().state.read() & FULL == 0;
        let _ = (0..PATIENCE).any(|_| left());
        for number in interrupts {
            NVIC::mask(Interrupt(number));
        }
        Self::write(&self.registers().control, 0);
        self.line.closed(0);
        Self::write(&self.registers().divider, divider);
        Self::write(&self.registers().control, ENABLE);
        for number in interrupts {
            // SAFETY: as in `unmask`.
            unsafe { NVIC::unmask(Interrupt(number)) };
        }
    }

    /// As [`Self::open`]; frames of [`SENSOR`] leave on this port while they arrive.
    pub fn open_cut(&'static self, divider: u32, pend: fn()) -> Port<'static> {
        self.open(divider, pend).with_cut(masked)
    }

    /// The sensor's receiving and sending interrupt, which also cuts its frames through.
    #[inline(always)]
    fn serve_sensor(&self) {
        let uart = self.registers();
        Self::write(&uart.interrupt, BOTH);
        let state = uart.state.read();
        if state & CAME != 0 {
            let byte = uart.data.read() as u8;
            let (woken, sends) =
                masked_cut(|cut| self.line.came_through(byte, cut, &NAVIGATION.line));
            if sends {
                NVIC::pend(Interrupt(3));
            }
            if woken {
                wake();
            }
        }
        if state & OVERRUN != 0 {
            Self::write(&uart.state, OVERRUN);
            self.line.lost();
            masked_cut(Cut::end);
            wake();
        }
        self.send();
    }

    /// For the interrupt of either direction. It takes the byte that came, then gives the
    /// transmitter what it has room for. The transmitter interrupts again when its one byte has
    /// left.
    #[inline(always)]
    fn serve(&self) {
        let uart = self.registers();
        Self::write(&uart.interrupt, BOTH);
        let state = uart.state.read();
        if state & CAME != 0 && self.line.came(uart.data.read() as u8) {
            wake();
        }
        if state & OVERRUN != 0 {
            Self::write(&uart.state, OVERRUN);
            self.line.lost();
            wake();
        }
        self.send();
    }

    /// Gives the transmitter what it has room for.
    #[inline(always)]
    fn send(&self) {
        let uart = self.registers();
        while uart.state.read() & FULL == 0 {
            match self.line.next() {
                Some(byte) => Self::write(&uart.data, byte.into()),
                None => break,
            }
        }
    }
}

extern "C" fn sensor() {
    SENSOR.serve_sensor();
}
extern "C" fn navigation() {
    NAVIGATION.serve();
}
extern "C" fn gnss() {
    GNSS.serve();
}
extern "C" fn command() {
    COMMAND.serve();
}

unsafe extern "C" {
    /// Of `cortex-m-rt`: stays in a loop.
    fn DefaultHandler();
}

const INTERRUPTS: usize = 32;

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its
// feature `device`. Each entry is the address of a function of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); INTERRUPTS] = {
    let mut table = [DefaultHandler as unsafe extern "C" fn(); INTERRUPTS];
    let handlers: [extern "C" fn(); 4] = [sensor, navigation, gnss, command];
    let mut n = 0;
    while n < LINES.len() {
        table[LINES[n] as usize] = handlers[n / 2];
        n += 1;
    }
    table
};
