//! Tests with a flash stricter than any chip.

use super::*;
use crate::compensator::Block;
use crate::learn::{Learner, Report};
use crate::sample::StreamScale;
use crate::wire::checksum::crc32_zlib;
use crate::wire::command::key::Secret;
use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
use lrnn_nostd::{Net, Normalisation, Weights};
use proptest::prelude::*;
use std::vec::Vec;
use test_bench::flash::{Failure, Flash};

mod append;
mod damaged;
mod limits;
mod memory;
mod older;
mod rank;
mod renewal;
mod rival;
mod room;
mod worn;

const ERASE: usize = 4096;
const WRITE: usize = 4;

fn nets(n: u8) -> Nets {
    let mut weights = Weights::zero();
    for (k, weight) in weights.iter_mut().enumerate() {
        *weight = f32::from(n) + k as f32;
    }
    let net = Net::new(weights, Normalisation::identity());
    Nets {
        gyro: net,
        accel: Net::new(Weights::zero(), net.normalisation),
        ..Nets::NONE
    }
}

/// Memory of the learner of number `n`, of a length of its own.
fn learnt(n: u8) -> Vec<u8> {
    let len = (usize::from(n) * 97) % (crate::learn::MEMORY_LEN + 1);
    (0..len).map(|k| (k as u8).wrapping_mul(31) ^ n).collect()
}

fn notes(n: u8) -> Notes {
    Notes {
        unit: u32::from(n) * 0x0101_0101,
        drives: u16::from(n) + 300,
        minutes: 70_000 + u32::from(n),
        temperatures: Some([-40, i16::from(n)]),
    }
}

fn unit_of(n: u8) -> u32 {
    0xC0DE_0000 | u32::from(n)
}

/// A learner that remembers [`learnt`].
struct Remembers(u8);

impl Learner for Remembers {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn learnt(&mut self) -> (Nets, [lrnn_nostd::State; 2]) {
        (Nets::NONE, Default::default())
    }
    fn report(&self) -> Report {
        Report::default()
    }
    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        for (place, byte) in piece.iter_mut().zip(&learnt(self.0)[start..]) {
            *place = *byte;
        }
    }
}

/// A learner that remembers as much as there is room for.
struct Most;

impl Learner for Most {
    fn begin(&mut self, _: &Nets, _: StreamScale) {}
    fn restart(&mut self) {}
    fn block(&mut self, _: u32, _: &Block) {}
    fn gap(&mut self) {}
    fn learnt(&mut self) -> (Nets, [lrnn_nostd::State; 2]) {
        (Nets::NONE, Default::default())
    }
    fn report(&self) -> Report {
        Report::default()
    }
    fn write_memory(&self, start: usize, piece: &mut [u8]) {
        for (place, at) in piece.iter_mut().zip(start..) {
            *place = at as u8;
        }
    }
}

/// A key of its own for each.
fn key_of(n: u8) -> Key {
    match n % 3 {
        0 => Key::OpenByChoice,
        _ => Key::Secret(Secret(core::array::from_fn(|at| n ^ at as u8))),
    }
}

/// Does something with the content of number `n`.
fn with<T>(n: u8, work: impl FnOnce(&Content) -> T) -> T {
    work(&Content {
        nets: &nets(n),
        record: &record_of(n),
        memory: Memory::New(notes(n), &Remembers(n), learnt(n).len()),
        unit: unit_of(n),
        minutes: 0,
        key: key_of(n),
    })
}

/// The memory that a store finds.
fn memory<const UNIT: usize>(store: &mut Store<Flash<UNIT>>) -> Vec<u8> {
    let mut bytes = [0; MEMORY_MAX];
    let len = store.memory(&mut bytes);
    bytes[..len].to_vec()
}

/// The record of number `n`, made here byte by byte, without padding.
fn framed(n: u8, generation: u32) -> Vec<u8> {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(n).write_images(0, &mut images);
    let record = record_of(n);
    let mut rest = (record.len() as u16).to_le_bytes().to_vec();
    rest.extend(unit_of(n).to_le_bytes());
    rest.extend([0; LIFE_LEN]);
    match key_of(n) {
        Key::Secret(Secret(secret)) => {
            rest.push(0x3C);
            rest.extend(secret);
        }
        _ => {
            rest.push(0xC3);
            rest.extend([0; 32]);
        }
    }
    rest.extend(record);
    let of = notes(n);
    rest.extend(of.unit.to_le_bytes());
    rest.extend(of.minutes.to_le_bytes());
    rest.extend(of.drives.to_le_bytes());
    rest.extend((-40i16).to_le_bytes());
    rest.extend(i16::from(n).to_le_bytes());
    rest.extend([0; 6]);
    rest.extend(learnt(n));
    of_version(5, generation, &images, &rest)
}

fn store<const UNIT: usize>(flash: Flash<UNIT>) -> Store<Flash<UNIT>> {
    Store::new(flash).unwrap()
}

/// A configuration record of a length of its own.
fn record_of(n: u8) -> Record {
    (0..usize::from(n) * 2).map(|k| n ^ k as u8).collect()
}

/// The number of the record found.
fn found<const UNIT: usize>(flash: &Flash<UNIT>) -> Option<u8> {
    let mut store = store(flash.clone());
    let stored = store.load().expect("no newer version")?;
    let n = (0..=255).find(|&n| nets(n) == stored.nets && record_of(n) == stored.record);
    let n = n.expect("a record that was never stored");
    assert_eq!(stored.unit, Some(unit_of(n)));
    let memory = memory(&mut store);
    let (notes, learnt) = Notes::of(&memory).expect("notes");
    assert!(notes == self::notes(n) && learnt == self::learnt(n), "{n}");
    Some(n)
}

/// Stores number `n`.
fn saved(flash: Flash, n: u8) -> (Result<u32, Error<Failure>>, Flash) {
    let mut store = store(flash);
    let result = with(n, |content| store.save(content));
    (result, store.into_inner())
}

#[test]
fn records_are_found_again_in_turn() {
    let mut flash: Flash = Flash::new(2 * ERASE);
    assert_eq!(found(&flash), None);
    for n in 1..10 {
        let (stored, after) = saved(flash, n);
        assert_eq!(stored.unwrap(), u32::from(n));
        flash = after;
        assert_eq!(found(&flash), Some(n));
    }
    // the newest is damaged: the one before
    for at in 0..framed(9, 9).len() {
        let mut damaged = flash.clone();
        damaged.bytes[at] ^= 0x10; // nine records: the newest is in slot 0
        assert_eq!(found(&damaged), Some(8), "byte {at}");
        damaged.bytes[ERASE + at % 600] ^= 1;
        assert_eq!(found(&damaged), None);
    }
}

/// Power fails at every single byte of a save: the old record or the new one, weights and
/// configuration together, and the store works on.
#[test]
fn power_may_fail_at_any_byte() {
    for before in [1u8, 2] {
        let mut flash: Flash = Flash::new(2 * ERASE + 512);
        for n in 1..=before {
            flash = saved(flash, n).1;
        }
        let work = saved(flash.clone(), 77).1.work - flash.work;
        let written = framed(77, 3).len().next_multiple_of(PIECE);
        assert_eq!(work, ERASE + written);
        for left in 0..=work + 1 {
            for torn in [0x00, 0xFF, 0x5A] {
                let mut cut = flash.clone();
                (cut.left, cut.torn) = (left, torn);
                let (result, mut after) = saved(cut, 77);
                assert_ne!(
                    result.as_ref().map(|_| ()),
                    Err(&Error::Flash(Failure::Misuse))
                );
                let expected = if result.is_ok() { 77 } else { before };
                let n = found(&after);
                // all of the record may have been written before the cut in its padding
                assert!(
                    n == Some(expected) || n == Some(77) && left > ERASE,
                    "{left} {n:?}"
                );
                after.left = usize::MAX;
                let (result, after) = saved(after, 99);
                assert!(result.is_ok());
                assert_eq!(found(&after), Some(99));
            }
        }
    }
}

proptest! {
    /// Any history of saves with and without power cuts: what is found is the last record saved, or
    /// one whose save was cut.
    #[test]
    fn any_history(
        history in prop::collection::vec((any::<bool>(), 0..7200usize, any::<u8>()), 1..30)
    ) {
        let mut flash: Flash = Flash::new(2 * ERASE);
        let mut possible: Vec<Option<u8>> = std::vec![None];
        for (n, (cut, left, torn)) in (1..).zip(history) {
            flash.left = if cut { left } else { usize::MAX };
            flash.torn = torn;
            let (result, after) = saved(flash, n);
            flash = after;
            let now = found(&flash);
            if result.is_ok() {
                prop_assert_eq!(now, Some(n));
            } else {
                prop_assert!(now == Some(n) || possible.contains(&now));
            }
            possible = std::vec![now];
        }
    }

    /// Any bytes in the flash: no panic, and no record is found that was not stored.
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 2 * ERASE)) {
        let mut flash: Flash = Flash::new(2 * ERASE);
        flash.bytes = bytes;
        prop_assert_eq!(found(&flash), None);
    }

    /// A header behind a good magic and version, with any lengths.
    #[test]
    fn any_header(
        bytes in prop::collection::vec(any::<u8>(), 2 * ERASE), version in 0..6u8, length: u16
    ) {
        let mut flash: Flash = Flash::new(2 * ERASE);
        flash.bytes = bytes;
        for start in [0, ERASE] {
            flash.bytes[start..][..8].copy_from_slice(&[b'L', b'R', b'N', b'S', version, 0, 0, 0]);
            flash.bytes[start + 12..][..2].copy_from_slice(&length.to_le_bytes());
        }
        prop_assert_eq!(found(&flash), None);
    }
}

#[test]
fn generations_turn_over() {
    let mut flash: Flash = Flash::new(2 * ERASE);
    for (slot, n, generation) in [(0, 1, u32::MAX), (1, 2, 0)] {
        let record = framed(n, generation);
        flash.bytes[slot * ERASE..][..record.len()].copy_from_slice(&record);
    }
    assert_eq!(found(&flash), Some(2));
    let (stored, flash) = saved(flash, 3);
    assert_eq!(stored.unwrap(), 1);
    assert_eq!(found(&flash), Some(3));
}

#[test]
fn too_small_a_flash_is_refused() {
    let refused = Store::new(<Flash>::new(2 * ERASE - 1)).err();
    assert_eq!(refused, Some(Error::Geometry));
}

/// A record of another version, made here byte by byte.
fn of_version(version: u32, generation: u32, images: &[u8], rest: &[u8]) -> Vec<u8> {
    // images of older ones end before the maps
    let old = version < 5 && images.len() == IMAGES_LEN;
    let images = if old { &images[..608] } else { images };
    let mut record = b"LRNS".to_vec();
    record.extend(version.to_le_bytes());
    record.extend(generation.to_le_bytes());
    record.extend((images.len() as u16).to_le_bytes());
    record.extend((rest.len() as u16).to_le_bytes());
    record.extend(images);
    record.extend(rest);
    let sum = crc32_zlib(&record);
    record.extend(sum.to_le_bytes());
    record
}

/// A record of version 0.1.0 of the firmware: weights alone.
#[test]
fn version_1_is_still_read() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    let mut flash: Flash = Flash::new(2 * ERASE);
    let record = of_version(1, 9, &images, &[]);
    assert_eq!(record[12..16], 608u32.to_le_bytes());
    flash.bytes[..record.len()].copy_from_slice(&record);
    let stored = store(flash.clone()).load().unwrap().unwrap();
    assert!(stored.nets == nets(5) && stored.record.is_empty());
    // the next one has its configuration beside it, and the old one stays until it is complete
    let (stored, flash) = saved(flash, 6);
    assert_eq!(stored.unwrap(), 10);
    assert_eq!(flash.bytes[..record.len()], record);
    assert_eq!(found(&flash), Some(6));
}

/// A newer firmware's record is named and never overwritten, wherever it is and however long. One
/// that is damaged is no record.
#[test]
fn a_newer_version_is_refused_and_stays() {
    for (images, rest) in [(608, 100), (1500, 500), (0, 0)] {
        for slot in [0, ERASE] {
            for generation in [1u32, 3] {
                let mut flash: Flash = Flash::new(2 * ERASE);
                let own = framed(2, 2);
                flash.bytes[ERASE - slot..][..own.len()].copy_from_slice(&own);
                let newer = of_version(6, generation, &std::vec![7; images], &std::vec![8; rest]);
                flash.bytes[slot..][..newer.len()].copy_from_slice(&newer);
                let before = flash.bytes.clone();
                let loaded = store(flash.clone()).load();
                if generation == 3 {
                    assert_eq!(loaded, Err(Newer(6)));
                } else {
                    assert!(loaded.is_ok_and(|stored| stored.is_some()));
                }
                let (result, after) = saved(flash.clone(), 4);
                assert_eq!(result, Err(Error::Newer(Newer(6))));
                assert!(after.bytes == before, "{slot} {generation}");
                flash.bytes[slot + newer.len() - 1] ^= 1;
                assert_eq!(found(&flash), Some(2));
                let (result, after) = saved(flash, 4);
                assert!(result.is_ok() && found(&after) == Some(4));
            }
        }
    }
}
