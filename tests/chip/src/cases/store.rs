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
const PIECE: usize = 64;
/// The independent watchdog resets after 4 s, which an erasure must not take (DS8626: at most 2 s).
const LONGEST_US: u32 = 3_000_000;

/// Writes, reads and erases both sectors, then stores records. Only if nothing is in them.
pub fn holds(flash: FLASH) {
    let mut flash = Sectors::new(flash);
    if !has(&mut flash, 0, BOTH, blank) {
        hprintln!("skipped: the store is not blank, and what it holds would be lost");
        return hprintln!("remedy: probe-rs erase --chip NAME, which erases all");
    }
    for from in [0, SECTOR] {
        let mut all = (from..from + SECTOR).step_by(PIECE);
        let (done, us) = timed(|| all.try_for_each(|at| flash.write(at, &piece(at, pattern))));
        hprintln!("{} ns to program a word", us * 1000 / (SECTOR / 4));
        assert_eq!(done, Ok(()));
        let same = has(&mut flash, from, SECTOR, pattern);
        assert!(same, "a word does not read back as programmed");
        let (done, us) = timed(|| flash.erase(from, from + SECTOR));
        hprintln!("{} us to erase a sector", us);
        assert_eq!(done, Ok(()));
        assert!(us < LONGEST_US, "the watchdog would bite");
        assert!(has(&mut flash, from, SECTOR, blank), "not blank");
    }
    let mut flash = records(flash);
    assert_eq!(flash.erase(0, BOTH), Ok(())); // as it was
}

/// A different word at each place.
fn pattern(offset: u32) -> u32 {
    (offset ^ 0x5555_5555).wrapping_mul(0x9E37_79B1)
}

fn blank(_: u32) -> u32 {
    u32::MAX
}

fn piece(at: u32, word: fn(u32) -> u32) -> [u8; PIECE] {
    let mut bytes = [0; PIECE];
    let (words, _) = bytes.as_chunks_mut::<4>();
    for (place, offset) in words.iter_mut().zip((at..).step_by(4)) {
        *place = word(offset).to_le_bytes();
    }
    bytes
}

/// Whether every word is the one of its place.
fn has(flash: &mut Sectors, from: u32, len: u32, word: fn(u32) -> u32) -> bool {
    (from..from + len).step_by(PIECE).all(|at| {
        let mut bytes = [0; PIECE];
        flash.read(at, &mut bytes).is_ok() && bytes == piece(at, word)
    })
}

/// Stores two records, one that erases and one behind it. Each is found by a store that knows of
/// neither, as after a reset.
fn records(mut flash: Sectors) -> Sectors {
    for number in 1..=2 {
        let record = Record::from_slice(&[number; 100]).expect("there is room");
        let content = Content::new(&Nets::NONE, &record);
        let mut store = Store::new(flash).expect("it fits");
        let before = store.load().expect("no newer firmware");
        assert_eq!(before.is_some(), number > 1);
        let (done, us) = timed(|| store.carry_out(Step::Save, &content));
        hprintln!("record {} stored in {} us", number, us);
        assert_eq!(done, Progress::Done);
        let mut again = Store::new(store.into_inner()).expect("it fits");
        let found = again.load().expect("no newer firmware");
        let found = found.is_some_and(|found| found.record == record && !found.damaged);
        assert!(found, "the record is not found again");
        flash = again.into_inner();
    }
    flash
}
