//! Files for boot loaders, which serve a board without a debug probe: UF2 for the RP2350's drive,
//! `DfuSe` for that of ST.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use crc::{CRC_32_JAMCRC, Crc};
use object::read::elf::{ElfFile32, ProgramHeader as _};
use object::{Endianness, elf};

/// A part of an image: its address in flash, and its bytes.
type Segment = (u32, Vec<u8>);

/// The parts that are loaded into flash, by rising addresses.
fn parts(image: &Path) -> Result<Vec<Segment>> {
    let bytes = fs::read(image).with_context(|| image.display().to_string())?;
    let file: ElfFile32<'_, Endianness> = ElfFile32::parse(&*bytes)?;
    let endian = file.endian();
    let mut parts = Vec::new();
    for header in file.elf_program_headers() {
        let data = header.data(endian, &*bytes).unwrap_or_default();
        if header.p_type(endian) == elf::PT_LOAD && !data.is_empty() {
            parts.push((header.p_paddr(endian), data.to_vec()));
        }
    }
    parts.sort();
    ensure!(!parts.is_empty(), "{}: nothing to load", image.display());
    Ok(parts)
}

/// Smallest size of a hole in an image that other data, such as the store, may occupy.
const HOLE: u32 = 4096;

/// Writes the bytes of `image` as they are in flash, with FF in small gaps, and returns the address
/// of the first. An image with a large hole is not written: its bytes would erase what is there.
pub fn bin(image: &Path, out: &Path) -> Result<Option<u32>> {
    let Some((start, bytes)) = bin_of(&parts(image)?) else {
        return Ok(None);
    };
    fs::write(out, bytes).with_context(|| out.display().to_string())?;
    Ok(Some(start))
}

fn bin_of(parts: &[Segment]) -> Option<(u32, Vec<u8>)> {
    let start = parts.first()?.0;
    let mut all = Vec::new();
    for (address, bytes) in parts {
        let gap = address.checked_sub(start + all.len() as u32)?;
        if gap >= HOLE {
            return None;
        }
        all.resize(all.len() + gap as usize, 0xFF);
        all.extend(bytes);
    }
    Some((start, all))
}

/// Bytes of the image in a block of UF2: a page of the flash.
const PAGE: usize = 256;
/// The family of programs for the RP2350's Arm cores.
const RP2350_ARM: u32 = 0xE48B_FF59;

/// Writes `image` as UF2, for the drive that a Pico 2 is when its button is held at power-on.
pub fn uf2(image: &Path, out: &Path) -> Result<()> {
    let file = uf2_of(&parts(image)?);
    fs::write(out, file).with_context(|| out.display().to_string())
}

/// UF2, Microsoft's format (github.com/microsoft/uf2): independent blocks of 512 bytes.
fn uf2_of(parts: &[Segment]) -> Vec<u8> {
    let mut pages = std::collections::BTreeMap::<u32, [u8; PAGE]>::new();
    for (address, bytes) in parts {
        for (at, byte) in (*address..).zip(bytes) {
            let page = pages.entry(at - at % PAGE as u32).or_insert([0; PAGE]);
            page[at as usize % PAGE] = *byte;
        }
    }
    let count = pages.len() as u32;
    let mut file = Vec::new();
    for (number, (address, page)) in pages.into_iter().enumerate() {
        let with_family = 0x2000;
        let header = [
            0x0A32_4655,
            0x9E5D_5157,
            with_family,
            address,
            PAGE as u32,
            number as u32,
            count,
            RP2350_ARM,
        ];
        file.extend(header.into_iter().flat_map(u32::to_le_bytes));
        file.extend(page);
        file.resize(file.len() + 476 - PAGE, 0);
        file.extend(0x0AB1_6F30_u32.to_le_bytes());
    }
    file
}

/// Writes `image` as a `DfuSe` file, for `dfu-util` or ST's own tool.
pub fn dfu(image: &Path, out: &Path) -> Result<()> {
    let file = dfu_of(&parts(image)?);
    fs::write(out, file).with_context(|| out.display().to_string())
}

/// ST's format `DfuSe` (UM0391): a prefix, one target with one element per part, and the suffix of
/// DFU 1.1 with ST's numbers.
fn dfu_of(parts: &[Segment]) -> Vec<u8> {
    let mut elements = Vec::new();
    for (address, bytes) in parts {
        elements.extend(address.to_le_bytes());
        elements.extend((bytes.len() as u32).to_le_bytes());
        elements.extend(bytes);
    }
    let mut target = b"Target\0".to_vec(); // and the alternate setting 0: flash
    target.extend(1_u32.to_le_bytes());
    let mut name = [0; 255];
    name[..4].copy_from_slice(b"LRNN");
    target.extend(name);
    target.extend((elements.len() as u32).to_le_bytes());
    target.extend((parts.len() as u32).to_le_bytes());
    target.extend(elements);
    let prefix = 11;
    let mut file = b"DfuSe\x01".to_vec();
    file.extend(((prefix + target.len()) as u32).to_le_bytes());
    file.push(1);
    file.extend(target);
    for number in [0_u16, 0xDF11, 0x0483, 0x011A] {
        file.extend(number.to_le_bytes());
    }
    file.extend(b"UFD\x10");
    let check = Crc::<u32>::new(&CRC_32_JAMCRC).checksum(&file);
    file.extend(check.to_le_bytes());
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> Vec<Segment> {
        let long = (0..1000_u32).map(|n| n as u8).collect();
        vec![(0x1000_0000, long), (0x1000_0500, vec![7; 20])]
    }

    #[test]
    fn another_reader_of_uf2_finds_the_image() {
        let (bytes, families) = uf2_decode::convert_from_uf2(&uf2_of(&image())).expect("UF2");
        let parts = image();
        assert_eq!(bytes[..1000], parts[0].1);
        assert!(bytes[1000..0x500].iter().all(|byte| *byte == 0));
        assert_eq!(bytes[0x500..0x514], parts[1].1);
        assert_eq!(families.into_keys().collect::<Vec<_>>(), [RP2350_ARM]);
        assert_eq!(uf2_of(&parts).len(), 512 * 5);
    }

    #[test]
    fn the_bytes_of_flash_have_small_gaps_only() {
        let (start, bytes) = bin_of(&image()).expect("a gap of 280 bytes");
        assert_eq!((start, bytes.len()), (0x1000_0000, 0x514));
        assert_eq!(bytes[..1000], image()[0].1);
        assert!(bytes[1000..0x500].iter().all(|byte| *byte == 0xFF));
        assert_eq!(bytes[0x500..], [7; 20]);
        let mut image = image();
        image[1].0 += HOLE;
        assert_eq!(bin_of(&image), None);
        image[1].0 = 0x1000_0001; // within the first
        assert_eq!(bin_of(&image), None);
    }

    #[test]
    fn a_dfuse_file_adds_up() {
        let file = dfu_of(&image());
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four"));
        let end = file.len() - 16;
        assert_eq!((&file[..6], word(6) as usize), (&b"DfuSe\x01"[..], end));
        assert_eq!(
            (word(11 + 266) as usize, word(11 + 270)),
            (end - 11 - 274, 2)
        );
        assert_eq!((word(285), word(289)), (0x1000_0000, 1000));
        assert_eq!(file[end + 8..end + 12], *b"UFD\x10");
        // the check of the whole file with its own check is a constant: what CRC-32 leaves
        let whole = Crc::<u32>::new(&CRC_32_JAMCRC).checksum(&file);
        assert_eq!(whole, 0);
    }
}
