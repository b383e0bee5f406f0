//! The start of a board with its store: when it may erase, and flash that faults when it is read.

use crate::device::Device;
use crate::frames::Kind;
use crate::record::{HARDWARE, configured, unconfigured};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use firmware::app::guard::retained::{Retained, WORDS};
use firmware::app::{App, Hardware};
use firmware::configuration::record::encode;
use firmware::model::Nets;
use firmware::store::{Content, Store};
use firmware::wire::command::{
    ClockSource, Crash, CrashKind, Crystal, LoopPhase, Reset, cause, fault,
};
use std::panic::{AssertUnwindSafe, catch_unwind};

const SLOT: usize = 2 * 8192;
/// The word of an STM32H7's flash, which has check bits of its own (RM0433 4.3.9).
const WORD: usize = 32;

/// Reaction of the chip to reading a word whose check bits do not fit.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Torn {
    /// A bus fault, and so a crash.
    Faults,
    /// The driver notices.
    Fails,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Failure {
    PowerCut,
    Unreadable,
    Misuse,
}

impl NorFlashError for Failure {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// A word of flash.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Word {
    Erased,
    Written([u8; WORD]),
    Torn,
}

/// Flash with check bits. `left`: so many words may be erased or written before power fails; the
/// word at which it fails is torn.
#[derive(Debug, Clone)]
struct Flash {
    words: Vec<Word>,
    torn: Torn,
    left: usize,
    erasures: usize,
}

impl Flash {
    fn new(torn: Torn) -> Flash {
        Flash {
            words: vec![Word::Erased; 2 * SLOT / WORD],
            torn,
            left: usize::MAX,
            erasures: 0,
        }
    }

    fn change(&mut self, at: usize, to: Word) -> Result<(), Failure> {
        if self.left == 0 {
            return Err(Failure::PowerCut);
        }
        self.left -= 1;
        self.words[at] = if self.left == 0 { Word::Torn } else { to };
        if self.left == 0 {
            return Err(Failure::PowerCut);
        }
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Failure;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failure> {
        for (at, byte) in (offset as usize..).zip(bytes) {
            *byte = match self.words[at / WORD] {
                Word::Erased => 0xFF,
                Word::Written(word) => word[at % WORD],
                Word::Torn if self.torn == Torn::Fails => return Err(Failure::Unreadable),
                Word::Torn => panic!("bus fault"),
            };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SLOT
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SLOT;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Failure> {
        self.erasures += 1;
        (from as usize / WORD..to as usize / WORD).try_for_each(|at| self.change(at, Word::Erased))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failure> {
        let (words, rest) = bytes.as_chunks::<WORD>();
        for (at, word) in (offset as usize / WORD..).zip(words) {
            if self.words[at] != Word::Erased || !rest.is_empty() {
                return Err(Failure::Misuse);
            }
            self.change(at, Word::Written(*word))?;
        }
        Ok(())
    }
}

const START: Reset = Reset {
    causes: cause::POWER_ON,
    uptime_ms: 0,
    safe: false,
    clock: ClockSource::Crystal,
    core_hz: 400_000_000,
    crystal: Crystal {
        built_mhz: 8,
        used_mhz: 8,
        measured_khz: 8_000,
    },
    command_baud: 921_600,
    brown_out: None,
    supply_low: false,
    reopened: 0,
    crash: None,
};

const CRASH: Crash = Crash {
    kind: CrashKind::Fault,
    phase: LoopPhase::Starting,
    unwell: 0,
    pc: 0,
    lr: 0,
    xpsr: 0,
    cfsr: 0,
    hfsr: 0,
    mmfar: 0,
    bfar: 0,
    uptime_ms: 0,
    number: 0,
    starts: 0,
};

/// A record whose configuration has this name.
fn save(store: &mut Store<Flash>, name: &str) -> bool {
    let mut unit = configured(Kind::STIM);
    unit.identity.name = name.try_into().expect("short");
    let record = encode(&unit);
    store.save(&Content::new(&Nets::NONE, &record)).is_ok()
}

/// Starts the board until a start succeeds: the device, with the faults it reports, and the number
/// of starts. A crash is stored as a board stores it, and the chip restarts.
fn started(flash: &Flash, most: u32) -> Option<(Device, u32)> {
    let (mut words, mut causes) = ([0; WORDS], cause::POWER_ON);
    for number in 1..=most {
        let (retained, safe) = Retained::started(&words, causes);
        let reset = Reset {
            causes,
            safe,
            crash: retained.crash,
            ..START
        };
        let hardware = Hardware {
            reset: Some(reset),
            ..HARDWARE
        };
        let mut store = Store::new(flash.clone()).ok();
        let start = || App::start_up(hardware, &mut store, causes == cause::POWER_ON, None);
        if let Ok(app) = catch_unwind(AssertUnwindSafe(start)) {
            let mut device = unconfigured();
            device.app = app;
            return Some((device, number));
        }
        (words, causes) = (retained.crashed(CRASH).words(), cause::SOFTWARE);
    }
    None
}

/// Power fails at any word of an erasure and of a record. Where the driver notices a torn word, the
/// first start has the old record or the new one. Where the chip faults, no later than the fourth
/// start gets through.
#[test]
fn a_torn_word_makes_no_boot_loop() {
    std::panic::set_hook(Box::new(|_| {})); // some thousand bus faults
    for torn in [Torn::Fails, Torn::Faults] {
        let mut store = Store::new(Flash::new(torn)).expect("room");
        assert!(save(&mut store, "one") && save(&mut store, "two"));
        let flash = store.into_inner();
        let mut faulted = 0;
        for left in (1..).step_by(7) {
            let mut cut = flash.clone();
            cut.left = left;
            let mut store = Store::new(cut).expect("room");
            if save(&mut store, "three") {
                break;
            }
            let cut = store.into_inner();
            assert!(cut.words.contains(&Word::Torn));
            let (mut device, starts) = started(&cut, 9).expect("a start that gets through");
            match torn {
                Torn::Fails => {
                    assert_eq!(starts, 1, "{left}");
                    let stored = crate::record::read(&mut device);
                    let names = ["two", "three"].map(str::as_bytes);
                    let has = |name: &&[u8]| stored.windows(name.len()).any(|at| at == *name);
                    assert!(names.iter().any(has), "{left}");
                }
                Torn::Faults if starts > 1 => {
                    faulted += 1;
                    assert_eq!(starts, 4, "{left}");
                    assert_ne!(device.app.faults() & fault::SAFE_START, 0);
                }
                Torn::Faults => {}
            }
        }
        assert_eq!(faulted > 0, torn == Torn::Faults);
    }
    let _ = std::panic::take_hook();
}

/// A full slot is erased when the board is switched on, and at no other start.
#[test]
fn room_is_made_when_the_board_is_switched_on_only() {
    let mut store = Store::new(Flash::new(Torn::Fails)).expect("room");
    assert!(save(&mut store, "one"));
    let record = encode(&configured(Kind::STIM));
    let content = Content::new(&Nets::NONE, &record);
    while store.begin(&content).is_ok() {
        while store.go_on(&content).expect("written") == firmware::store::Progress::GoesOn {}
    }
    let full = store.into_inner();
    let start = |at_ease: bool, safe: bool| {
        let mut store = Store::new(full.clone()).ok();
        let reset = Reset { safe, ..START };
        let hardware = Hardware {
            reset: Some(reset),
            ..HARDWARE
        };
        let _ = App::start_up(hardware, &mut store, at_ease, None);
        store.expect("a store").into_inner().erasures - full.erasures
    };
    assert_eq!(start(true, false), 1);
    for (at_ease, safe) in [(false, false), (false, true), (true, true)] {
        assert_eq!(start(at_ease, safe), 0, "{at_ease} {safe}");
    }
}

/// The next record counts the starts, and those that followed a failure.
#[test]
fn starts_are_counted() {
    let mut store = Store::new(Flash::new(Torn::Fails)).expect("room");
    assert!(save(&mut store, "one"));
    let mut flash = store.into_inner();
    let crash = |starts| Some(Crash { starts, ..CRASH });
    let each = [
        (cause::POWER_ON, None, 0),
        (cause::WATCHDOG, None, 1),
        (cause::WINDOW, None, 1),
        (cause::SOFTWARE, crash(1), 1),
        (cause::PIN, crash(2), 0),
    ];
    let (mut starts, mut failures) = (0, 0);
    for (causes, crash, failed) in each {
        let reset = Reset {
            causes,
            crash,
            ..START
        };
        let hardware = Hardware {
            reset: Some(reset),
            ..HARDWARE
        };
        let mut store = Store::new(flash).ok();
        let _ = App::start_up(hardware, &mut store, false, None);
        let mut store = store.expect("a store");
        assert!(save(&mut store, "next"));
        let life = store.load().expect("ours").expect("a record").life;
        (starts, failures) = (starts + 1, failures + failed);
        assert_eq!((life.starts, life.failures), (starts, failures));
        flash = store.into_inner();
    }
}
