//! Flash and RAM of an image, and whether it contains code that can panic.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use object::elf::SHF_ALLOC;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind};

/// RAM of the STM32F405 at 0x2000_0000, bytes.
pub const RAM: u64 = 128 * 1024;

/// Lowest addresses of core-coupled memory and of RAM; flash is below.
const FIRST_ADDRESSES: [u64; 2] = [0x1000_0000, 0x2000_0000];

/// The size and contents of an image.
#[derive(Debug, Default)]
pub struct Size {
    /// Bytes of flash: code, constants, initial values of variables.
    pub flash: u64,
    /// Bytes of static variables.
    pub ram: u64,
    /// Bytes of core-coupled memory.
    pub coupled: u64,
    /// Its variables: name of the symbol, and bytes.
    pub in_coupled: Vec<(String, u64)>,
    /// Names of the functions that can start a panic; empty if nothing can panic.
    pub panics: Vec<String>,
    /// Bytes of flash, core-coupled memory and RAM of its functions and variables, by crate and
    /// module. Inlined code counts where it was inlined. Bytes without a symbol (constants merged
    /// by the compiler, alignment) are missing.
    pub modules: BTreeMap<String, [u64; 3]>,
    /// Semihosting calls: instructions `bkpt 0xab`.
    pub semihosting: usize,
}

impl Size {
    /// Reads the size from the ELF file.
    ///
    /// # Errors
    /// No such file, or not an ELF file with symbols: without them nothing could be said of panics.
    pub fn of(image: &Path) -> Result<Self> {
        let bytes = fs::read(image).with_context(|| image.display().to_string())?;
        let elf = object::File::parse(&*bytes).with_context(|| image.display().to_string())?;
        let mut size = Self::default();
        for section in elf.sections() {
            let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
                continue;
            };
            if sh_flags & SHF_ALLOC != SHF_ALLOC {
                continue;
            }
            let loaded = !matches!(section.kind(), SectionKind::UninitializedData);
            if matches!(section.kind(), SectionKind::Text) {
                let marks = marks(&elf);
                size.semihosting += breakpoints(section.data()?, section.address(), &marks);
            }
            size.flash += if loaded { section.size() } else { 0 };
            match region(section.address()) {
                0 => {}
                1 => size.coupled += section.size(),
                _ => size.ram += section.size(),
            }
        }
        anyhow::ensure!(
            elf.symbols().next().is_some(),
            "{} has no symbols",
            image.display()
        );
        for symbol in elf.symbols().filter(|symbol| symbol.size() > 0) {
            let sizes = size
                .modules
                .entry(module(symbol.name().unwrap_or_default()))
                .or_default();
            let region = region(symbol.address());
            sizes[region] += symbol.size();
            if region == 1 {
                let name = symbol.name().unwrap_or_default().to_owned();
                size.in_coupled.push((name, symbol.size()));
            }
        }
        let defined = elf.symbols().filter(|symbol| symbol.is_definition());
        size.panics = defined
            .filter_map(|symbol| {
                symbol
                    .name()
                    .ok()
                    .filter(|name| begins_panic(name))
                    .map(str::to_owned)
            })
            .collect();
        Ok(size)
    }
}

/// Where code (true) and constants among it begin: the mapping symbols `$t` and `$d` of the Arm
/// ABI, in order.
fn marks(elf: &object::File) -> Vec<(u64, bool)> {
    let mark = |symbol: object::Symbol| {
        let name = symbol.name().ok()?;
        let code = name.starts_with("$t");
        (code || name.starts_with("$d")).then(|| (symbol.address(), code))
    };
    let mut marks: Vec<_> = elf.symbols().filter_map(mark).collect();
    marks.sort_unstable();
    marks
}

/// The instructions `bkpt 0xab` of a section. An instruction of 32 bits begins with a halfword from
/// 0xe800 on (ARMv7-M ARM, A5.1); its second one may read as anything.
fn breakpoints(section: &[u8], address: u64, marks: &[(u64, bool)]) -> usize {
    let end = address + section.len() as u64;
    let mut found = 0;
    for (index, (from, code)) in marks.iter().enumerate() {
        let to = marks.get(index + 1).map_or(end, |(next, _)| *next).min(end);
        if !code || *from < address || *from >= to {
            continue;
        }
        let code = &section[(from - address) as usize..(to - address) as usize];
        let mut halves = code
            .chunks_exact(2)
            .map(|half| u16::from_le_bytes([half[0], half[1]]));
        while let Some(half) = halves.next() {
            found += usize::from(half == 0xbeab);
            if half >= 0xe800 {
                halves.next();
            }
        }
    }
    found
}

/// Memory of an address. 0: flash, 1: core-coupled memory, 2: RAM.
fn region(address: u64) -> usize {
    let regions = FIRST_ADDRESSES.iter();
    regions.filter(|first| address >= **first).count()
}

/// Crate and module of a symbol; `core` as a whole, and what is not Rust together.
fn module(symbol: &str) -> String {
    let Ok(name) = rustc_demangle::try_demangle(symbol) else {
        return "not Rust (compiler's helpers, start-up, interrupt table)".to_owned();
    };
    let name = format!("{name:#}");
    // `<a::b::C<T> as d::E>::f`, `<&mut a::B>::f`, `a::b::f`
    let path = name.trim_start_matches(|c: char| !c.is_alphanumeric() && c != '_');
    let path = path.trim_start_matches("mut ").trim_start_matches("dyn ");
    let end = path
        .find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':')
        .unwrap_or(path.len());
    let mut parts = path[..end].split("::").filter(|part| !part.is_empty());
    let first = parts.next().unwrap_or("?");
    let is_module = |part: &&str| part.starts_with(|c: char| c.is_lowercase());
    match parts.next().filter(is_module) {
        // the last part is the function itself
        Some(second) if first != "core" && parts.next().is_some() => format!("{first}::{second}"),
        _ => first.to_owned(),
    }
}

/// Every panic passes through a function of `core::panicking` and the panic handler, which the
/// compiler calls `rust_begin_unwind`; the linker drops both when nothing calls them.
fn begins_panic(symbol: &str) -> bool {
    symbol.contains("9panicking") || symbol.contains("rust_begin_unwind")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Code, then constants, then code: the second half of a branch, and a constant, that read as a
    /// breakpoint are none.
    #[test]
    fn breakpoints_are_instructions() {
        let halves = [0xf000_u16, 0xbeab, 0xbeab, 0x4770, 0xbeab, 0xbeab, 0xf7ff];
        let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        let marks = [(100, true), (108, false), (110, true)];
        assert_eq!(breakpoints(&bytes, 100, &marks), 2);
        assert_eq!(breakpoints(&bytes, 100, &[(100, false), (106, true)]), 2);
    }

    #[test]
    fn symbols_belong_to_modules() {
        for (symbol, want) in [
            (
                "_ZN10lrnn_nostd5infer3Net4step17h0123456789abcdefE",
                "lrnn_nostd::infer",
            ),
            ("_ZN8firmware4main17h0123456789abcdefE", "firmware"),
            ("_ZN4core9panicking5panic17h0123456789abcdefE", "core"),
            (
                "_ZN55_$LT$firmware..app..App$u20$as$u20$core..fmt..Debug$GT$3fmt17h0123456789abcdefE",
                "firmware::app",
            ),
            (
                "memcpy",
                "not Rust (compiler's helpers, start-up, interrupt table)",
            ),
        ] {
            assert_eq!(module(symbol), want);
        }
    }
}
