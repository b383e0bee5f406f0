//! The code of an image: its functions, its words, and what is code and what is data.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::elf::SHF_ALLOC;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};

use super::thumb::{Instruction, decode};

/// A function's place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name, readable.
    pub name: String,
    /// Behind its last byte.
    pub end: u32,
}

/// A loaded section.
#[derive(Clone, Debug)]
struct Section {
    address: u32,
    bytes: Vec<u8>,
    code: bool,
}

/// The code of an image.
#[derive(Clone, Debug, Default)]
pub struct Image {
    sections: Vec<Section>,
    /// By address.
    pub functions: BTreeMap<u32, Function>,
    /// From this address on there is data (true) or code, as the compiler has marked it.
    marks: BTreeMap<u32, bool>,
    /// Where the interrupt table begins.
    pub table: u32,
    /// Bytes that the linker has set aside for the stack.
    pub room: u32,
    /// What the compiler says of frames, if it was asked to.
    pub stated: BTreeMap<u32, u32>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// No such file, or not an image of this workspace.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        Self::parse(&bytes).with_context(|| path.display().to_string())
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let elf = object::File::parse(bytes)?;
        let mut image = Self::default();
        for section in elf.sections() {
            let name = section.name()?;
            if name == ".stack_sizes" {
                image.stated = stated(section.data()?)?;
            }
            let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
                continue;
            };
            if sh_flags & SHF_ALLOC == SHF_ALLOC && section.kind() != SectionKind::UninitializedData
            {
                let address = u32::try_from(section.address())?;
                if name == ".vector_table" {
                    image.table = address;
                }
                image.sections.push(Section {
                    address,
                    bytes: section.data()?.to_vec(),
                    code: section.kind() == SectionKind::Text && name != ".vector_table",
                });
            }
        }
        image.symbols(&elf)?;
        let symbol = |name: &str| {
            let symbol = elf.symbol_by_name(name);
            symbol
                .with_context(|| format!("no symbol `{name}`"))
                .map(|symbol| symbol.address())
        };
        let room = symbol("_stack_start")?.checked_sub(symbol("_stack_end")?);
        image.room = u32::try_from(room.context("the stack ends above its start")?)?;
        Ok(image)
    }

    /// An image for tests: code at 0x100 with functions and places of data, one word behind an
    /// interrupt table whose last entry is the last function, and constants at 0x200.
    #[cfg(test)]
    pub fn of_parts(
        code: &[u8],
        functions: &[(u32, &str)],
        constants: &[u32],
        data: &[(u32, u32)],
    ) -> Self {
        let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let section = |address, bytes, code| Section {
            address,
            bytes,
            code,
        };
        let (first, last) = (functions[0].0, functions[functions.len() - 1].0);
        let ends = functions.iter().skip(1).map(|(start, _)| *start);
        let ends = ends.chain([0x100 + code.len() as u32]);
        let function = |((start, name), end): (&(u32, &str), u32)| {
            let name = (*name).to_owned();
            (*start, Function { name, end })
        };
        Self {
            sections: vec![
                section(0, words(&[0x2000_1000, first | 1, last | 1]), false),
                section(0x100, code.to_vec(), true),
                section(0x200, words(constants), false),
            ],
            functions: functions.iter().zip(ends).map(function).collect(),
            marks: data
                .iter()
                .flat_map(|(from, to)| [(*from, true), (*to, false)])
                .collect(),
            ..Self::default()
        }
    }

    fn symbols(&mut self, elf: &object::File) -> Result<()> {
        for symbol in elf.symbols() {
            let (name, address) = (symbol.name()?, u32::try_from(symbol.address())?);
            if let Some(mark) = name.strip_prefix('$') {
                self.marks.insert(address, mark.starts_with('d'));
            }
            if symbol.kind() != SymbolKind::Text || !symbol.is_definition() {
                continue;
            }
            let start = address & !1;
            if !self.is_code(start) {
                continue;
            }
            let end = start + u32::try_from(symbol.size())?;
            let function = self.functions.entry(start).or_insert_with(|| Function {
                name: format!("{:#}", rustc_demangle::demangle(name)),
                end,
            });
            function.end = function.end.max(end);
        }
        ensure!(!self.functions.is_empty(), "an image without symbols");
        // assembly states no size: up to the next function
        let starts: Vec<_> = self.functions.keys().copied().collect();
        for (index, start) in starts.iter().enumerate() {
            let last = self.sections.iter().find(|section| section.has(*start));
            let last = last.map_or(*start, Section::end);
            let next = starts.get(index + 1).copied().unwrap_or(last).min(last);
            if let Some(function) = self.functions.get_mut(start)
                && function.end == *start
            {
                function.end = next;
            }
        }
        Ok(())
    }

    /// The name of the function at `address`.
    pub fn name(&self, address: u32) -> &str {
        self.functions
            .get(&address)
            .map_or("?", |function| &function.name)
    }

    /// Whether `address` is in a section of code.
    pub fn is_code(&self, address: u32) -> bool {
        let section = self.sections.iter().find(|section| section.has(address));
        section.is_some_and(|section| section.code)
    }

    /// Whether the compiler has marked what is at `address` as data.
    pub fn is_data(&self, address: u32) -> bool {
        let mark = self.marks.range(..=address).next_back();
        mark.is_some_and(|(_, data)| *data)
    }

    /// Where what is at `address` ends: the next mark.
    pub fn mark_behind(&self, address: u32) -> Option<u32> {
        let mut behind = self.marks.range(address + 1..);
        behind.next().map(|(address, _)| *address)
    }

    /// The bytes at `address`.
    pub fn bytes<const N: usize>(&self, address: u32) -> Option<[u8; N]> {
        let section = self.sections.iter().find(|section| section.has(address))?;
        let start = usize::try_from(address - section.address).ok()?;
        section.bytes.get(start..start + N)?.try_into().ok()
    }

    /// The word at `address`.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.bytes(address).map(u32::from_le_bytes)
    }

    /// The instruction at `address`.
    ///
    /// # Errors
    /// There is none.
    pub fn instruction(&self, address: u32) -> Result<Instruction> {
        let half = |address| self.bytes(address).map(u16::from_le_bytes);
        let first = half(address).with_context(|| format!("no code at {address:#x}"))?;
        Ok(decode(
            address,
            first,
            half(address + 2).unwrap_or_default(),
        ))
    }

    /// The instructions of the function at `start`, with their addresses, data left out.
    ///
    /// # Errors
    /// There is no code.
    pub fn instructions(&self, start: u32) -> Result<BTreeMap<u32, Instruction>> {
        let end = self.functions.get(&start).map_or(start, |f| f.end);
        let mut all = BTreeMap::new();
        let mut at = start;
        while at < end {
            if self.is_data(at) {
                at = self.mark_behind(at).unwrap_or(end);
                continue;
            }
            let instruction = self.instruction(at)?;
            all.insert(at, instruction);
            at += instruction.length;
        }
        Ok(all)
    }

    /// The function whose pointer `word` is.
    pub fn pointer(&self, word: u32) -> Option<u32> {
        let start = word & !1;
        (word & 1 == 1 && self.functions.contains_key(&start)).then_some(start)
    }

    /// Every word of the image but the interrupt table's, with its address.
    pub fn words(&self) -> impl Iterator<Item = (u32, u32)> {
        let sections = self.sections.iter();
        sections
            .filter(|section| section.address != self.table)
            .flat_map(|section| {
                let first = section.address.next_multiple_of(4);
                (first..section.end().saturating_sub(3)).step_by(4)
            })
            .filter_map(|address| Some((address, self.word(address)?)))
    }

    /// The instructions of all sections of code, to compare images.
    pub fn text(&self) -> Vec<(u32, &[u8])> {
        let sections = self.sections.iter();
        sections
            .map(|section| (section.address, &section.bytes[..]))
            .collect()
    }

    /// The handlers of the interrupt table: number and function, without the entry that the core
    /// takes after reset.
    pub fn handlers(&self) -> BTreeSet<(u32, u32)> {
        let table = self
            .sections
            .iter()
            .find(|section| section.address == self.table);
        let entries = table.map_or(0, |table| table.bytes.len() as u32 / 4);
        let words =
            (2..entries).filter_map(|number| Some((number, self.word(self.table + 4 * number)?)));
        words
            .filter_map(|(number, word)| Some((number, self.pointer(word)?)))
            .collect()
    }

    /// What the core starts with.
    pub fn reset(&self) -> Option<u32> {
        self.pointer(self.word(self.table + 4)?)
    }
}

impl Section {
    fn end(&self) -> u32 {
        self.address + self.bytes.len() as u32
    }

    fn has(&self, address: u32) -> bool {
        (self.address..self.end()).contains(&address)
    }
}

/// The section that `-Z emit-stack-sizes` makes: addresses of 4 bytes, each with a ULEB128.
fn stated(bytes: &[u8]) -> Result<BTreeMap<u32, u32>> {
    let mut sizes = BTreeMap::new();
    let mut rest = bytes;
    while let Some((address, mut behind)) = rest.split_first_chunk::<4>() {
        let (mut size, mut shift) = (0u32, 0);
        loop {
            let (byte, left) = behind.split_first().context("a cut size")?;
            behind = left;
            size |= u32::from(byte & 0x7f)
                .checked_shl(shift)
                .context("a size")?;
            shift += 7;
            if byte & 0x80 == 0 {
                break;
            }
        }
        let place = sizes.entry(u32::from_le_bytes(*address) & !1).or_insert(0);
        *place = size.max(*place);
        rest = behind;
    }
    ensure!(rest.is_empty(), "a cut address");
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_frames_are_read() {
        let bytes = [0x01, 0x01, 0, 0x08, 0x10, 0x02, 0x01, 0, 0x08, 0xe8, 0x07];
        let sizes = stated(&bytes).expect("two sizes");
        assert_eq!(
            sizes,
            BTreeMap::from([(0x0800_0100, 16), (0x0800_0102, 1000)])
        );
        assert!(stated(&bytes[..10]).is_err());
        assert!(stated(&bytes[..8]).is_err());
    }
}
