//! A store over any flash content, with power cuts and bit errors between its operations: it never
//! misuses the chip, what it returns is complete and finite, and what it has stored since the last
//! bit error is found, or what was stored before a power cut.

use arbitrary::Arbitrary;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use firmware::configuration::record::Record;
use firmware::model::Nets;
use firmware::store::{Content, Store};
use lrnn_nostd::{Net, Normalisation, Weights};

const ERASE: usize = 4096;
const CAPACITY: usize = 8 * ERASE;

#[derive(Arbitrary, Debug)]
enum Act {
    /// Stores these networks.
    Save(u8),
    /// The same, but power fails after so many bytes.
    Cut(u8, u16),
    /// A bit flips.
    Flip(u16, u8),
    /// Bytes change.
    Rot(u16, [u8; 8]),
}

#[derive(Arbitrary, Debug)]
struct Input<'i> {
    /// Initial content of the flash from this position on.
    at: u16,
    garbage: &'i [u8],
    acts: Vec<Act>,
}

/// A byte is written once per erase; power may fail at any byte. Without power nothing changes.
struct Flash {
    bytes: Vec<u8>,
    written: Vec<bool>,
    left: usize,
    /// Mask of the bits that change in the byte at which power fails.
    torn: u8,
}

#[derive(Debug)]
struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = PowerCut;
}

impl Flash {
    /// Changes a byte, erases or writes it: completely, partly when power fails, not at all without
    /// power.
    fn put(&mut self, at: usize, byte: u8) -> Result<(), PowerCut> {
        if self.left == 0 {
            return Err(PowerCut);
        }
        self.left -= 1;
        if self.left == 0 {
            let (was, torn) = (self.bytes[at], self.torn);
            self.set(at, (was & torn) | (byte & !torn));
            return Err(PowerCut);
        }
        self.bytes[at] = byte;
        Ok(())
    }

    /// Sets a byte. One that reads as erased may be written.
    fn set(&mut self, at: usize, byte: u8) {
        self.bytes[at] = byte;
        self.written[at] = byte != 0xFF;
    }
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        let (from, to) = (from as usize, to as usize);
        assert!(from.is_multiple_of(ERASE) && to.is_multiple_of(ERASE) && to <= CAPACITY);
        for at in from..to {
            self.put(at, 0xFF)?;
            self.written[at] = false;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        let offset = offset as usize;
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4));
        for (at, &byte) in (offset..).zip(bytes) {
            assert!(self.left == 0 || !self.written[at], "written twice");
            self.put(at, byte)?;
            self.written[at] = true;
        }
        Ok(())
    }
}

fn nets(n: u8) -> Nets {
    let mut weights = Weights::zero();
    for (k, weight) in weights.iter_mut().enumerate() {
        *weight = f32::from(n) + k as f32;
    }
    let net = Net::new(weights, Normalisation::identity());
    Nets {
        gyro: net,
        accel: net,
        ..Nets::NONE
    }
}

fn finite(nets: &Nets) -> bool {
    let mut weights = nets.gyro.weights.iter().chain(nets.accel.weights.iter());
    weights.all(|weight| weight.is_finite())
}

/// Whether the store found a record.
pub fn run(bytes: &[u8]) -> bool {
    let Some(input) = crate::structured::<Input>(bytes) else {
        return false;
    };
    let mut flash = Flash {
        bytes: vec![0xA5; CAPACITY],
        written: vec![true; CAPACITY],
        left: usize::MAX,
        torn: 0,
    };
    let at = usize::from(input.at) % CAPACITY;
    for (offset, byte) in (at..CAPACITY).zip(input.garbage) {
        flash.set(offset, *byte);
    }
    let record = Record::new();
    let mut found = false;
    // expected content: one of these; nothing is certain after a bit error
    let mut certain: Option<Vec<u8>> = None;
    for act in input.acts.iter().take(24) {
        let mut store = Store::new(flash).unwrap_or_else(|_| panic!("the flash is large enough"));
        match store.load() {
            Ok(Some(stored)) => {
                assert!(finite(&stored.nets));
                found = true;
                if let Some(known) = &certain {
                    let one_of = |n: &u8| stored.nets.same_images(&nets(*n));
                    assert!(known.iter().any(one_of), "neither old nor new: {act:?}");
                }
            }
            Ok(None) => assert!(certain.is_none(), "what was stored is gone"),
            Err(newer) => assert!(certain.is_none(), "{newer:?}"),
        }
        match *act {
            Act::Save(n) => {
                let new = nets(n);
                if store.save(&Content::new(&new, &record)).is_ok() {
                    certain = Some(vec![n]);
                }
                flash = store.into_inner();
            }
            Act::Cut(n, left) => {
                flash = store.into_inner();
                flash.left = usize::from(left) % (2 * ERASE);
                flash.torn = (left ^ (left >> 8)) as u8;
                let mut store = Store::new(flash).unwrap_or_else(|_| panic!("large enough"));
                let _ = store.load();
                let new = nets(n);
                let done = store.save(&Content::new(&new, &record)).is_ok();
                flash = store.into_inner();
                flash.left = usize::MAX;
                certain = match (certain, done) {
                    (_, true) => Some(vec![n]),
                    (Some(mut known), false) => {
                        known.push(n);
                        Some(known)
                    }
                    (None, false) => None,
                };
            }
            Act::Flip(at, bit) => {
                flash = store.into_inner();
                let at = usize::from(at) % CAPACITY;
                flash.set(at, flash.bytes[at] ^ (1 << (bit % 8)));
                certain = None;
            }
            Act::Rot(at, bytes) => {
                flash = store.into_inner();
                let at = usize::from(at) % (CAPACITY - 8);
                for (offset, byte) in (at..).zip(bytes) {
                    flash.set(offset, byte);
                }
                certain = None;
            }
        }
    }
    found
}
