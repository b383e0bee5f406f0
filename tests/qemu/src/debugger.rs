//! A client of QEMU's debug server: stops a live board, reads and sets registers and memory, steps,
//! resumes it.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::drive::{hex, unhex};

/// Bytes of memory in a packet: QEMU takes 4096 digits.
const PIECE: usize = 1024;

/// How long QEMU may take to answer.
const PATIENCE: Duration = Duration::from_secs(120);

/// A board under a debugger.
#[derive(Debug)]
pub struct Debugger {
    line: TcpStream,
    /// Bytes that came and are no whole packet yet.
    came: Vec<u8>,
}

impl Debugger {
    /// A client on the line to QEMU's debug server, which has stopped the board.
    ///
    /// # Errors
    /// QEMU does not answer.
    pub fn new(line: TcpStream) -> Result<Self> {
        let came = Vec::new();
        let mut debugger = Self { line, came };
        // QEMU allows setting a register only after its list of registers was read
        debugger.ask("qXfer:features:read:target.xml:0,fff")?;
        Ok(debugger)
    }

    /// A register: 13 is the stack pointer, 15 the program counter, 25 the program status.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn get(&mut self, register: u8) -> Result<u32> {
        let bytes = unhex(&self.ask(&format!("p{register:x}"))?)?;
        let bytes = bytes.try_into().ok().context("not a register of a word")?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Sets a register.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn set(&mut self, register: u8, value: u32) -> Result<()> {
        self.order(&format!("P{register:x}={}", hex(&value.to_le_bytes())))
    }

    /// All registers of the core, for [`Debugger::set_registers`].
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn registers(&mut self) -> Result<String> {
        self.ask("g")
    }

    /// Sets all of them. The number of the exception stays.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn set_registers(&mut self, all: &str) -> Result<()> {
        self.order(&format!("G{all}"))
    }

    /// Reads memory.
    ///
    /// # Errors
    /// There is none.
    pub fn read(&mut self, address: u32, length: usize) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        while bytes.len() < length {
            let piece = PIECE.min(length - bytes.len());
            let answer = self.ask(&format!("m{:x},{piece:x}", address as usize + bytes.len()))?;
            bytes.extend(unhex(&answer)?);
        }
        Ok(bytes)
    }

    /// Writes memory, not registers of peripherals.
    ///
    /// # Errors
    /// There is none.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<()> {
        for (number, piece) in bytes.chunks(PIECE).enumerate() {
            let at = address as usize + number * PIECE;
            self.order(&format!("M{at:x},{:x}:{}", piece.len(), hex(piece)))?;
        }
        Ok(())
    }

    /// The board stops before it executes what is at `address`; `false`: no longer.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn stop_at(&mut self, address: u32, stops: bool) -> Result<()> {
        let order = if stops { 'Z' } else { 'z' };
        self.order(&format!("{order}0,{address:x},2"))
    }

    /// Executes an instruction; no interrupt is served.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn step(&mut self) -> Result<()> {
        self.send("s")?;
        let stopped = self.receive(PATIENCE)?;
        stopped.map(|_| ()).context("the board does not stop")
    }

    /// Lets the board run until [`Debugger::wait`] or [`Debugger::interrupt`].
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn run(&mut self) -> Result<()> {
        self.send("c")
    }

    /// Waits until the board stops by itself. False: it still runs after `limit`.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn wait(&mut self, limit: Duration) -> Result<bool> {
        Ok(self.receive(limit)?.is_some())
    }

    /// Stops the board.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn interrupt(&mut self) -> Result<()> {
        self.line.write_all(&[3])?;
        let stopped = self.receive(PATIENCE)?;
        stopped.map(|_| ()).context("the board does not stop")
    }

    /// Resumes the board and leaves it.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn go_on(mut self) -> Result<()> {
        self.order("D")
    }

    fn order(&mut self, text: &str) -> Result<()> {
        let answer = self.ask(text)?;
        let shown = text.get(..20).unwrap_or(text);
        ensure!(answer == "OK", "QEMU's answer to `{shown}`: `{answer}`");
        Ok(())
    }

    fn ask(&mut self, text: &str) -> Result<String> {
        self.send(text)?;
        loop {
            let answer = self.receive(PATIENCE)?.context("QEMU does not answer")?;
            // QEMU tells of the stop when the debugger connects
            if !answer.starts_with('T') {
                return Ok(answer);
            }
        }
    }

    /// The remote serial protocol: `$`, text, `#`, two digits of its sum; `+` is a receipt.
    fn send(&mut self, text: &str) -> Result<()> {
        let sum = text.bytes().fold(0u8, u8::wrapping_add);
        let packet = format!("${text}#{sum:02x}");
        Ok(self.line.write_all(packet.as_bytes())?)
    }

    /// The next packet; `None`: nothing came for so long.
    fn receive(&mut self, limit: Duration) -> Result<Option<String>> {
        self.line.set_read_timeout(Some(limit))?;
        loop {
            let end = self.came.iter().position(|byte| *byte == b'#');
            if let Some(end) = end.filter(|end| self.came.len() >= end + 3) {
                let packet: Vec<u8> = self.came.drain(..end + 3).collect();
                self.line.write_all(b"+")?;
                let text = String::from_utf8_lossy(&packet[..end]).into_owned();
                let text = text.trim_start_matches('+').trim_start_matches('$');
                return Ok(Some(text.to_owned()));
            }
            let mut bytes = [0; 4096];
            match self.line.read(&mut bytes) {
                Ok(0) => bail!("QEMU has ended"),
                Ok(n) => self.came.extend(&bytes[..n]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(None),
                Err(error) => return Err(error.into()),
            }
        }
    }
}
