//! Limits and values beyond them: other flashes, counters that are full, too long a memory.

use super::*;
use crate::learn::MEMORY_LEN;

fn fits<const READ: usize, const WRITE: usize>() -> bool {
    match Store::new(Flash::<ERASE, WRITE, READ>::new(16 * ERASE)) {
        Ok(_) => true,
        Err(error) => {
            assert_eq!(error, Error::Geometry);
            false
        }
    }
}

/// Pieces of 64 bytes must be whole numbers of the flash's units.
#[test]
fn a_flash_of_units_that_do_not_fit_is_refused() {
    assert!(fits::<1, 1>() && fits::<16, 32>() && fits::<64, 64>());
    assert!(!fits::<1, 48>() && !fits::<48, 1>(), "no divisors");
    assert!(!fits::<1, 128>() && !fits::<128, 1>(), "longer");
    assert!(!fits::<1, 0>() && !fits::<0, 1>(), "none");
}

/// The next generation is behind the greatest of all damaged ones, in whichever order they stand.
#[test]
fn damaged_generations_may_fall_along_the_slot() {
    for damaged in [[9, 10], [10, 9]] {
        let mut flash: Flash<{ 4 * PADDED_LEN }> = Flash::new(8 * PADDED_LEN);
        let second = framed(1, 7).len().next_multiple_of(PIECE);
        let places = [0, second, 2 * second];
        for (place, generation) in places.into_iter().zip([7, damaged[0], damaged[1]]) {
            let record = framed(1, generation);
            flash.bytes[place..][..record.len()].copy_from_slice(&record);
            if generation != 7 {
                flash.bytes[place + 300] ^= 1;
            }
        }
        let mut store = store(flash);
        assert!(store.load().unwrap().unwrap().damaged);
        with(2, |content| store.save(content)).unwrap();
        assert_eq!(store.load().unwrap().unwrap().generation, 11, "{damaged:?}");
    }
}

/// The starts of a run are full, not none.
#[test]
fn starts_saturate() {
    let mut store = store(<Flash>::new(2 * ERASE));
    store.since.starts = u32::MAX;
    store.started(true);
    assert_eq!((store.since.starts, store.since.failures), (u32::MAX, 1));
}

/// A learner that remembers more than there is room for is cut off there.
#[test]
fn too_long_a_memory_is_cut_off() {
    let (nets, record) = (nets(1), record_of(1));
    let mut store = store(<Flash>::new(4 * ERASE));
    let content = Content {
        memory: Memory::New(notes(1), &Most, MEMORY_LEN + 1000),
        ..Content::new(&nets, &record)
    };
    store.save(&content).unwrap();
    let memory = memory(&mut store);
    let (found, learnt) = Notes::of(&memory).unwrap();
    assert_eq!((found, learnt.len()), (notes(1), MEMORY_LEN));
    assert!(
        learnt
            .iter()
            .zip(0usize..)
            .all(|(byte, at)| *byte == at as u8)
    );
}
