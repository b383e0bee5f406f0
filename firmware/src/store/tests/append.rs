//! Records behind each other, without erasing; and flash that does not keep what is written.

use super::*;

/// Slots with room for four records.
const WIDE: usize = 4 * PADDED_LEN;
type Wide = Flash<WIDE>;

/// Appends number `n`.
fn appended(flash: Wide, n: u8) -> (Result<(), Error<Failure>>, Wide) {
    let mut store = store(flash);
    let result = with(n, |content| {
        store.begin(content)?;
        while store.go_on(content)? == Progress::GoesOn {}
        Ok(())
    });
    (result, store.into_inner())
}

/// Bytes of record `n` in flash.
fn padded(n: u8) -> usize {
    framed(n, 0).len().next_multiple_of(PIECE)
}

/// Records behind each other until the slot is full, without erasing. Then room is made.
#[test]
fn what_is_appended_erases_nothing() {
    let mut flash = Wide::new(2 * WIDE);
    assert_eq!(appended(flash.clone(), 1).0, Err(Error::Full), "no record");
    let mut first = store(flash);
    with(1, |content| first.save(content)).unwrap();
    flash = first.into_inner();
    let (mut used, mut n) = (padded(1), 2);
    while used + padded(n) <= WIDE {
        let before = flash.work;
        let (stored, after) = appended(flash, n);
        stored.unwrap();
        assert_eq!(after.work - before, padded(n));
        flash = after;
        assert_eq!(found(&flash), Some(n));
        (used, n) = (used + padded(n), n + 1);
    }
    let (result, flash) = appended(flash, n);
    assert_eq!((result, found(&flash)), (Err(Error::Full), Some(n - 1)));
    let work = flash.work;
    let mut full = store(flash);
    full.make_room().unwrap();
    assert_eq!(full.load().unwrap().unwrap().generation, u32::from(n));
    full.make_room().unwrap();
    let flash = full.into_inner();
    assert_eq!(flash.work - work, WIDE + padded(n - 1), "erased once");
    assert_eq!(found(&flash), Some(n - 1));
    let (result, flash) = appended(flash, 6);
    assert!(result.is_ok() && found(&flash) == Some(6));
    // a damaged one: the one before
    let mut damaged = flash.clone();
    damaged.bytes[WIDE + padded(n - 1) + 100] ^= 1;
    assert_eq!(found(&damaged), Some(n - 1));
    // and one that is saved goes to the other slot
    let mut saves = store(flash);
    with(7, |content| saves.save(content)).unwrap();
    assert_eq!(found(&saves.into_inner()), Some(7));
}

/// Power fails at any byte of an append: the old record or the new one, and the next append finds
/// room.
#[test]
fn power_may_fail_while_appending() {
    let mut first = store(Wide::new(2 * WIDE));
    with(1, |content| first.save(content)).unwrap();
    let flash = first.into_inner();
    let work = appended(flash.clone(), 77).1.work - flash.work;
    for left in 0..=work {
        for torn in [0x00, 0xFF, 0x5A] {
            let mut cut = flash.clone();
            (cut.left, cut.torn) = (left, torn);
            let (result, mut after) = appended(cut, 77);
            assert_ne!(
                result.as_ref().map(|_| ()),
                Err(&Error::Flash(Failure::Misuse))
            );
            assert!(matches!(found(&after), Some(1 | 77)), "{left}");
            after.left = usize::MAX;
            let (result, after) = appended(after, 99);
            assert!(result.is_ok(), "{left} {torn}");
            assert_eq!(found(&after), Some(99));
        }
    }
}

/// Flash that does not keep what is written to it is noticed. The old record stays in use, or the
/// new one goes to another place.
#[test]
fn what_does_not_read_back_is_reported() {
    for bad in [9, 16 + 300, 16 + IMAGES_LEN + 3, framed(9, 2).len() - 30] {
        let mut first = store(Wide::new(2 * WIDE));
        with(1, |content| first.save(content)).unwrap();
        let mut flash = first.into_inner();
        // a cell behind the record that stays as it is, at either position
        for at in [padded(1) + bad, WIDE + bad] {
            flash.stuck.push(at);
        }
        let (result, after) = appended(flash.clone(), 9);
        assert_eq!(result, Err(Error::Verify), "{bad}");
        assert_eq!(store(after).load().unwrap().unwrap().nets, nets(1));
        let mut saves = store(flash);
        with(9, |content| saves.save(content)).expect("beside the bad cell");
        assert_eq!(saves.load().unwrap().unwrap().nets, nets(9));
    }
}

/// A controller that reports success and changes nothing: an old record in the slot is not taken
/// for the new one.
#[test]
fn a_dead_flash_is_noticed() {
    let mut flash: Flash = Flash::new(2 * ERASE);
    for n in 1..=2 {
        flash = saved(flash, n).1;
    }
    flash.dead = true;
    flash.written.fill(false); // it would not even say that it is misused
    // even one with the same content
    for n in [3, 1] {
        let (result, flash) = saved(flash.clone(), n);
        assert_eq!((result, found(&flash)), (Err(Error::Verify), Some(2)));
    }
}
