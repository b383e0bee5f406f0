//! The room that a slot has: to its last byte, and how much of it is made at power-on.

use super::*;

type Slots<const PLACES: usize> = Flash<PLACES>;
const TWO: usize = 2 * PADDED_LEN;
const EIGHT: usize = 8 * PADDED_LEN;

/// Does something with the longest content.
fn longest<T>(work: impl FnOnce(&Content) -> T) -> T {
    let record: Record = (0..MAX_LEN).map(|at| at as u8).collect();
    work(&Content {
        memory: Memory::New(notes(1), &Most, crate::learn::MEMORY_LEN),
        unit: 17,
        key: key_of(1),
        ..Content::new(&nets(1), &record)
    })
}

fn append<const PLACES: usize>(store: &mut Store<Slots<PLACES>>) -> Result<(), Error<Failure>> {
    longest(|content| {
        store.begin(content)?;
        while store.go_on(content)? == Progress::GoesOn {}
        Ok(())
    })
}

/// A store with so many of the longest records in one slot.
fn filled<const PLACES: usize>(records: usize) -> Store<Slots<PLACES>> {
    let mut store = store(Slots::<PLACES>::new(2 * PLACES));
    longest(|content| store.save(content)).unwrap();
    for _ in 1..records {
        append(&mut store).unwrap();
    }
    store
}

/// As many of the longest records fit as there are positions, and not one more.
#[test]
fn a_slot_is_used_to_its_end() {
    let mut store = filled::<TWO>(2);
    assert_eq!(append(&mut store), Err(Error::Full));
    let mut store = filled::<EIGHT>(8);
    assert_eq!(append(&mut store), Err(Error::Full));
    let mut memory = [0; MEMORY_MAX];
    assert_eq!(store.memory(&mut memory), MEMORY_MAX);
    assert_eq!(store.load().unwrap().unwrap().record.len(), MAX_LEN);
}

/// Room is made when less than half of the places is left, and at least one. Nothing of the record
/// is lost, and each slot counts its own erasures.
#[test]
fn room_is_made_for_half() {
    fn made<const PLACES: usize>(records: usize) -> bool {
        let mut store = filled::<PLACES>(records);
        let before = store.load().unwrap().unwrap();
        assert_eq!(before.life.erased, [1, 0]);
        let remembered = memory(&mut store);
        let work = store.flash.work;
        store.make_room().unwrap();
        let after = store.load().unwrap().unwrap();
        let made = store.flash.work > work;
        let places = PLACES / PADDED_LEN;
        let left = places - if made { 1 } else { records };
        assert_eq!(store.left() as usize, left);
        assert!(left >= (places / 2).max(1));
        assert_eq!(after.life.erased, [1, u32::from(made)]);
        assert_eq!(after.generation, before.generation + u32::from(made));
        assert!(after.nets == before.nets && after.record == before.record);
        assert_eq!((after.unit, after.key), (Some(17), key_of(1)));
        assert_eq!(memory(&mut store), remembered);
        assert!(!after.other_key);
        made
    }
    assert_eq!([1, 2].map(made::<TWO>), [false, true]);
    let eight = [1, 4, 5, 6, 7, 8].map(made::<EIGHT>);
    assert_eq!(eight, [false, false, true, true, true, true]);
}

/// A position is free only if all of it is: something stands in its last piece.
#[test]
fn a_place_that_is_not_free_to_its_end_is_passed_over() {
    let padded = framed(2, 2).len().next_multiple_of(PIECE);
    for piece in [0, padded / PIECE - 1] {
        let mut first = store(Slots::<EIGHT>::new(2 * EIGHT));
        with(1, |content| first.save(content)).unwrap();
        let mut flash = first.into_inner();
        let behind = framed(1, 1).len().next_multiple_of(PIECE);
        let at = behind + piece * PIECE + PIECE - 1;
        (flash.bytes[at], flash.written[at]) = (0x7F, true);
        let mut next = store(flash);
        with(2, |content| next.begin(content)).unwrap();
        while with(2, |content| next.go_on(content)).unwrap() == Progress::GoesOn {}
        let place = behind + (piece + 1) * PIECE;
        assert_eq!(next.flash.bytes[place..][..4], *b"LRNS", "{piece}");
        assert_eq!(found(&next.flash), Some(2));
    }
}
