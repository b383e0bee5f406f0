//! The USB device controller (RP2350 datasheet, 12.7), and a host that opens the device as a serial
//! line (CDC ACM).
//!
//! The emulator has registers and memory of the controller, but no host.

use std::collections::VecDeque;

const ADDRESS: usize = 0x00;
const SIE_CONTROL: usize = 0x4C;
const SIE_STATUS: usize = 0x50;
const BUFFERS: usize = 0x58;
const RAW: usize = 0x8C;
const ENABLED: usize = 0x90;
const FORCED: usize = 0x94;
const INTERRUPTS: usize = 0x98;

/// SIE_CTRL: the device attaches to the bus.
const PULL_UP: u32 = 1 << 16;
/// SIE_STATUS.
const SETUP: u32 = 1 << 17;
const RESET: u32 = 1 << 19;
/// A buffer's control word.
const AVAILABLE: u32 = 1 << 10;
const STALL: u32 = 1 << 11;
const DATA1: u32 = 1 << 13;
const FULL: u32 = 1 << 15;
const LENGTH: u32 = 0x3FF;
/// Bytes of a packet.
const PACKET: usize = 64;

/// Direction of an endpoint, seen from the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    In,
    Out,
}

/// What the host does next.
#[derive(Debug)]
enum Step {
    /// Waits for the device.
    Unplugged,
    /// Holds the bus in reset.
    Reset,
    /// Sends a request: eight bytes and, if any, data that follow.
    Ask,
    /// Reads what a request returns.
    Answer,
    /// Sends the data of a request.
    Follow,
    /// Ends a request.
    Status(Direction),
    /// Uses the line.
    Open,
    /// Gave up.
    Failed,
}

/// The controller and its host.
#[derive(Debug)]
pub struct Usb {
    registers: [u32; 0x120 / 4],
    memory: Box<[u8; 4096]>,
    step: Step,
    requests: VecDeque<([u8; 8], &'static [u8])>,
    answer: Vec<u8>,
    /// Endpoints of the line, in and out, and whether their next packet is DATA1.
    bulk: [Option<usize>; 2],
    odd: [bool; 2],
    control_odd: bool,
    /// Bytes for the device.
    pub to_device: VecDeque<u8>,
    /// Bytes from the device.
    pub from_device: Vec<u8>,
    /// The first error that the host found.
    pub wrong: Option<String>,
}

impl Default for Usb {
    fn default() -> Self {
        let requests: [([u8; 8], &[u8]); 6] = [
            ([0x80, 6, 0, 1, 0, 0, 18, 0], &[]),  // the device's descriptor
            ([0x00, 5, 7, 0, 0, 0, 0, 0], &[]),   // address 7
            ([0x80, 6, 0, 2, 0, 0, 255, 0], &[]), // the configuration's descriptor
            ([0x00, 9, 1, 0, 0, 0, 0, 0], &[]),   // configuration 1
            ([0x21, 0x20, 0, 0, 0, 0, 7, 0], &[0, 0xC2, 1, 0, 0, 0, 8]), // 115 200 bit/s
            ([0x21, 0x22, 3, 0, 0, 0, 0, 0], &[]), // a terminal is there
        ];
        Self {
            registers: [0; 0x120 / 4],
            memory: Box::new([0; 4096]),
            step: Step::Unplugged,
            requests: requests.into(),
            answer: Vec::new(),
            bulk: [None; 2],
            odd: [false; 2],
            control_odd: false,
            to_device: VecDeque::new(),
            from_device: Vec::new(),
            wrong: None,
        }
    }
}

impl Usb {
    /// Whether the line is open.
    pub fn is_open(&self) -> bool {
        matches!(self.step, Step::Open)
    }

    fn raw(&self) -> u32 {
        let status = self.registers[SIE_STATUS / 4];
        u32::from(self.registers[BUFFERS / 4] != 0) << 4
            | u32::from(status & RESET != 0) << 12
            | u32::from(status & SETUP != 0) << 16
    }

    /// Level of the interrupt line.
    pub fn interrupts(&self) -> bool {
        self.read(INTERRUPTS as u32) != 0
    }

    /// Reads a register.
    pub fn read(&self, offset: u32) -> u32 {
        match offset as usize {
            RAW => self.raw(),
            INTERRUPTS => (self.raw() | self.registers[FORCED / 4]) & self.registers[ENABLED / 4],
            at => *self.registers.get(at / 4).unwrap_or(&0),
        }
    }

    /// Writes a register.
    pub fn write(&mut self, offset: u32, value: u32) {
        let at = offset as usize;
        match at {
            SIE_STATUS | BUFFERS => self.registers[at / 4] &= !value,
            RAW | INTERRUPTS => {}
            _ => {
                if let Some(register) = self.registers.get_mut(at / 4) {
                    *register = value;
                }
            }
        }
    }

    /// Reads bytes of its memory.
    pub fn load(&self, offset: u32, bytes: usize) -> u32 {
        let at = offset as usize % 4096;
        let mut word = [0; 4];
        word[..bytes].copy_from_slice(&self.memory[at..at + bytes]);
        u32::from_le_bytes(word)
    }

    /// Writes bytes of its memory.
    pub fn store(&mut self, offset: u32, value: u32, bytes: usize) {
        let at = offset as usize % 4096;
        self.memory[at..at + bytes].copy_from_slice(&value.to_le_bytes()[..bytes]);
    }

    fn control_word(endpoint: usize, way: Direction) -> u32 {
        0x80 + endpoint as u32 * 8 + u32::from(way == Direction::Out) * 4
    }

    fn fail(&mut self, why: &str) {
        self.wrong.get_or_insert_with(|| why.to_owned());
        self.step = Step::Failed;
    }

    /// The buffer of an endpoint and its control word, when the device has given it to the bus.
    fn buffer(&mut self, endpoint: usize, way: Direction, odd: bool) -> Option<(usize, u32)> {
        let word = self.load(Self::control_word(endpoint, way), 4);
        if word & STALL != 0 {
            self.fail("an endpoint is stalled");
            return None;
        }
        if word & AVAILABLE == 0 {
            return None;
        }
        if (word & DATA1 != 0) != odd {
            self.fail("DATA0 and DATA1 are not in turn");
            return None;
        }
        if (word & FULL != 0) != (way == Direction::In) {
            self.fail("a buffer is full that waits, or empty that is to be sent");
            return None;
        }
        if endpoint == 0 {
            return Some((0x100, word));
        }
        let control = self.load(
            endpoint as u32 * 8 + u32::from(way == Direction::Out) * 4,
            4,
        );
        if control >> 31 == 0 {
            self.fail("an endpoint is used that is off");
            return None;
        }
        Some((control as usize & 0xFFC0, word))
    }

    fn done(&mut self, endpoint: usize, way: Direction, word: u32) {
        self.store(Self::control_word(endpoint, way), word & !AVAILABLE, 4);
        self.registers[BUFFERS / 4] |= 1 << (endpoint * 2 + usize::from(way == Direction::Out));
    }

    /// Takes a packet from the device, if it has one.
    fn packet_in(&mut self, endpoint: usize, odd: bool) -> Option<Vec<u8>> {
        let (at, word) = self.buffer(endpoint, Direction::In, odd)?;
        let packet = self.memory[at..at + (word & LENGTH) as usize].to_vec();
        self.done(endpoint, Direction::In, word & !FULL);
        Some(packet)
    }

    /// Gives the device a packet. Returns whether it accepts one.
    fn packet_out(&mut self, endpoint: usize, odd: bool, packet: &[u8]) -> bool {
        let Some((at, word)) = self.buffer(endpoint, Direction::Out, odd) else {
            return false;
        };
        self.memory[at..at + packet.len()].copy_from_slice(packet);
        self.done(
            endpoint,
            Direction::Out,
            word & !LENGTH | packet.len() as u32 | FULL,
        );
        true
    }

    /// Lets the host exchange one packet.
    pub fn turn(&mut self) {
        match self.step {
            Step::Unplugged if self.registers[SIE_CONTROL / 4] & PULL_UP != 0 => {
                self.registers[SIE_STATUS / 4] |= RESET;
                self.step = Step::Reset;
            }
            Step::Reset if self.registers[SIE_STATUS / 4] & RESET == 0 => self.step = Step::Ask,
            Step::Ask => self.ask(),
            Step::Answer => self.answered(),
            Step::Follow => {
                let rest = self.requests[0].1;
                if self.packet_out(0, true, rest) {
                    self.step = Step::Status(Direction::In);
                }
            }
            Step::Status(Direction::In) => {
                if self.packet_in(0, true).is_some() {
                    self.ended();
                }
            }
            Step::Status(Direction::Out) => {
                if self.packet_out(0, true, &[]) {
                    self.ended();
                }
            }
            Step::Open => self.exchange(),
            Step::Unplugged | Step::Reset | Step::Failed => {}
        }
    }

    fn ask(&mut self) {
        let Some((request, rest)) = self.requests.front() else {
            self.step = Step::Open;
            return;
        };
        self.memory[..8].copy_from_slice(request);
        self.registers[SIE_STATUS / 4] |= SETUP;
        self.step = match (request[0] >> 7, rest.is_empty()) {
            (1, _) => Step::Answer,
            (_, false) => Step::Follow,
            _ => Step::Status(Direction::In),
        };
        self.answer.clear();
        self.control_odd = true;
    }

    fn answered(&mut self) {
        let Some(packet) = self.packet_in(0, self.control_odd) else {
            return;
        };
        self.control_odd = !self.control_odd;
        self.answer.extend(&packet);
        let most = usize::from(self.requests[0].0[6]);
        if packet.len() < PACKET || self.answer.len() >= most {
            self.step = Step::Status(Direction::Out);
        }
    }

    fn ended(&mut self) {
        let Some((request, _)) = self.requests.pop_front() else {
            return;
        };
        if request[..2] == [0, 5] && self.registers[ADDRESS / 4] == 0 {
            // the device applies it after the status; a real host would wait 2 ms
            self.step = Step::Ask;
            return;
        }
        if request[..4] == [0x80, 6, 0, 2] {
            self.endpoints();
        }
        self.step = Step::Ask;
    }

    /// Reads the line's two endpoints from the configuration descriptor.
    fn endpoints(&mut self) {
        let mut rest = &self.answer[..];
        while let [len, kind, ..] = *rest {
            let len = usize::from(len).clamp(2, rest.len());
            if let (5, [address, attributes]) = (kind, [rest[2], rest[3]])
                && attributes & 3 == 2
            {
                self.bulk[usize::from(address >> 7 == 0)] = Some(usize::from(address & 0xF));
            }
            rest = &rest[len..];
        }
        if self.bulk.contains(&None) {
            self.fail("no line among the descriptors");
        }
    }

    fn exchange(&mut self) {
        let [Some(into), Some(out)] = self.bulk else {
            return;
        };
        if let Some(packet) = self.packet_in(into, self.odd[0]) {
            self.odd[0] = !self.odd[0];
            self.from_device.extend(packet);
        }
        let len = self.to_device.len().min(PACKET);
        if len > 0 {
            let packet: Vec<u8> = self.to_device.iter().take(len).copied().collect();
            if self.packet_out(out, self.odd[1], &packet) {
                self.odd[1] = !self.odd[1];
                self.to_device.drain(..len);
            }
        }
    }
}
