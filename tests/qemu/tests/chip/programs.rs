//! The programs over third-party drivers: their input, and what they must report.

use std::path::Path;

use anyhow::{Result, bail, ensure};
use qemu::chip::{Driver, Run, report};
use qemu::drive::hex;
use serde_json::{Value, json};

/// What a program exercises; the numbers are those of `Subject` in `tests/chip`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    Clock,
    Line,
    Spi,
    Flash,
    Watchdog,
    Window,
    Calendar,
    Supply,
}
use Subject::{Calendar, Clock, Flash, Line, Spi, Supply, Watchdog, Window};

/// All subjects.
pub const SUBJECTS: [Subject; 8] = [Clock, Line, Spi, Flash, Watchdog, Window, Calendar, Supply];

/// Crystal in MHz, and Hz of the core, of the slow and of the fast bus.
const CLOCKS: [(u32, [u32; 3]); 6] = [
    (0, [16_000_000; 3]), // internal oscillator
    (0, [168_000_000, 42_000_000, 84_000_000]),
    (12, [168_000_000, 42_000_000, 84_000_000]),
    (8, [48_000_000, 12_000_000, 48_000_000]),
    (16, [4_000_000; 3]), // without PLL, divided by 4
    (25, [30_000_000; 3]),
];

/// Sizes of the bursts on the line, bytes; 200 us of silence after each.
const BURSTS: [usize; 7] = [28, 28, 100, 7, 64, 1, 72];
const BYTE_US: f64 = 10e6 / 921_600.0;

/// 300 pseudo-random bytes.
fn bytes() -> Vec<u8> {
    let next = |state: &mut u32| {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Some((*state >> 24) as u8)
    };
    let mut state = 1;
    std::iter::from_fn(|| next(&mut state)).take(300).collect()
}

/// The runs of a subject, as the model reads them (JSON).
pub fn asked(image: &Path, subject: Subject) -> Vec<Value> {
    let one = |ms: u32| json!({"image": image, "subject": subject as u32, "ms": ms});
    let with = |ms, key: &str, value: Value| {
        let mut run = one(ms);
        run[key] = value;
        run
    };
    match subject {
        Clock => (0..CLOCKS.len())
            .map(|n| {
                let mut run = with(20, "variant", json!(n));
                run["chip"] = json!({"crystal": CLOCKS[n].0});
                run
            })
            .collect(),
        Line => {
            let (mut at, mut all, bytes) = (500.0, Vec::new(), bytes());
            let mut rest = &bytes[..];
            for size in BURSTS {
                let (burst, behind) = rest.split_at(size);
                all.push(json!([at, hex(burst)]));
                (at, rest) = (at + size as f64 * BYTE_US + 200.0, behind);
            }
            vec![with(20, "line", all.into())]
        }
        Spi => vec![with(
            10,
            "adis",
            json!({"product": 16507, "range": 3, "hz": 1_000_000}),
        )],
        Flash => vec![one(4000)],
        Watchdog => vec![one(60)],
        Window => vec![one(60), with(60, "variant", json!(1))],
        Calendar => vec![one(8000)],
        Supply => vec![with(60, "volts", json!([[15, 2.8]]))],
    }
}

/// Whether the driver has a program for the subject.
pub fn has(driver: Driver, subject: Subject) -> bool {
    (driver, subject) != (Driver::Hal, Window)
}

/// Checks what a driver's program reports.
pub fn check(driver: Driver, subject: Subject, runs: &[Run]) -> Result<()> {
    for run in runs {
        if let Some(wrong) = &run.wrong {
            bail!("{wrong}");
        }
        ensure!(run.words(report::DONE) == [1], "no end: {:?}", run.reports);
    }
    let run = &runs[0];
    match subject {
        Clock => check_clocks(runs),
        Line => check_line(driver, run),
        Spi => check_spi(run),
        Flash => check_flash(driver, run),
        Watchdog => check_watchdog(run, 10.0),
        Window => check_windows(runs),
        Calendar => check_calendar(driver, run),
        Supply => check_supply(run),
    }
}

/// The driver reports the clocks of the model, and a thousandth of a second's core cycles takes 1
/// ms.
fn check_clocks(runs: &[Run]) -> Result<()> {
    ensure!(runs.len() == CLOCKS.len());
    for (run, (_, hz)) in runs.iter().zip(CLOCKS) {
        let says: Vec<u32> = report::CLOCKS.iter().flat_map(|n| run.words(*n)).collect();
        ensure!(says == hz && run.clocks == hz, "{says:?} {:?}", run.clocks);
        let marks = run.times(report::MARK);
        ensure!((marks[1] - marks[0] - 1000.0).abs() < 60.0, "{marks:?}");
    }
    Ok(())
}

/// 84 MHz by 91 is nearest to 921 600 bit/s. Every byte comes back, each pause is found once, and
/// the end is known when the last stop bit has left, not before.
fn check_line(driver: Driver, run: &Run) -> Result<()> {
    ensure!(run.line == [91, 10], "{:?}", run.line);
    let expected = hex(&bytes()) + "5a";
    ensure!(run.sent == expected, "{}", run.sent);
    ensure!(run.words(report::ERROR) == [0]);
    let mut reads = run.words(report::READ);
    // the last pause comes after the last byte
    let ends: Vec<u32> = BURSTS[..6]
        .iter()
        .scan(0, |sum, size| {
            *sum += *size as u32;
            Some(*sum)
        })
        .collect();
    match driver {
        Driver::Hal => ensure!(run.words(report::IDLE) == [6]),
        // the ring of 128 also reports its half and its end
        Driver::Embassy => {
            ensure!(
                [64, 128, 192, 256].iter().all(|n| reads.contains(n)),
                "{reads:?}"
            );
            reads.retain(|n| ends.contains(n));
        }
    }
    ensure!(reads == ends, "{reads:?}");
    let flushed = run.times(report::MARK)[2];
    ensure!(
        flushed >= run.last_us && flushed < run.last_us + 5.0,
        "{flushed}"
    );
    Ok(())
}

/// The ADIS answers with the next word, so the first is not its number.
fn check_spi(run: &Run) -> Result<()> {
    let words = run.words(report::WORD);
    ensure!(words == [0, 16507, 16507], "{words:?}");
    ensure!(run.words(report::ERROR) == [0; 3]);
    Ok(())
}

/// Erasing a sector of 128 kB with byte parallelism, as both drivers do, takes two seconds. A write
/// without the flag PG is refused; `stm32f4xx-hal` reports it, `embassy-stm32` clears the flag
/// before.
fn check_flash(driver: Driver, run: &Run) -> Result<()> {
    let pattern = b"a driver that is trusted".chunks(4);
    let pattern = pattern.map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")));
    let words = [1 << 20].into_iter().chain([u32::MAX; 6]).chain(pattern);
    let words: Vec<u32> = words.chain([u32::MAX]).collect();
    ensure!(
        run.words(report::WORD) == words,
        "{:x?}",
        run.words(report::WORD)
    );
    let refused = u32::from(driver == Driver::Hal);
    ensure!(run.words(report::ERROR) == [0, 0, refused, 0]);
    let marks = run.times(report::MARK);
    ensure!((marks[1] - marks[0] - 2e6).abs() < 1000.0, "{marks:?}");
    // 24 bytes in as many pieces, or in six
    let pieces = if driver == Driver::Hal { 24.0 } else { 6.0 };
    let took = marks[2] - marks[1];
    ensure!(
        took > 16.0 * pieces && took < 16.0 * pieces + 100.0,
        "{took}"
    );
    Ok(())
}

/// The watchdog resets the chip this long after it was last fed, ms, and the next start reports the
/// cause.
fn check_watchdog(run: &Run, after_ms: f64) -> Result<()> {
    let causes = run.words(report::CAUSE);
    ensure!(causes == [0x0E00_0000, 0x2400_0000], "{causes:x?}");
    let fed = run.times(report::MARK);
    ensure!(fed.len() == 2 && run.starts.len() == 2, "{fed:?}");
    let took = run.starts[1] - fed[1] / 1000.0;
    ensure!((took - after_ms).abs() < 0.1, "{took} ms");
    Ok(())
}

/// One program feeds it in the open half of 12 ms, and again 2 ms later, too early; the other never
/// does.
fn check_windows(runs: &[Run]) -> Result<()> {
    for (run, (marks, from_ms, to_ms)) in runs.iter().zip([(2, 1.9, 2.1), (1, 11.9, 12.3)]) {
        let causes = run.words(report::CAUSE);
        ensure!(causes == [0x0E00_0000, 0x4400_0000], "{causes:x?}");
        let at = run.times(report::MARK);
        ensure!(at.len() == marks && run.starts.len() == 2, "{at:?}");
        let took = run.starts[1] - at[marks - 1] / 1000.0;
        ensure!(took > from_ms && took < to_ms, "{took} ms");
    }
    Ok(())
}

/// Over the end of a year. After a reset of the chip the calendar goes on, and a backup word is
/// retained. `stm32f4xx-hal` counts years from 1970 and its program does not reset.
fn check_calendar(driver: Driver, run: &Run) -> Result<()> {
    ensure!(run.words(report::ERROR) == [0]);
    let (seconds, dates) = (run.words(report::SECONDS), run.words(report::DATE));
    let times = run.times(report::MARK);
    ensure!(times.len() == seconds.len() && times.len() == dates.len());
    // four cycles of 32 kHz to start, and a fraction that is not reported
    for ((second, date), time) in seconds.iter().zip(&dates).zip(&times) {
        let passed = (time - times[0]) / 1e6 - 0.0003;
        let expected = (86_398.0 + passed) % 86_400.0;
        let behind = (expected - f64::from(*second)).rem_euclid(86_400.0);
        // a second that has begun is reported in full; it may be slightly ahead
        let right = !(1.02..=86_399.9).contains(&behind);
        ensure!(right, "{second} {expected}");
        let next = *second < 1000;
        ensure!(
            *date == if next { 20_240_101 } else { 20_231_231 },
            "{date}"
        );
    }
    ensure!(seconds.iter().any(|second| *second < 1000), "{seconds:?}");
    if driver == Driver::Embassy {
        ensure!(run.starts.len() == 2 && times.len() == 6, "{times:?}");
        ensure!(run.words(report::WORD) == [0x1234_5678; 2]);
    }
    Ok(())
}

/// Neither crate has a driver: the program is ours, with the addresses of their register crates.
fn check_supply(run: &Run) -> Result<()> {
    ensure!(run.words(report::WORD) == [0, 0, 1]);
    ensure!(run.words(report::INTERRUPTS) == [0, 0, 1]);
    Ok(())
}
