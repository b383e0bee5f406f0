//! Shared by the programs of both drivers: which subject to run, the reports, and what neither
//! driver has: the supply voltage detector, an invalid write to flash, the cause of a reset.
//!
//! A program reports words by the trace port of the core (Armv7-M C1.7), as on a board with a
//! debugger at SWO. The port's number says what the word is; `judges/stm32chip.py` reads them.

#![no_std]

pub mod registers;

use cortex_m::peripheral::{DCB, ITM};

/// The kind of a reported word.
#[derive(Clone, Copy)]
#[repr(usize)]
pub enum Report {
    /// A point in time: the model records the cycle.
    Mark = 0,
    /// Hz of the core, by the driver.
    Core = 1,
    /// Hz of the slow peripheral bus.
    Apb1 = 2,
    /// Hz of the fast one.
    Apb2 = 3,
    /// Bytes of one read.
    Read = 4,
    /// How often the line was found idle.
    Idle = 5,
    /// A word that was exchanged, or found in flash or a register.
    Word = 6,
    /// Result of an operation: 0, or a driver's error.
    Error = 7,
    /// Flags of RCC_CSR.
    Cause = 8,
    /// Seconds since midnight.
    Seconds = 9,
    /// Year, month and day: 20_240_229.
    Date = 10,
    /// Fraction of a second, us.
    Micros = 11,
    /// Interrupts served.
    Interrupts = 12,
    /// The end: 1.
    Done = 30,
    /// A panic: its line.
    Panic = 31,
}

/// The task of the program.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Set up clocks, and wait a millisecond.
    Clock(u32),
    /// Send received bytes back, by DMA both ways.
    Line,
    /// Read an ADIS at the SPI.
    Spi,
    /// Erase, write, read, and write without permission.
    Flash,
    /// The independent watchdog, fed twice.
    Watchdog,
    /// The window watchdog: fed, and once too early, or never.
    Window(bool),
    /// The calendar over the end of a year.
    Calendar,
    /// The supply voltage detector.
    Supply,
}

/// Address where the model puts the subject and its variant: the start of core-coupled memory.
const ASKED: usize = 0x1000_0000;

/// Reads the subject.
#[must_use]
pub fn subject() -> Subject {
    let [subject, variant] = [registers::read(ASKED), registers::read(ASKED + 4)];
    match subject {
        0 => Subject::Clock(variant),
        1 => Subject::Line,
        2 => Subject::Spi,
        3 => Subject::Flash,
        4 => Subject::Watchdog,
        5 => Subject::Window(variant == 0),
        6 => Subject::Calendar,
        _ => Subject::Supply,
    }
}

/// Switches the trace port on.
pub fn begin(debug: &mut DCB, trace: &mut ITM) {
    debug.enable_trace();
    // SAFETY: nothing else uses the trace port.
    #[allow(unsafe_code)]
    unsafe {
        trace.lar.write(0xC5AC_CE55);
        trace.ter[0].write(u32::MAX);
        trace.tcr.write(1);
    }
}

/// Reports a word.
pub fn report(what: Report, word: u32) {
    registers::write(0xE000_0000 + 4 * what as usize, word);
}

/// Reports the end and loops for ever.
pub fn done() -> ! {
    report(Report::Done, 1);
    loop {
        cortex_m::asm::wfi();
    }
}

/// Sent after the received bytes, without DMA.
pub const LAST: u8 = 0x5A;

/// Number of bytes received and sent on the line.
pub const BYTES: usize = 300;

/// Offset of the sector that the flash programs use: the last one.
pub const SECTOR: u32 = 0xE_0000;

/// The bytes that they write there.
pub const PATTERN: [u8; 24] = *b"a driver that is trusted";

/// Reports the words at the start of the sector, as the core reads them.
pub fn report_sector() {
    for n in 0..6 {
        report(
            Report::Word,
            registers::read(0x0800_0000 + SECTOR as usize + 4 * n),
        );
    }
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    report(Report::Panic, info.location().map_or(0, |at| at.line()));
    loop {
        cortex_m::asm::wfi();
    }
}
