//! Flash that is worn out: cells that keep what they like.

use super::*;

/// Slots with room for four records.
const WIDE: usize = 4 * PADDED_LEN;
type Wide = Flash<WIDE>;

/// One bad cell, anywhere in either slot: every save and every append succeeds at the latest when
/// it is tried twice, and what is found is what was stored last.
#[test]
fn one_bad_cell_costs_nothing() {
    for cell in (0..2 * WIDE).step_by(257) {
        let mut flash = Wide::new(2 * WIDE);
        flash.stuck.push(cell);
        let mut worn = store(flash);
        for n in 1..=4 {
            with(n, |content| worn.save(content)).expect("room beside the cell");
            assert_eq!(found(&worn.flash), Some(n), "{cell}");
            let mut append = || {
                with(n + 10, |content| {
                    worn.begin(content)?;
                    while worn.go_on(content)? == Progress::GoesOn {}
                    Ok::<_, Error<Failure>>(())
                })
            };
            if append().is_err() {
                append().expect("room behind the cell");
            }
            assert_eq!(found(&worn.flash), Some(n + 10), "{cell}");
        }
    }
}

/// A slot that keeps nothing any more: records go behind the newest one in the other slot, until
/// that is full. Then storing fails, and the newest good record stays.
#[test]
fn a_worn_slot_leaves_the_other_in_use() {
    for slot in [0, WIDE] {
        let mut flash = Wide::new(2 * WIDE);
        if slot == 0 {
            // the first record is in slot 1
            flash.stuck.extend((0..WIDE).step_by(PIECE));
            assert_eq!(saved_wide(flash.clone(), 1).0.map(drop), Err(Error::Verify));
            flash.stuck.clear();
            flash = saved_wide(flash, 1).1;
            flash = saved_wide(flash, 1).1;
        } else {
            flash = saved_wide(flash, 1).1;
        }
        flash.stuck.extend((slot..slot + WIDE).step_by(PIECE));
        let mut kept = 1;
        for n in 2..40 {
            let (result, after) = saved_wide(flash, n);
            flash = after;
            if result.is_ok() {
                kept = n;
            } else {
                assert_eq!(result, Err(Error::Verify));
            }
            assert_eq!(found(&flash), Some(kept));
        }
        assert!(kept > 4, "{kept}");
    }
}

fn saved_wide(flash: Wide, n: u8) -> (Result<u32, Error<Failure>>, Wide) {
    let mut store = store(flash);
    let result = with(n, |content| store.save(content));
    (result, store.into_inner())
}

proptest! {
    /// Bits that fall out of flash while it lies there, any number of them: the newest record that
    /// is still whole is found, or none; never one that was not stored. Storing works again.
    #[test]
    fn bits_that_rot(
        records in 1..8u8, bits in prop::collection::vec((0..2 * WIDE, 0..8u8), 0..12)
    ) {
        let mut flash = (1..=records).fold(Wide::new(2 * WIDE), |flash, n| saved_wide(flash, n).1);
        for (at, bit) in bits {
            flash.bytes[at] ^= 1 << bit;
        }
        let now = found(&flash);
        prop_assert!(now.is_none_or(|n| n <= records && n + 2 > records), "{:?}", now);
        let (result, flash) = saved_wide(flash, 99);
        prop_assert!(result.is_ok());
        prop_assert_eq!(found(&flash), Some(99));
    }
}
