//! Interrupts of serial lines whose other end is the program itself. The program makes them pending
//! and serves them as a board serves its UART, with memory instead of registers.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use firmware::link::uart::Uart;

use super::{dma, ticks};
use crate::replay::Wires;
use firmware::link::progress::NoStream;

static SENSOR: Uart = Uart::new();
static NAVIGATION: Uart = Uart::new();

/// Status (bit 0: a byte has arrived; bit 1: room for one to send) and data.
static REGISTERS: [AtomicU32; 2] = [AtomicU32::new(2), AtomicU32::new(0)];
const CAME: u32 = 1;
const ROOM: u32 = 2;
/// The main loop has work to do.
pub(super) static AWAKE: AtomicBool = AtomicBool::new(false);

/// Interrupt numbers, which every machine has.
#[derive(Clone, Copy)]
pub(super) enum Line {
    /// The sensor's UART.
    Sensor,
    /// The navigation computer's.
    Navigation,
    /// The stream that receives from the sensor.
    SensorIn,
    /// The stream that sends to the navigation computer.
    NavigationOut,
    /// The stream that receives from it.
    NavigationIn,
}

// SAFETY: the numbers are lines of every machine's controller and entries of the table below.
unsafe impl InterruptNumber for Line {
    fn number(self) -> u16 {
        self as u16
    }
}

/// The lines. Their interrupts are still masked.
pub fn wires() -> Wires<'static> {
    Wires {
        sensor: &SENSOR,
        navigation: &NAVIGATION,
        streams: [NoStream; 2],
        pend: [|| (); 3],
        came,
        left,
        ticks,
        let_through: Some(let_through),
    }
}

fn let_through() {
    unmask(&[Line::Sensor, Line::Navigation]);
}

/// Enables interrupts, except those that are already pending.
pub(super) fn unmask(lines: &[Line]) {
    for &line in lines {
        NVIC::unpend(line);
        // SAFETY: no critical section relies on a masked interrupt.
        unsafe { NVIC::unmask(line) };
    }
}

fn came(_: &Uart, byte: u8) -> bool {
    REGISTERS[1].store(byte.into(), Ordering::Relaxed);
    REGISTERS[0].store(CAME | ROOM, Ordering::Relaxed);
    NVIC::pend(Line::Sensor);
    cortex_m::asm::isb(); // it is served here
    woken()
}

/// Whether the main loop has work to do; clears the flag.
#[inline(always)]
pub(super) fn woken() -> bool {
    let awake = AWAKE.load(Ordering::Relaxed);
    if awake {
        AWAKE.store(false, Ordering::Relaxed);
    }
    awake
}

fn left(_: &Uart) -> Option<u8> {
    REGISTERS[0].store(ROOM, Ordering::Relaxed);
    NVIC::pend(Line::Navigation);
    cortex_m::asm::isb();
    let sent = REGISTERS[0].load(Ordering::Relaxed) & ROOM == 0;
    sent.then(|| REGISTERS[1].load(Ordering::Relaxed) as u8)
}

/// Serves a UART as the boards' handlers do: the received byte, then one for the transmitter.
#[inline(always)]
fn serve(line: &Uart) {
    let status = REGISTERS[0].load(Ordering::Relaxed);
    if status & CAME != 0 && line.came(REGISTERS[1].load(Ordering::Relaxed) as u8) {
        AWAKE.store(true, Ordering::Relaxed);
    }
    if status & ROOM != 0
        && let Some(byte) = line.next()
    {
        REGISTERS[1].store(byte.into(), Ordering::Relaxed);
        REGISTERS[0].store(0, Ordering::Relaxed);
    }
}

extern "C" fn sensor() {
    serve(&SENSOR);
}
extern "C" fn navigation() {
    serve(&NAVIGATION);
}

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name with its
// feature `device`; each entry is the address of a function of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [extern "C" fn(); 5] = [
    sensor,
    navigation,
    dma::sensor_in,
    dma::navigation_out,
    dma::navigation_in,
];
