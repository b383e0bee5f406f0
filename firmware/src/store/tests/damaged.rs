//! A damaged record beside the newest one, and the rules of records that are nearly good.

use super::*;
use content::KEY_AT;

/// Slots with room for four records.
const WIDE: usize = 4 * PADDED_LEN;
type Wide = Flash<WIDE>;

/// A record behind a damaged one would never be found by a firmware that gives up at the damage.
/// What is stored by command goes to the other slot, so that the damage is erased in its turn.
#[test]
fn nothing_is_stored_by_command_behind_a_damaged_record() {
    let mut flash = Wide::new(2 * WIDE);
    let mut first = store(flash);
    with(1, |content| first.save(content)).unwrap();
    let place = framed(1, 1).len().next_multiple_of(PIECE);
    let save = |store: &mut Store<Wide>, n| with(n, |content| store.carry_out(Step::Save, content));
    assert_eq!(save(&mut first, 2), Progress::Done);
    flash = first.into_inner();
    assert_eq!(flash.bytes[place..][..4], *b"LRNS", "behind the first");
    flash.bytes[place + 300] ^= 1;
    let work = flash.work;
    let mut next = store(flash);
    assert_eq!(save(&mut next, 3), Progress::Done);
    let flash = next.into_inner();
    let padded = framed(3, 1).len().next_multiple_of(PIECE);
    assert_eq!(flash.work - work, WIDE + padded, "the other slot is erased");
    assert_eq!(flash.bytes[WIDE..][..4], *b"LRNS");
    assert!(!store(flash.clone()).load().unwrap().unwrap().damaged);
    // and without damage the next one goes behind it
    let work = flash.work;
    let mut next = store(flash);
    assert_eq!(save(&mut next, 3), Progress::Done);
    assert_eq!(next.into_inner().work - work, padded);
}

/// A frame with a right checksum around contents that do not fit it: no record, and no panic.
#[test]
fn a_good_frame_around_bad_contents_is_no_record() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    let long = std::vec![0; MAX_LEN + 1];
    let of = |record: &[u8], fixed: usize| {
        let mut rest = (record.len() as u16).to_le_bytes().to_vec();
        rest.resize(fixed, 0);
        if fixed > KEY_AT {
            rest[KEY_AT] = 0x5A;
        }
        rest.extend(record);
        rest
    };
    let mut other_key = of(&record_of(5), content::FIXED_LEN);
    other_key[KEY_AT] ^= 1;
    let mut too_many = of(&record_of(5), content::FIXED_LEN);
    too_many[0] += 1;
    let mut bad_image = images.clone();
    bad_image[0] ^= 1;
    let mut bad_maps = images.clone();
    bad_maps[650] ^= 1;
    let good = of(&record_of(5), content::FIXED_LEN);
    let cases: [(u32, &[u8], &[u8]); 12] = [
        (5, &images, &other_key),
        (5, &images, &too_many),
        (5, &images, &of(&long, content::FIXED_LEN)),
        (5, &images, &good[..content::FIXED_LEN - 1]),
        (5, &images[1..], &good),
        (5, &bad_image, &good),
        (5, &bad_maps, &good),
        (5, &images[..608], &good),
        (4, &images[..607], &good),
        (3, &images, &[0]),
        (2, &images, &long),
        (0, &images, &good),
    ];
    let found_in = |version, images: &[u8], rest: &[u8]| {
        let mut flash: Flash<{ 2 * ERASE }> = Flash::new(4 * ERASE);
        let record = of_version(version, 9, images, rest);
        flash.bytes[..record.len()].copy_from_slice(&record);
        store(flash).load().unwrap()
    };
    for (case, (version, images, rest)) in cases.into_iter().enumerate() {
        assert_eq!(found_in(version, images, rest), None, "{case}");
    }
    // the same, good: with the longest configuration, and with none of the unit's number
    let longest = of(&long[..MAX_LEN], content::FIXED_LEN);
    let stored = found_in(5, &images, &longest).unwrap();
    assert_eq!((stored.record.len(), stored.unit), (MAX_LEN, None));
    let stored = found_in(2, &images, &long[..MAX_LEN]).unwrap();
    assert_eq!(stored.record.len(), MAX_LEN);
}

/// A record may end with its slot, and not a byte later.
#[test]
fn a_record_may_end_with_its_slot() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    let place = 3 * PIECE;
    // 16 bytes of header and 4 of checksum
    let room = ERASE - place - IMAGES_LEN - 20;
    for (more, is) in [(0, true), (1, false), (PIECE, false)] {
        let mut rest = 0u16.to_le_bytes().to_vec();
        rest.resize(content::FIXED_LEN, 0);
        rest[KEY_AT] = 0x5A;
        rest.resize(room + more, 7); // a memory longer than any
        let record = of_version(5, 9, &images, &rest);
        for slot in [0, ERASE] {
            let mut flash: Flash = Flash::new(3 * ERASE);
            flash.bytes[slot + place..][..record.len()].copy_from_slice(&record);
            let mut store = store(flash);
            assert_eq!(store.load().unwrap().is_some(), is, "{slot} {more}");
            assert_eq!(store.memory(&mut [0; MEMORY_MAX]), 0);
        }
    }
}

/// A damaged record between two good ones is reported with the older of them.
#[test]
fn damage_between_two_good_records_is_reported() {
    let mut first = store(Wide::new(2 * WIDE));
    with(1, |content| first.save(content)).unwrap();
    for n in [2, 3] {
        with(n, |content| first.begin(content)).unwrap();
        while with(n, |content| first.go_on(content)).unwrap() == Progress::GoesOn {}
    }
    let mut flash = first.into_inner();
    flash.bytes[framed(1, 1).len().next_multiple_of(PIECE) + 300] ^= 1;
    let mut next = store(flash);
    assert!(!next.load().unwrap().unwrap().damaged);
    let older = next.load_older(1).unwrap().unwrap();
    assert!(older.nets == nets(1) && older.damaged);
}
