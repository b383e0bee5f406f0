//! The store's two sectors of flash, by the firmware's own driver and store.

use cortex_m_semihosting::hprintln;
use embedded_storage::nor_flash::{NorFlash, ReadNorFlash};
use firmware::configuration::record::Record;
use firmware::model::Nets;
use firmware::store::{Content, Progress, Step, Store};
use stm32f4::stm32f405::FLASH;

use crate::board::flash::Sectors;
use crate::timed;

const SECTOR: u32 = Sectors::ERASE_SIZE as u32;
const BOTH: u32 = 2 * SECTOR;
const PIECE: u32 = 64;
/// The independent watchdog resets after 4 s, which an erasure must not take (DS8626: at most 2 s).
const LONGEST_US: u32 = 3_000_000;

/// Writes, reads and erases both sectors, then stores records. Only if nothing is in them.
pub fn holds(flash: FLASH) {
    let mut flash = Sectors::new(flash);
    if !every(&mut flash, 0, BOTH, |_| u32::MAX) {
        hprintln!(
            "skipped: the store is not blank, and what it holds would be lost; remedy: probe-rs erase --chip NAME"
        );
        return;
    }
    for from in [0, SECTOR] {
        let words = SECTOR / 4;
        let ((), written) = timed(|| write(&mut flash, from));
        let (same, read) = timed(|| every(&mut flash, from, SECTOR, pattern));
        let (erased, us) = timed(|| flash.erase(from, from + SECTOR));
        hprintln!(
            "sector at {}: {} ns to program a word, {} ns to read one, {} us to erase it",
            from,
            written * 1000 / words,
            read * 1000 / words,
            us
        );
        assert!(same, "a word does not read back as programmed");
        assert!(erased.is_ok() && us < LONGEST_US, "erasing: {erased:?}");
        assert!(
            every(&mut flash, from, SECTOR, |_| u32::MAX),
            "not blank after erasing"
        );
    }
    let mut flash = records(flash);
    let erased = flash.erase(0, BOTH); // as it was
    assert!(erased.is_ok(), "erasing: {erased:?}");
}

/// A different word at each place, with as many ones as zeros on average.
fn pattern(offset: u32) -> u32 {
    (offset ^ 0x5555_5555).wrapping_mul(0x9E37_79B1)
}

fn write(flash: &mut Sectors, from: u32) {
    for at in (from..from + SECTOR).step_by(PIECE as usize) {
        let mut bytes = [0; PIECE as usize];
        for (word, offset) in bytes
            .as_chunks_mut::<4>()
            .0
            .iter_mut()
            .zip((at..).step_by(4))
        {
            *word = pattern(offset).to_le_bytes();
        }
        let done = flash.write(at, &bytes);
        assert!(done.is_ok(), "programming at {at}: {done:?}");
    }
}

/// Whether every word is the one expected of its place.
fn every(flash: &mut Sectors, from: u32, len: u32, expected: fn(u32) -> u32) -> bool {
    (from..from + len).step_by(PIECE as usize).all(|at| {
        let mut bytes = [0; PIECE as usize];
        let read = flash.read(at, &mut bytes).is_ok();
        let words = bytes.as_chunks::<4>().0.iter().zip((at..).step_by(4));
        read && words
            .into_iter()
            .all(|(word, offset)| *word == expected(offset).to_le_bytes())
    })
}

/// Stores two records, one that erases and one behind it. Each is found by a store that knows of
/// neither, as after a reset.
fn records(mut flash: Sectors) -> Sectors {
    for number in 1..=2u8 {
        let record = Record::from_slice(&[number; 100]).expect("there is room");
        let mut store = Store::new(flash).expect("it fits");
        let before = store.load().expect("no newer firmware");
        assert_eq!(
            before.map_or(0, |stored| stored.generation),
            u32::from(number) - 1
        );
        let (done, us) = timed(|| store.carry_out(Step::Save, &Content::new(&Nets::NONE, &record)));
        hprintln!("record {} stored in {} us", number, us);
        assert_eq!(done, Progress::Done);
        let mut again = Store::new(store.into_inner()).expect("it fits");
        let found = again.load().expect("no newer firmware").expect("a record");
        assert!(
            found.record == record && !found.damaged,
            "record {number} is not found again"
        );
        flash = again.into_inner();
    }
    flash
}
