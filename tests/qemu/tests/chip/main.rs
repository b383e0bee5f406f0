//! The chip model, checked with drivers that are proven on real chips: programs over unmodified
//! `stm32f4xx-hal` and `embassy-stm32` run in it and must work. Then the model is broken on
//! purpose, one thing at a time. The table here says which drivers notice: theirs, and those of our
//! board. The results are in docs/BOARDS.md.

mod ours;
mod programs;

use std::path::{Path, PathBuf};

use ours::{BoardFunction, check_ours};
use programs::Subject::{self, Calendar, Clock, Flash, Line, Spi, Supply, Watchdog, Window};
use programs::{SUBJECTS, asked, check, has};
use qemu::chip::{Driver, run};
use qemu::images::{STM32F405, missing};
use qemu::judges::python;

/// Python, the programs of both drivers, and our image; `None` on a machine without them.
fn tools() -> Option<(PathBuf, [PathBuf; 2], PathBuf)> {
    let (python, ours) = (python()?, STM32F405.build_or_skip()?);
    assert_eq!(missing(), None);
    let built = Driver::ALL.map(|driver| driver.build().expect("it builds"));
    Some((python, built, ours))
}

/// Subjects whose programs fail, by driver, with the reason.
fn failures(
    python: &Path,
    images: &[PathBuf; 2],
    broken: Option<&str>,
    subjects: &[Subject],
) -> Vec<(Driver, Subject, String)> {
    let mut runs = Vec::new();
    let mut parts = Vec::new();
    for (driver, image) in Driver::ALL.into_iter().zip(images) {
        for &subject in subjects.iter().filter(|subject| has(driver, **subject)) {
            let asked = asked(image, subject);
            parts.push((driver, subject, asked.len()));
            runs.extend(asked);
        }
    }
    let done = run(python, broken, &runs).expect("the model runs");
    assert_eq!(done.len(), runs.len());
    let mut rest = &done[..];
    let mut failed = Vec::new();
    for (driver, subject, count) in parts {
        let (these, behind) = rest.split_at(count);
        rest = behind;
        if let Err(why) = check(driver, subject, these) {
            failed.push((driver, subject, why.to_string()));
        }
    }
    failed
}

#[test]
fn drivers_that_are_known_to_work_do_in_the_model() {
    let Some((python, images, image)) = tools() else {
        return;
    };
    let failed = failures(&python, &images, None, &SUBJECTS);
    assert!(failed.is_empty(), "{failed:#?}");
    for part in BoardFunction::ALL {
        let ours = check_ours((&python, &image), None, part);
        assert!(ours.is_ok(), "ours, {part:?}: {ours:?}");
    }
}

const THEIRS: [bool; 2] = [true, true];

/// Name of a broken model; subjects that exercise the broken part; whether `stm32f4xx-hal` and
/// `embassy-stm32` notice; the part of our image that uses it, and whether that part notices.
type Mutant = (
    &'static str,
    &'static [Subject],
    [bool; 2],
    Option<(BoardFunction, bool)>,
);

const MUTANTS: [Mutant; 14] = [
    (
        "dma-count",
        &[Line],
        THEIRS,
        Some((BoardFunction::Stream, true)),
    ),
    // our streams run once and are restarted
    (
        "dma-no-wrap",
        &[Line],
        THEIRS,
        Some((BoardFunction::Stream, false)),
    ),
    (
        "uart-no-fraction",
        &[Line],
        THEIRS,
        Some((BoardFunction::Stream, true)),
    ),
    // the stream's own length ends a frame, not the pause after it
    (
        "uart-no-idle",
        &[Line],
        THEIRS,
        Some((BoardFunction::Stream, false)),
    ),
    // we never wait for the last stop bit
    (
        "uart-complete-early",
        &[Line],
        THEIRS,
        Some((BoardFunction::Stream, false)),
    ),
    (
        "clock-pll",
        &[Clock],
        THEIRS,
        Some((BoardFunction::Stream, true)),
    ),
    // their programs use no bus timer
    (
        "clock-timers",
        &[Clock],
        [false; 2],
        Some((BoardFunction::Stream, true)),
    ),
    (
        "flash-no-erase",
        &[Flash],
        THEIRS,
        Some((BoardFunction::Store, true)),
    ),
    // it is our second watchdog, and the first one resets earlier
    (
        "watchdog-fast",
        &[Watchdog],
        THEIRS,
        Some((BoardFunction::Stream, false)),
    ),
    (
        "watchdog-window",
        &[Window],
        [false, true],
        Some((BoardFunction::Window, true)),
    ),
    ("calendar-slow", &[Calendar], THEIRS, None),
    (
        "spi-late",
        &[Spi],
        THEIRS,
        Some((BoardFunction::Adis, true)),
    ),
    // the program of the HAL polls
    (
        "spi-dma-leaves",
        &[Spi],
        [false, true],
        Some((BoardFunction::Adis, true)),
    ),
    (
        "supply-good",
        &[Supply],
        THEIRS,
        Some((BoardFunction::Supply, true)),
    ),
];

#[test]
fn broken_models_are_noticed() {
    let Some((python, images, image)) = tools() else {
        return;
    };
    let tools = (python.as_path(), image.as_path());
    for (name, subjects, theirs, part) in MUTANTS {
        let failed = failures(&python, &images, Some(name), subjects);
        println!("{name}: {failed:?}");
        let notices = Driver::ALL.map(|driver| failed.iter().any(|(of, ..)| *of == driver));
        assert_eq!(notices, theirs, "{name}");
        let Some((part, expected)) = part else {
            continue;
        };
        let ours = check_ours(tools, Some(name), part);
        println!("{name}, ours: {ours:?}");
        assert_eq!(ours.is_err(), expected, "{name}: {ours:?}");
        assert!(theirs != [false; 2] || expected, "{name}: nobody notices");
    }
}
