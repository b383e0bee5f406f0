//! Reads the memory of a running board: its log (defmt over RTT) and the deepest use of its stack.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use defmt_decoder::{DecodeError, Table};
use object::{Object, ObjectSymbol};

/// Start of RAM.
pub const RAM_START: u64 = 0x2000_0000;

/// The value with which `cortex-m-rt` paints the stack.
const PAINT: u32 = 0xcccc_cccc;

/// A copy of RAM, and the image that ran in it.
#[derive(Debug)]
pub struct Memory {
    image: Vec<u8>,
    ram: Vec<u8>,
}

/// The address of a symbol of an image.
///
/// # Errors
/// No ELF file, or none with this symbol.
pub fn address(image: &[u8], name: &str) -> Result<u64> {
    let elf = object::File::parse(image)?;
    let symbol = elf.symbol_by_name(name);
    Ok(symbol
        .with_context(|| format!("no symbol `{name}`"))?
        .address())
}

impl Memory {
    /// `ram` is a copy from [`RAM_START`] on.
    ///
    /// # Errors
    /// The image cannot be read.
    pub fn new(image: &Path, ram: Vec<u8>) -> Result<Self> {
        let image = fs::read(image).with_context(|| image.display().to_string())?;
        Ok(Self { image, ram })
    }

    fn symbol(&self, name: &str) -> Result<u64> {
        address(&self.image, name)
    }

    fn bytes(&self, address: u64, length: u64) -> Result<&[u8]> {
        let start = address.checked_sub(RAM_START).context("not in RAM")?;
        let range = usize::try_from(start)?..usize::try_from(start + length)?;
        self.ram.get(range).context("not in RAM")
    }

    fn word(&self, address: u64) -> Result<u32> {
        let bytes = self.bytes(address, 4)?;
        Ok(u32::from_le_bytes(bytes.try_into()?))
    }

    /// Bytes of stack used at the deepest point, found by the remaining paint.
    ///
    /// # Errors
    /// The image has no stack symbols, or no paint is left.
    pub fn stack_high_water(&self) -> Result<u64> {
        let (end, start) = (self.symbol("_stack_end")?, self.symbol("_stack_start")?);
        let mut deepest = end;
        while deepest < start && self.word(deepest)? == PAINT {
            deepest += 4;
        }
        ensure!(
            deepest > end,
            "the stack was used to its end, or not painted"
        );
        Ok(start - deepest)
    }

    /// The lines that the board has logged, as far as its buffer has room for them; nothing empties
    /// it here.
    ///
    /// # Errors
    /// The image has no defmt log, or the log is damaged.
    pub fn log(&self) -> Result<Vec<String>> {
        let table = Table::parse(&self.image)?.context("no defmt log in this image")?;
        // SEGGER's control block: name of 16 bytes, numbers of channels, then the first channel:
        // name, buffer, size, write, read.
        let block = self.symbol("_SEGGER_RTT")?;
        let buffer = u64::from(self.word(block + 28)?);
        let written = u64::from(self.word(block + 36)?);
        let mut decoder = table.new_stream_decoder();
        decoder.received(self.bytes(buffer, written)?);
        let mut lines = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => lines.push(frame.display(false).to_string()),
                Err(DecodeError::UnexpectedEof) => return Ok(lines),
                Err(DecodeError::Malformed) => anyhow::bail!("a damaged log after {lines:?}"),
            }
        }
    }
}
