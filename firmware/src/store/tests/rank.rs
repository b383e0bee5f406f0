//! Which of two records counts, where their generations alone do not say it.

use super::*;

/// Slots with room for four records.
const WIDE: usize = 4 * PADDED_LEN;
type Wide = Flash<WIDE>;

fn append(store: &mut Store<Wide>, n: u8) -> Result<(), Error<Failure>> {
    with(n, |content| {
        store.begin(content)?;
        while store.go_on(content)? == Progress::GoesOn {}
        Ok(())
    })
}

/// A record was cut off within its last piece and did not read as a good one; others came after it.
/// Then its weak cells read as they were meant to. It does not count: it is older.
#[test]
fn a_record_that_heals_is_not_the_newest() {
    let kinds: [fn(&mut Store<Wide>, u8) -> bool; 2] = [
        |store, n| append(store, n).is_ok(),
        |store, n| with(n, |content| store.save(content)).is_ok(),
    ];
    for saves in 1..=2 {
        for first in kinds {
            for second in kinds {
                let mut before = store(Wide::new(2 * WIDE));
                for _ in 0..saves {
                    with(1, |content| before.save(content)).unwrap();
                }
                let mut whole = store(before.flash.clone());
                assert!(first(&mut whole, 50));
                let work = whole.flash.work - before.flash.work;
                let mut cut = before.into_inner();
                // in its checksum
                let len = framed(50, 0).len();
                let padding = len.next_multiple_of(PIECE) - len;
                (cut.left, cut.torn) = (work - padding - 2, 0x5A);
                let mut cut = store(cut);
                assert!(!first(&mut cut, 50));
                let mut flash = cut.into_inner();
                assert_eq!(found(&flash), Some(1));
                flash.left = usize::MAX;
                let mut next = store(flash);
                assert!(second(&mut next, 60));
                let mut flash = next.into_inner();
                let at = (0..2 * WIDE).find(|&at| {
                    let record = framed(50, 0);
                    flash.bytes[at..].starts_with(&record[..8])
                        && flash.bytes[at + 16..][..400] == record[16..416]
                });
                if let Some(at) = at {
                    flash.bytes[at..at + len].copy_from_slice(&whole.flash.bytes[at..at + len]);
                }
                assert_eq!(found(&flash), Some(60), "{saves}");
            }
        }
    }
}

/// Of two records with the same generation, which an older firmware could write, the later one
/// counts, and the next one is newer than both.
#[test]
fn of_two_with_one_generation_the_later_counts() {
    let second = framed(1, 7).len().next_multiple_of(PIECE);
    for at in [second, WIDE, WIDE + second] {
        let mut flash = Wide::new(2 * WIDE);
        flash.bytes.fill(0xFF);
        flash.written.fill(false);
        for (at, n) in [(0, 1), (at, 2)] {
            let record = framed(n, 7);
            flash.bytes[at..][..record.len()].copy_from_slice(&record);
            flash.written[at..][..record.len()].fill(true);
        }
        assert_eq!(found(&flash), Some(2), "{at}");
        let mut next = store(flash);
        append(&mut next, 3).unwrap();
        assert_eq!(next.load().unwrap().unwrap().generation, 8);
        assert_eq!(found(&next.flash), Some(3));
    }
}

/// A frame whose generation has rotted away from all others does not move the count.
#[test]
fn a_rotten_generation_is_not_followed() {
    for bit in 0..32 {
        let mut flash: Flash = (1..=2).fold(Flash::new(2 * ERASE), |flash, n| saved(flash, n).1);
        flash.bytes[8 + bit / 8] ^= 1 << (bit % 8);
        for n in 3..6 {
            let (stored, after) = saved(flash, n);
            assert!(stored.unwrap() < 80, "{bit}");
            flash = after;
            assert_eq!(found(&flash), Some(n), "{bit}");
        }
    }
}
