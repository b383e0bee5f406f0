//! Records of older versions, the record before the newest, and the device's life.

use super::*;

/// A record of version 3: it has a memory, and neither unit nor life.
#[test]
fn version_3_is_still_read() {
    let (mut images, record) = (std::vec![0; IMAGES_LEN], record_of(7));
    nets(7).write_images(0, &mut images);
    let mut rest = (record.len() as u16).to_le_bytes().to_vec();
    rest.extend(&record);
    rest.extend(notes(7).bytes());
    rest.extend(learnt(7));
    let bytes = of_version(3, 5, &images, &rest);
    let mut flash: Flash = Flash::new(2 * ERASE);
    flash.bytes[..bytes.len()].copy_from_slice(&bytes);
    let mut first = store(flash);
    let stored = first.load().unwrap().unwrap();
    assert!(stored.nets == nets(7) && stored.record == record);
    assert_eq!((stored.unit, stored.life), (None, Life::default()));
    assert_eq!(stored.key, Key::Unprovisioned);
    let remembered = memory(&mut first);
    assert_eq!(remembered[NOTES_LEN..], learnt(7));
    // it is stored once more in this version, and nothing of it is lost
    first.make_room().unwrap();
    let flash = first.into_inner();
    assert_eq!(flash.bytes[ERASE + 4], 5);
    let mut second = store(flash);
    let again = second.load().unwrap().unwrap();
    assert!(again.nets == stored.nets && again.record == stored.record);
    assert_eq!(memory(&mut second), remembered);
}

/// A record of version 4 has networks without maps; one of this version has them.
#[test]
fn maps_are_stored_since_version_5() {
    let mut of = nets(3);
    of.maps[1][2][0] = -3e-3;
    of.maps[0][1][1] = 2e-3;
    let mut images = std::vec![0; IMAGES_LEN];
    of.write_images(0, &mut images);
    let rest = framed(3, 1)[16 + IMAGES_LEN..].to_vec();
    let rest = &rest[..rest.len() - 4];
    for (version, maps) in [(4, Nets::NONE.maps), (5, of.maps)] {
        let record = of_version(version, 1, &images, rest);
        let mut flash: Flash = Flash::new(2 * ERASE);
        flash.bytes[..record.len()].copy_from_slice(&record);
        let mut found = store(flash);
        let stored = found.load().unwrap().unwrap();
        assert_eq!(stored.nets.maps, maps, "{version}");
        assert_eq!((stored.nets.gyro, stored.record), (of.gyro, record_of(3)));
        assert_eq!(stored.key, key_of(3));
        assert_eq!(memory(&mut found)[NOTES_LEN..], learnt(3));
    }
}

/// The good records that are newer can be passed over. The next record is still the newest.
#[test]
fn the_record_before_can_be_asked_for() {
    let mut flash: Flash<{ 16 * ERASE }> = Flash::new(32 * ERASE);
    let mut first = store(flash.clone());
    for n in 1..=3 {
        with(n, |content| first.save(content)).unwrap();
        with(n + 10, |content| {
            first.begin(content).unwrap();
            while first.go_on(content).unwrap() == Progress::GoesOn {}
        });
        flash = first.into_inner();
        first = store(flash.clone());
    }
    // a slot was erased by its last but one save
    for (passed, n) in [
        (0, Some(13)),
        (1, Some(3)),
        (2, Some(12)),
        (3, Some(2)),
        (4, None),
    ] {
        let stored = first.load_older(passed).unwrap();
        let expected = n.map(|n| (nets(n), record_of(n), key_of(n), false));
        let stored = stored.map(|s| (s.nets, s.record, s.key, s.damaged));
        assert_eq!(stored, expected, "{passed}");
    }
    // what is remembered, and the count, are the newest record's all the same
    assert_eq!(first.load_older(9), Ok(None));
    assert_eq!(first.next, 7);
    first.load_older(1).unwrap();
    assert_eq!(memory(&mut first)[NOTES_LEN..], learnt(13));
    with(9, |content| {
        first.begin(content).unwrap();
        while first.go_on(content).unwrap() == Progress::GoesOn {}
    });
    let stored = first.load().unwrap().unwrap();
    assert!(stored.nets == nets(9) && stored.generation == 7);
}

/// A newer record that is damaged is reported, whatever of it is damaged behind its generation.
#[test]
fn a_damaged_newer_record_is_reported() {
    let flash: Flash = (1..=2).fold(Flash::new(2 * ERASE), |flash, n| saved(flash, n).1);
    let damaged = |flash: &Flash| store(flash.clone()).load().unwrap().unwrap().damaged;
    assert!(!damaged(&flash));
    for at in HEADER_LEN..framed(2, 2).len() {
        let mut rotten = flash.clone();
        rotten.bytes[ERASE + at] ^= 4;
        assert_eq!(found(&rotten), Some(1));
        assert!(damaged(&rotten), "{at}");
        // an older one that is damaged is nobody's loss
        let mut rotten = flash.clone();
        rotten.bytes[at] ^= 4;
        assert_eq!((found(&rotten), damaged(&rotten)), (Some(2), false));
    }
}

/// Starts, failures, minutes and erasures add up over power cycles, as far as they were stored.
#[test]
fn the_life_adds_up() {
    let mut flash: Flash = Flash::new(2 * ERASE);
    let store_after = |flash: Flash, failed, minutes| {
        let mut started = store(flash);
        started.started(failed);
        started.load().unwrap();
        with(1, |content| {
            let content = Content {
                minutes,
                ..*content
            };
            started.save(&content).unwrap();
            // the next record of the same run does not count anything twice
            started.save(&Content { minutes, ..content }).unwrap();
        });
        let life = started.load().unwrap().unwrap().life;
        (started.into_inner(), life)
    };
    let mut expected = Life::default();
    for (failed, minutes) in [(false, 10), (true, 0), (false, 70)] {
        let life;
        (flash, life) = store_after(flash, failed, minutes);
        expected.starts += 1;
        expected.failures += u32::from(failed);
        expected.minutes += minutes;
        expected.erased = expected.erased.map(|times| times + 1);
        assert_eq!(life, expected);
        let mut lost = store(flash.clone());
        lost.started(true); // and nothing is stored
    }
    let full = Life {
        starts: u32::MAX,
        failures: u32::MAX,
        minutes: u32::MAX,
        erased: [u32::MAX; 2],
    };
    assert_eq!(full.and(&full), full);
    assert_eq!(Life::of(&expected.bytes()), expected);
}
