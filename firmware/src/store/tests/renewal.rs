//! A changed key: no record with another one is left, or the change fails.

use super::*;

/// Slots with room for four records.
const WIDE: usize = 4 * PADDED_LEN;
type Wide = Flash<WIDE>;

/// Number of the record with the old key, and of the one with the new key.
const OLD: u8 = 22;
const NEW: u8 = 11;

fn secret(n: u8) -> Secret {
    match key_of(n) {
        Key::Secret(secret) => secret,
        _ => panic!("{n} has no secret"),
    }
}

/// Whether the bytes of a secret are in the flash, wherever that is.
fn holds(flash: &Wide, n: u8) -> bool {
    let Secret(secret) = secret(n);
    flash.bytes.windows(secret.len()).any(|at| at == secret)
}

/// A device with records of the old key in both slots; the newest is in this slot.
fn keyed(slot: usize) -> Wide {
    let records = if slot == 0 { 3 } else { 2 };
    (0..records).fold(Wide::new(2 * WIDE), |flash, _| {
        let mut store = store(flash);
        with(OLD, |content| store.save(content)).unwrap();
        store.into_inner()
    })
}

/// Changes the key as the application does: twice.
fn renewed(flash: Wide) -> ([Progress; 2], Wide) {
    let mut store = store(flash);
    let steps = [(); 2].map(|()| with(NEW, |content| store.carry_out(Step::Renew, content)));
    (steps, store.into_inner())
}

#[test]
fn a_changed_key_leaves_nothing_of_the_old_one() {
    for slot in [0, 1] {
        let (steps, flash) = renewed(keyed(slot));
        // after the first of two the old key is still in the other slot
        assert_eq!(steps, [Progress::GoesOn, Progress::Done]);
        assert_eq!(found(&flash), Some(NEW));
        assert!(!holds(&flash, OLD));
    }
}

/// The slot that is to take the first record keeps nothing. The record goes behind the old one,
/// which cannot be erased without losing both.
#[test]
fn an_old_key_that_stays_is_not_called_gone() {
    for slot in [0, 1] {
        let mut flash = keyed(slot);
        let worn = (1 - slot) * WIDE;
        flash.stuck.extend((worn..worn + WIDE).step_by(PIECE));
        let (steps, flash) = renewed(flash);
        assert!(holds(&flash, OLD), "the case is none");
        assert_eq!(steps, [Progress::GoesOn; 2]);
        // the new one is in force all the same, and the next power-on finds the old one
        assert_eq!(found(&flash), Some(NEW));
        let mut next = store(flash.clone());
        assert!(next.load().unwrap().unwrap().other_key);
        // another record in use of the new key does not hide it
        with(NEW, |content| next.carry_out(Step::Save, content));
        assert!(next.load().unwrap().unwrap().other_key);
        // with a slot that works again it goes
        let mut mended = next.into_inner();
        mended.stuck.clear();
        let (steps, flash) = renewed(mended);
        assert_eq!(steps[1], Progress::Done);
        assert!(!holds(&flash, OLD) && found(&flash) == Some(NEW));
    }
}

/// The slot that held the old key retains nothing new, but it can be erased.
#[test]
fn an_old_key_that_was_erased_is_gone() {
    for slot in [0, 1] {
        let mut flash = keyed(slot);
        let worn = slot * WIDE;
        flash.stuck.extend((worn..worn + WIDE).step_by(PIECE));
        let (steps, flash) = renewed(flash);
        assert_eq!(steps, [Progress::GoesOn, Progress::Done]);
        assert_eq!(found(&flash), Some(NEW));
        assert!(!holds(&flash, OLD));
    }
}

/// No slot has room: the other one keeps nothing, and the newest record's is full.
#[test]
fn a_key_without_room_is_not_stored() {
    let mut flash = keyed(1);
    let mut full = store(flash);
    while with(OLD, |content| full.begin(content)).is_ok() {
        let go_on = |store: &mut Store<Wide>| with(OLD, |content| store.go_on(content));
        while go_on(&mut full) == Ok(Progress::GoesOn) {}
    }
    flash = full.into_inner();
    flash.stuck.extend((0..WIDE).step_by(PIECE));
    let (steps, flash) = renewed(flash);
    assert_eq!(steps, [Progress::Failed; 2]);
    assert!(holds(&flash, OLD) && found(&flash) == Some(OLD));
}

/// Power fails at any byte of either step. The next power-on finds the old key alone, or the new
/// one, and says whether the old one is still there.
#[test]
fn power_may_fail_while_a_key_changes() {
    for slot in [0, 1] {
        let flash = keyed(slot);
        let work = renewed(flash.clone()).1.work - flash.work;
        for left in (0..=work).step_by(61) {
            let mut cut = flash.clone();
            (cut.left, cut.torn) = (left, 0x5A);
            let (_, mut after) = renewed(cut);
            after.left = usize::MAX;
            let stored = store(after.clone()).load().unwrap().unwrap();
            match stored.key == key_of(NEW) {
                true => assert!(stored.other_key || !readable(&after, OLD), "{left}"),
                false => assert!(stored.key == key_of(OLD) && !stored.other_key),
            }
        }
    }
}

/// Whether a record of a number can be found once those that are newer are damaged.
fn readable(flash: &Wide, n: u8) -> bool {
    let mut store = store(flash.clone());
    (0..9).any(|passed| {
        let stored = store.load_older(passed).unwrap();
        stored.is_some_and(|stored| stored.key == key_of(n))
    })
}

/// What a record of an older version, without a key, would let in is another key, too. One that is
/// damaged lets nobody in.
#[test]
fn a_record_without_a_key_is_one_with_another() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    let old = of_version(2, 9, &images, &record_of(5));
    let mut flash = Wide::new(2 * WIDE);
    flash.bytes.fill(0xFF);
    flash.bytes[..old.len()].copy_from_slice(&old);
    let new = framed(NEW, 10);
    flash.bytes[WIDE..][..new.len()].copy_from_slice(&new);
    let other_key = |flash: &Wide| store(flash.clone()).load().unwrap().unwrap().other_key;
    assert!(other_key(&flash));
    flash.bytes[100] ^= 1;
    assert!(!other_key(&flash));
}
