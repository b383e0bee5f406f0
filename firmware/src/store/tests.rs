//! Against a flash stricter than any chip: a byte is written once per erase, and power fails at any
//! byte.

use super::*;
use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use lrnn_nostd::{Net, Normalisation, Weights};
use proptest::prelude::*;
use std::vec::Vec;

const ERASE: usize = 1024;
const WRITE: usize = 4;

/// Flash with power cuts. `left` bytes may still be erased or written; the byte at which power
/// fails holds anything.
#[derive(Debug, Clone)]
struct Flash {
    bytes: Vec<u8>,
    written: Vec<bool>,
    left: usize,
    /// What the byte at the cut becomes.
    torn: u8,
    /// Bytes erased or written in all.
    work: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failure {
    PowerCut,
    /// The chip would have been misused: never allowed.
    Misuse,
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn new(capacity: usize) -> Flash {
        Flash {
            bytes: std::vec![0xA5; capacity], // never erased
            written: std::vec![true; capacity],
            left: usize::MAX,
            torn: 0,
            work: 0,
        }
    }

    fn change(&mut self, at: usize, value: u8) -> Result<(), Failure> {
        if self.left == 0 {
            return Err(Failure::PowerCut);
        }
        self.left -= 1;
        self.work += 1;
        if self.left == 0 {
            self.bytes[at] = self.torn;
            self.written[at] = true;
            return Err(Failure::PowerCut);
        }
        self.bytes[at] = value;
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Failure;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(ERASE) || !to.is_multiple_of(ERASE) || to > self.bytes.len() {
            return Err(Failure::Misuse);
        }
        // from the middle, as no one should rely on an order
        for at in (from..to).map(|at| from + (at - from + ERASE / 2) % (to - from)) {
            self.change(at, 0xFF)?;
            self.written[at] = false;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let offset = offset as usize;
        if !offset.is_multiple_of(WRITE) || !bytes.len().is_multiple_of(WRITE) {
            return Err(Failure::Misuse);
        }
        for (at, &byte) in (offset..).zip(bytes) {
            if self.written[at] {
                return Err(Failure::Misuse);
            }
            self.change(at, byte)?;
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
        accel: Net::new(Weights::zero(), net.normalisation),
    }
}

fn store(flash: Flash) -> Store<Flash> {
    Store::new(flash).unwrap()
}

/// The number of the image found.
fn found(flash: &Flash) -> Option<u8> {
    let stored = store(flash.clone()).load()?;
    let n = (0..=255).find(|&n| nets(n) == stored.nets);
    Some(n.expect("an image that was never stored"))
}

#[test]
fn images_are_found_again_in_turn() {
    let mut flash = Flash::new(2 * ERASE);
    assert_eq!(found(&flash), None);
    for n in 1..10 {
        let mut store = store(flash);
        let stored = store.save(&nets(n)).unwrap();
        assert_eq!(stored.generation, u32::from(n));
        flash = store.into_inner();
        assert_eq!(found(&flash), Some(n));
    }
    // the newest is damaged: the one before
    for at in 0..RECORD_LEN {
        let mut damaged = flash.clone();
        damaged.bytes[at] ^= 0x10; // nine images: the newest is in slot 0
        assert_eq!(found(&damaged), Some(8), "byte {at}");
        damaged.bytes[ERASE + at] ^= 1;
        assert_eq!(found(&damaged), None);
    }
}

/// Power fails at every single byte of a save: the old image or the new one, and the store works
/// on.
#[test]
fn power_may_fail_at_any_byte() {
    for before in [1u8, 2] {
        let mut flash = Flash::new(2 * ERASE + 512);
        for n in 1..=before {
            let mut store = store(flash);
            store.save(&nets(n)).unwrap();
            flash = store.into_inner();
        }
        let mut trial = store(flash.clone());
        trial.save(&nets(77)).unwrap();
        let work = trial.into_inner().work - flash.work;
        assert_eq!(work, ERASE + PADDED_LEN);
        for left in 0..=work + 1 {
            for torn in [0x00, 0xFF, 0x5A] {
                let mut cut = flash.clone();
                (cut.left, cut.torn) = (left, torn);
                let mut store = store(cut);
                let result = store.save(&nets(77));
                assert_ne!(result.map(|_| ()), Err(Error::Flash(Failure::Misuse)));
                let mut after = store.into_inner();
                let expected = if result.is_ok() { 77 } else { before };
                let n = found(&after);
                // all of the record may have been written before the cut in its padding
                assert!(
                    n == Some(expected) || n == Some(77) && left > ERASE,
                    "{left} {n:?}"
                );
                after.left = usize::MAX;
                let mut store = self::store(after);
                store.save(&nets(99)).unwrap();
                assert_eq!(found(&store.into_inner()), Some(99));
            }
        }
    }
}

proptest! {
    /// Any history of saves with and without power cuts: what is found is the last image saved, or
    /// one whose save was cut.
    #[test]
    fn any_history(
        history in prop::collection::vec((any::<bool>(), 0..2200usize, any::<u8>()), 1..30)
    ) {
        let mut flash = Flash::new(2 * ERASE);
        let mut possible: Vec<Option<u8>> = std::vec![None];
        for (n, (cut, left, torn)) in (1..).zip(history) {
            flash.left = if cut { left } else { usize::MAX };
            flash.torn = torn;
            let mut store = store(flash);
            let done = store.save(&nets(n)).is_ok();
            flash = store.into_inner();
            let now = found(&flash);
            if done {
                prop_assert_eq!(now, Some(n));
            } else {
                prop_assert!(now == Some(n) || possible.contains(&now));
            }
            possible = std::vec![now];
        }
    }

    /// Any bytes in the flash: no panic, and no image is found that was not stored.
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 2 * ERASE)) {
        let mut flash = Flash::new(2 * ERASE);
        flash.bytes = bytes;
        prop_assert_eq!(found(&flash), None);
    }
}

#[test]
fn generations_turn_over() {
    let mut flash = Flash::new(2 * ERASE);
    for (slot, n, generation) in [(0, 1, u32::MAX), (1, 2, 0)] {
        let record = record(&nets(n), generation);
        flash.bytes[slot * ERASE..][..PADDED_LEN].copy_from_slice(&record);
    }
    assert_eq!(found(&flash), Some(2));
    let mut store = store(flash);
    assert_eq!(store.save(&nets(3)).unwrap().generation, 1);
    assert_eq!(found(&store.into_inner()), Some(3));
}

#[test]
fn too_small_a_flash_is_refused() {
    let refused = Store::new(Flash::new(2 * ERASE - 1)).err();
    assert_eq!(refused, Some(Error::Geometry));
}
