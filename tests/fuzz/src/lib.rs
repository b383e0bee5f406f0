//! Fuzz targets: one for everything that reads bytes from a line, a file or flash.
//!
//! A target takes any input, and panics where a property does not hold. The program `fuzz` selects
//! inputs by the branches that they reach (feature `guided`). The tests of this package replay the
//! committed inputs without that, and check how far they get.

pub mod targets;

use arbitrary::{Arbitrary, Unstructured};
use firmware::wire::{Framing, ImuFormat, Scan};
use host_io::recordings::record::Record;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A target.
pub struct Target {
    /// Its name, which is the folder of its corpus, too.
    pub name: &'static str,
    /// Runs it. Returns whether the input got as far as intended: past the checks at which most
    /// inputs fail.
    pub run: fn(&[u8]) -> bool,
}

macro_rules! targets {
    ($($name:ident)+) => {
        /// All targets.
        pub const TARGETS: [Target; [$(stringify!($name)),+].len()] = [$(Target {
            name: stringify!($name),
            run: targets::$name::run,
        }),+];
    };
}

targets! {
    app calibration command configuration csv drive fixes image mcap novatel receiver requests store stream ulog
    unit update
}

/// The input of a target that takes more than bytes; `None`: the bytes are too short for one.
pub fn structured<'i, T: Arbitrary<'i>>(bytes: &'i [u8]) -> Option<T> {
    let long_enough = bytes.len() >= T::size_hint(0).0;
    let input = long_enough.then(|| T::arbitrary_take_rest(Unstructured::new(bytes)));
    input?.ok()
}

/// Checks that a refusal has an error message. Returns false.
///
/// # Panics
/// The message is empty.
pub fn refused(error: &impl ToString) -> bool {
    assert!(!error.to_string().is_empty());
    false
}

/// Repairs the checksums after each start mark, since a fuzzer does not find them. The scan gives
/// the length of a frame by asking for its bytes.
pub fn repaired(format: ImuFormat, bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for at in 0..bytes.len() {
        let rest = &mut bytes[at..];
        let mut len = 0;
        while let Scan::Partial(needed) = format.scan(&rest[..len]) {
            if needed > rest.len() || needed <= len {
                break;
            }
            len = needed;
        }
        if format.scan(&rest[..len]) == Scan::BadChecksum {
            format.seal(&mut rest[..len]);
        }
    }
    bytes
}

/// Checks a recording that was read.
///
/// # Panics
/// One of its samples is no finite number.
pub fn finite(record: &Record) {
    let samples: Vec<_> = record.increments().map(|(_, sample)| sample).collect();
    let mut values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
    assert!(values.all(|value| value.is_finite()));
}

/// A file with these bytes for a reader of files: one for each name and process.
///
/// # Panics
/// The folder for temporary files cannot be written.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let memory = Path::new("/dev/shm"); // a folder in memory, where there is one
        let base = if memory.is_dir() {
            memory.to_path_buf()
        } else {
            std::env::temp_dir()
        };
        let folder = base.join(format!("fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for files");
        folder
    });
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// The two parts of an input for a reader of two files: they are divided by a zero byte.
pub fn halves(input: &[u8]) -> (&[u8], &[u8]) {
    match input.iter().position(|&byte| byte == 0) {
        Some(at) => (&input[..at], &input[at + 1..]),
        None => (input, &[]),
    }
}

/// zlib's CRC-32, bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ if crc & 1 != 0 { 0xEDB8_8320 } else { 0 };
        }
    }
    !crc
}
