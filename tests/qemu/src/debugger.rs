//! A client of QEMU's debug server: stops a live board, sets registers, resumes it.

use std::io::{Read, Write};
use std::net::TcpStream;

use anyhow::{Result, ensure};

/// A board that is stopped.
#[derive(Debug)]
pub struct Debugger {
    line: TcpStream,
}

impl Debugger {
    /// A client on the line to QEMU's debug server, which has stopped the board.
    ///
    /// # Errors
    /// QEMU does not answer.
    pub fn new(line: TcpStream) -> Result<Self> {
        let mut debugger = Self { line };
        // QEMU allows setting a register only after its list of registers was read
        debugger.ask("qXfer:features:read:target.xml:0,fff")?;
        Ok(debugger)
    }

    /// Sets a register: 13 is the stack pointer, 15 the program counter.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn set(&mut self, register: u8, value: u32) -> Result<()> {
        let bytes = value.to_le_bytes().map(|byte| format!("{byte:02x}"));
        let answer = self.ask(&format!("P{register:x}={}", bytes.concat()))?;
        ensure!(answer == "OK", "register {register}: `{answer}`");
        Ok(())
    }

    /// Resumes the board.
    ///
    /// # Errors
    /// QEMU refuses.
    pub fn go_on(mut self) -> Result<()> {
        let answer = self.ask("D")?;
        ensure!(answer == "OK", "`{answer}`");
        Ok(())
    }

    /// The remote serial protocol: `$`, text, `#`, two digits of its sum; `+` is a receipt.
    fn ask(&mut self, text: &str) -> Result<String> {
        let sum = text.bytes().fold(0u8, u8::wrapping_add);
        write!(self.line, "${text}#{sum:02x}")?;
        let mut answer = Vec::new();
        let mut byte = [0];
        while answer.iter().rev().nth(2) != Some(&b'#') {
            self.line.read_exact(&mut byte)?;
            answer.push(byte[0]);
        }
        self.line.write_all(b"+")?;
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let answer = answer.trim_start_matches('+').trim_start_matches('$');
        Ok(answer.split('#').next().unwrap_or_default().to_owned())
    }
}
