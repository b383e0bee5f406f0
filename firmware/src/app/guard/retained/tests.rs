use super::*;

const CRASH: Crash = Crash {
    kind: CrashKind::NotFed,
    phase: LoopPhase::Look,
    unwell: 0b1010,
    pc: 0x0800_1234,
    lr: 0x0800_4321,
    xpsr: 0x6100_0000,
    cfsr: 0x8200,
    hfsr: 0x4000_0000,
    mmfar: 1,
    bfar: 0xE000_0000,
    uptime_ms: 77,
    number: 1,
    starts: 0,
};

#[test]
fn it_comes_back_as_it_was() {
    for kind in KINDS {
        for phase in PHASES {
            let retained = Retained {
                early: 2,
                crash: Some(Crash {
                    kind,
                    phase,
                    ..CRASH
                }),
            };
            assert_eq!(Retained::from_words(&retained.words()), Some(retained));
        }
    }
    let none = Retained {
        early: 9,
        crash: None,
    };
    assert_eq!(Retained::from_words(&none.words()), Some(none));
}

#[test]
fn no_flipped_bit_and_no_random_ram_passes() {
    let words = Retained {
        early: 2,
        crash: Some(CRASH),
    }
    .words();
    for bit in 0..32 * WORDS {
        let mut damaged = words;
        damaged[bit / 32] ^= 1 << (bit % 32);
        // one word is spare: nothing is in it
        let spare = bit / 32 == WORDS - 2;
        assert_eq!(Retained::from_words(&damaged).is_some(), spare, "bit {bit}");
    }
    for fill in [0, u32::MAX, 0xcccc_cccc, MAGIC] {
        assert_eq!(Retained::from_words(&[fill; WORDS]), None);
    }
}

/// Runs one start after the other, each cut short, for this reason.
fn starts(causes: u8, count: usize) -> std::vec::Vec<bool> {
    let mut words = [0xA5A5_5A5A; WORDS]; // as after power-on
    let mut safe = std::vec::Vec::new();
    for _ in 0..count {
        let (retained, is_safe) = Retained::started(&words, causes);
        safe.push(is_safe);
        words = retained.crashed(CRASH).words();
    }
    safe
}

#[test]
fn three_runs_cut_short_make_a_safe_start() {
    let safe = [false, false, false, true, true];
    for by_itself in [cause::SOFTWARE, cause::WATCHDOG, cause::WINDOW] {
        assert_eq!(starts(by_itself | cause::PIN, 5), safe);
    }
    assert_eq!(
        starts(cause::PIN, 5),
        [false; 5],
        "somebody presses the button"
    );
    assert_eq!(
        starts(cause::POWER_ON | cause::BROWN_OUT | cause::PIN, 5),
        [false; 5]
    );
    assert_eq!(starts(cause::BROWN_OUT | cause::WATCHDOG, 5), [false; 5]);
}

#[test]
fn a_run_that_lasts_clears_the_count_and_the_crash_stays() {
    let mut retained = Retained {
        early: 3,
        crash: Some(CRASH),
    };
    retained.early = 0;
    let (retained, safe) = Retained::started(&retained.words(), cause::WATCHDOG);
    assert!(!safe);
    let crash = retained.crash.expect("the record");
    assert_eq!((retained.early, crash.number, crash.starts), (1, 1, 1));
    let (retained, _) = Retained::started(&retained.words(), cause::POWER_ON);
    assert_eq!(retained.crash.expect("the record").starts, 2);
    let again = retained.crashed(CRASH).crash.expect("the record");
    assert_eq!((again.number, again.starts), (2, 0));
}
