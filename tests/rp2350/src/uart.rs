//! A UART of the chip: Arm's PL011 (DDI 0183, revision r1p5) with buffers of 32 bytes.
//!
//! The emulator's own has buffers of 16, receives nothing, and keeps its interrupt set while the
//! level of the buffer is exceeded, where the chip interrupts when it is crossed.

use std::collections::VecDeque;

/// Bytes of each buffer (RP2350 datasheet, 12.1: "32 × 8 TX and 32 × 12 RX").
const DEPTH: usize = 32;

/// Interrupts, in the order of UARTRIS.
const RX: u32 = 1 << 4;
const TX: u32 = 1 << 5;
const TIMEOUT: u32 = 1 << 6;
/// Framing, parity, break, overrun: bits 7 to 10 of UARTRIS, bits 8 to 11 of UARTDR.
const ERRORS: u32 = 0xF << 7;
/// Error flags of a received byte, as in UARTDR.
pub const FRAMING: u16 = 1 << 8;
/// An overrun.
pub const OVERRUN: u16 = 1 << 11;

/// UARTCR: on, out, in.
const ENABLED: [u32; 3] = [1 << 0, 1 << 8, 1 << 9];

/// A UART.
#[derive(Debug, Default)]
pub struct Uart {
    registers: [u32; 19],
    ris: u32,
    into: VecDeque<u16>,
    out: VecDeque<u8>,
    /// When the byte in transmission has left.
    busy_until: Option<u64>,
    /// When the last byte arrived, until the pause after it is reported.
    came: Option<u64>,
    overrun: bool,
    /// Bytes that will arrive, and when their stop bits end, cycles.
    pub arrivals: VecDeque<(u64, u16)>,
    /// Bytes sent.
    pub sent: Vec<u8>,
    /// When the start bit of each byte sent began, cycles.
    pub began: Vec<u64>,
}

impl Uart {
    const DIVIDER: [usize; 2] = [9, 10];
    const FORMAT: usize = 11;
    const CONTROL: usize = 12;
    const LEVELS: usize = 13;
    const MASK: usize = 14;

    /// The divider of UARTIBRD and UARTFBRD: duration of a sixteenth of a bit, in cycles/64.
    pub fn divider(&self) -> u64 {
        let [whole, part] = Self::DIVIDER.map(|at| u64::from(self.registers[at]));
        whole * 64 + part
    }

    /// Bits per character, with start, stop and parity.
    pub fn bits(&self) -> u64 {
        let format = self.registers[Self::FORMAT];
        let [parity, two] = [1, 3].map(|bit| u64::from(format >> bit & 1));
        7 + u64::from(format >> 5 & 3) + parity + two
    }

    /// Duration of a number of bits, cycles.
    fn time(&self, bits: u64) -> u64 {
        bits * self.divider() / 4
    }

    fn is_on(&self, which: usize) -> bool {
        let control = self.registers[Self::CONTROL];
        control & ENABLED[0] != 0 && control & ENABLED[which] != 0
    }

    /// Buffer level at which it interrupts, bytes: transmit (0) or receive (1).
    fn level(&self, which: usize) -> usize {
        let select = self.registers[Self::LEVELS] >> (3 * which) & 7;
        DEPTH * [1, 2, 4, 6, 7][select.min(4) as usize] / 8
    }

    /// Level of the interrupt line.
    pub fn interrupts(&self) -> bool {
        self.ris & self.registers[Self::MASK] != 0
    }

    /// The next cycle at which something happens.
    pub fn next(&self) -> u64 {
        let arrival = self.arrivals.front().map(|(at, _)| *at);
        let pause = self.came.map(|at| at + self.time(32));
        [arrival, pause, self.busy_until]
            .into_iter()
            .flatten()
            .min()
            .unwrap_or(u64::MAX)
    }

    /// Advances it to this cycle.
    pub fn advance(&mut self, now: u64) {
        while let Some((at, byte)) = self.arrivals.pop_front_if(|(at, _)| *at <= now) {
            self.receive(at, byte);
        }
        if self.came.is_some_and(|at| at + self.time(32) <= now) {
            self.came = None;
            self.ris |= TIMEOUT;
        }
        while let Some(until) = self.busy_until.filter(|until| *until <= now) {
            self.busy_until = None;
            if let Some(byte) = self.out.pop_front() {
                self.begin(until, byte);
                // reported when the level is crossed, not while it is exceeded
                if self.out.len() == self.level(0) {
                    self.ris |= TX;
                }
            }
        }
    }

    fn begin(&mut self, at: u64, byte: u8) {
        self.sent.push(byte);
        self.began.push(at);
        self.busy_until = Some(at + self.time(self.bits()));
    }

    fn receive(&mut self, at: u64, mut byte: u16) {
        if !self.is_on(2) {
            return;
        }
        if self.into.len() == DEPTH || byte & OVERRUN != 0 {
            self.overrun = true;
            self.ris |= 1 << 10;
            return;
        }
        if self.overrun {
            byte |= OVERRUN;
            self.overrun = false;
        }
        self.ris |= u32::from(byte >> 8 & 7) << 7;
        self.into.push_back(byte);
        self.came = Some(at);
        if self.into.len() >= self.level(1) {
            self.ris |= RX;
        }
    }

    fn take(&mut self) -> u32 {
        let byte = self.into.pop_front().unwrap_or(0);
        if self.into.len() < self.level(1) {
            self.ris &= !RX;
        }
        if self.into.is_empty() {
            self.ris &= !TIMEOUT;
            self.came = None;
        }
        u32::from(byte)
    }

    fn flags(&self) -> u32 {
        let busy = self.busy_until.is_some() || !self.out.is_empty();
        u32::from(busy) << 3
            | u32::from(self.into.is_empty()) << 4
            | u32::from(self.out.len() == DEPTH) << 5
            | u32::from(self.into.len() == DEPTH) << 6
            | u32::from(self.out.is_empty()) << 7
    }

    /// Reads a register.
    pub fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x00 => self.take(),
            0x18 => self.flags(),
            0x3C => self.ris,
            0x40 => self.ris & self.registers[Self::MASK],
            0x44 => 0,
            _ => *self.registers.get(offset as usize / 4).unwrap_or(&0),
        }
    }

    /// Writes a register, at this cycle.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        match offset {
            0x00 if !self.is_on(1) || self.out.len() == DEPTH => {}
            0x00 if self.busy_until.is_none() => self.begin(now, value as u8),
            0x00 => self.out.push_back(value as u8),
            0x44 => self.ris &= !(value & (RX | TX | TIMEOUT | ERRORS)),
            _ => {
                if let Some(register) = self.registers.get_mut(offset as usize / 4) {
                    *register = value;
                }
            }
        }
    }
}
