//! The memory of a unit is stored with the weights, a piece at a time, and stays.

use super::*;

/// The store goes on from record to record, and a memory stays that nobody has anything new to.
#[test]
fn the_same_memory_stays_through_other_records() {
    let mut store = store(<Flash>::new(8 * ERASE));
    let record = record_of(3);
    let empty = Content {
        memory: Memory::Same,
        ..Content::new(&Nets::NONE, &record)
    };
    store.save(&empty).unwrap();
    assert_eq!(memory(&mut store), [0_u8; 0], "there is none");
    with(3, |content| store.save(content)).unwrap();
    let first = memory(&mut store);
    assert_eq!(first.len(), NOTES_LEN + learnt(3).len());
    // records of other lengths, so that it moves within its pieces
    for n in [0, 1, 17, 18, 250] {
        let (nets_of, record) = (nets(n), record_of(n));
        let content = Content {
            memory: Memory::Same,
            ..Content::new(&nets_of, &record)
        };
        match n % 2 {
            0 => drop(store.save(&content).unwrap()),
            _ => {
                store.begin(&content).unwrap();
                while store.go_on(&content).unwrap() == Progress::GoesOn {}
            }
        }
        let stored = store.load().unwrap().unwrap();
        assert!(stored.nets == nets(n) && stored.record == record_of(n));
        assert_eq!(memory(&mut store), first, "{n}");
    }
    store.save(&Content::new(&nets(2), &record_of(2))).unwrap();
    assert_eq!(memory(&mut store), [0_u8; 0]);
}

/// A pass of the frame path writes no more than 64 bytes.
#[test]
fn a_pass_writes_one_piece() {
    let mut store = store(<Flash>::new(8 * ERASE));
    with(1, |content| store.save(content)).unwrap();
    with(18, |content| {
        assert_eq!(store.carry_out(Step::Begin, content), Progress::GoesOn);
        let mut passes = 0;
        let mut work = store.flash.work;
        loop {
            let progress = store.carry_out(Step::GoOn, content);
            passes += 1;
            assert_eq!(
                core::mem::replace(&mut work, store.flash.work) + PIECE,
                work
            );
            if progress == Progress::Done {
                break;
            }
            let before = with(1, |content| content.record.clone());
            let mut other = Store::new(store.flash.clone()).unwrap();
            assert_eq!(other.load().unwrap().unwrap().record, before);
        }
        assert_eq!(passes, framed(18, 0).len().div_ceil(PIECE));
    });
    assert_eq!(found(&store.flash), Some(18));
}

/// A record that is given up leaves the newest record in force, and the next one finds room behind
/// it. A content that changes meanwhile is not stored.
#[test]
fn what_is_given_up_half_way_is_no_record() {
    let mut store = store(<Flash>::new(8 * ERASE));
    with(1, |content| store.save(content)).unwrap();
    with(2, |content| {
        assert_eq!(store.carry_out(Step::GoOn, content), Progress::Failed)
    });
    for n in [2, 3] {
        with(n, |content| store.begin(content).unwrap());
        with(n, |content| {
            assert_eq!(store.go_on(content), Ok(Progress::GoesOn))
        });
    }
    with(4, |content| {
        assert_eq!(store.go_on(content), Err(Error::NotBegun))
    });
    assert_eq!(found(&store.flash), Some(1));
    with(5, |content| {
        store.begin(content).unwrap();
        while store.go_on(content).unwrap() == Progress::GoesOn {}
    });
    assert_eq!(found(&store.flash), Some(5));
}

/// The checksum may be cut by the end of a piece, wherever that is.
#[test]
fn records_of_every_length_are_found() {
    for len in 0..=2 * PIECE as u8 {
        let record: Record = (0..len).collect();
        let mut store = store(<Flash>::new(2 * ERASE));
        store.save(&Content::new(&nets(1), &record)).unwrap();
        let stored = store.load().unwrap().unwrap();
        assert!(stored.record == record && stored.nets == nets(1), "{len}");
    }
}

/// Versions 1 and 2 have no memory. Version 2 stands behind others every 1152 bytes, and at
/// power-on it becomes one of this version, which an older firmware finds.
#[test]
fn a_record_of_version_2_is_read_and_renewed() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    for place in [0, 1152, ERASE] {
        let mut flash: Flash = Flash::new(2 * ERASE);
        flash.bytes.fill(0xFF);
        let record = of_version(2, 9, &images, &record_of(5));
        flash.bytes[place..][..record.len()].copy_from_slice(&record);
        let mut store = store(flash);
        let stored = store.load().unwrap().unwrap();
        assert!(stored.nets == nets(5) && stored.record == record_of(5));
        assert_eq!((stored.generation, memory(&mut store)), (9, std::vec![]));
        store.make_room().unwrap();
        let stored = store.load().unwrap().unwrap();
        assert!(stored.nets == nets(5) && stored.record == record_of(5));
        assert_eq!((stored.generation, memory(&mut store)), (10, std::vec![]));
        let slot = if place < ERASE { ERASE } else { 0 };
        assert_eq!(store.flash.bytes[slot..][..8], *b"LRNS\x05\0\0\0");
        assert_eq!(store.flash.bytes[place..][..record.len()], record);
        let work = store.flash.work;
        store.make_room().unwrap();
        assert_eq!(store.flash.work, work, "once");
    }
}

/// The memory of one unit does not belong to another one, or to other inputs.
#[test]
fn a_memory_is_of_one_sensor_with_its_inputs() {
    use crate::configuration::Configuration;
    use crate::inputs::Source;
    let unit_with = |serial: &str, last| {
        let mut configuration = Configuration::default();
        configuration.identity.serial = serial.try_into().unwrap();
        configuration.inputs[1][2] = last;
        unit(&configuration)
    };
    let all = [
        unit_with("", Source::ForceZ),
        unit_with("N1", Source::ForceZ),
        unit_with("N2", Source::ForceZ),
        unit_with("N1", Source::Temperature),
    ];
    for (k, one) in all.iter().enumerate() {
        assert!(all[..k].iter().all(|other| other != one), "{k}");
    }
    let mut same = Configuration::default();
    same.identity.serial = "N1".try_into().unwrap();
    same.identity.name = "another name".try_into().unwrap();
    same.rate = 500.0;
    assert_eq!(unit(&same), all[1]);
}

/// A flash that cannot be erased, as in a simulator: what is in it is found all the same.
#[test]
fn a_record_that_cannot_be_renewed_is_used() {
    let mut images = std::vec![0; IMAGES_LEN];
    nets(5).write_images(0, &mut images);
    const SECTOR: usize = 128 * 1024;
    let mut flash: Flash<SECTOR> = Flash::new(2 * SECTOR);
    flash.bytes.fill(0);
    let record = of_version(1, 7, &images, &[]);
    flash.bytes[..record.len()].copy_from_slice(&record);
    flash.left = 0;
    let mut store = store(flash);
    assert_eq!(store.make_room(), Err(Error::Flash(Failure::PowerCut)));
    let stored = store.load().unwrap().unwrap();
    assert!(stored.nets == nets(5) && stored.generation == 7);
}

/// Temperatures that were never measured stay unknown.
#[test]
fn unknown_temperatures_come_back_as_unknown() {
    for temperatures in [None, Some([-3, 40])] {
        let notes = Notes {
            temperatures,
            ..notes(7)
        };
        assert_eq!(Notes::of(&notes.bytes()), Some((notes, &[][..])));
    }
}

/// The range of temperatures widens at either end, and by whole degrees, rounded.
#[test]
fn temperatures_widen_their_range() {
    let mut notes = Notes::default();
    let mut range = |celsius| {
        notes.see(celsius);
        notes.temperatures
    };
    let seen = [20.4, 20.6, -3.4, -3.6, 5.0].map(&mut range);
    let expected = [[20, 20], [20, 21], [-3, 21], [-4, 21], [-4, 21]];
    assert_eq!(seen, expected.map(Some));
}
