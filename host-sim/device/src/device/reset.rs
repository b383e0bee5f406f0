//! Start of a device's board: causes of the reset, clock, warnings and the last crash, in words.

use super::link::Link;
use firmware::control::Reason;
use firmware::wire::command::{
    ClockSource, Crash, CrashKind, LoopPhase, Request, Reset, Response, cause, unwell,
};
use host_core::error::Error;
use serde::Serialize;

/// A board's report of its start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Start {
    /// What caused the last reset.
    pub causes: Vec<&'static str>,
    /// Time since then, s.
    pub uptime_s: f64,
    /// Source and accuracy of the clock.
    pub clock: String,
    /// What is wrong, each with its remedy.
    pub warnings: Vec<String>,
    /// The last crash since power-on.
    pub crash: Option<String>,
    /// The answer itself.
    #[serde(flatten)]
    pub answer: Reset,
}

/// Asks for the board's start; `None` if the device does not report it.
///
/// # Errors
/// As [`Link::ask`].
pub fn start(link: &mut Link) -> Result<Option<Start>, Error> {
    let request = Request::GetReset;
    let answer = link.request(&request, |answer| match answer {
        Response::Reset(reset) => Some(*reset),
        _ => None,
    })?;
    match answer {
        Err(Reason::NotAvailable) => Ok(None),
        other => other
            .map(|reset| Some(Start::of(&reset)))
            .map_err(|reason| link.refused(&request, reason)),
    }
}

/// Accuracy of the internal oscillator (DS8626, table 41).
const INTERNAL: &str =
    "internal oscillator: within 1 % at 25 degC, 4 % at -10 to 85, -8 to +4.5 % at -40 to 105";

impl Start {
    fn of(reset: &Reset) -> Self {
        Self {
            causes: causes(reset.causes),
            uptime_s: f64::from(reset.uptime_ms) / 1000.0,
            clock: clock(reset),
            warnings: warnings(reset),
            crash: reset.crash.as_ref().map(crash),
            answer: *reset,
        }
    }
}

/// Names of the causes of a reset. Every reset pulls the pin, and every power-on reports a
/// brown-out, so these two count only without another cause.
fn causes(bits: u8) -> Vec<&'static str> {
    let names = [
        (cause::POWER_ON, "power-on"),
        (cause::SOFTWARE, "software"),
        (cause::WATCHDOG, "watchdog"),
        (cause::WINDOW, "window watchdog"),
        (cause::LOW_POWER, "low-power mode"),
    ];
    let mut causes: Vec<_> = names
        .into_iter()
        .filter_map(|(bit, name)| (bits & bit != 0).then_some(name))
        .collect();
    if causes.is_empty() && bits & cause::BROWN_OUT != 0 {
        causes.push("brown-out");
    }
    if causes.is_empty() && bits & cause::PIN != 0 {
        causes.push("reset pin");
    }
    if causes.is_empty() {
        causes.push("not known");
    }
    causes
}

fn clock(reset: &Reset) -> String {
    let mhz = f64::from(reset.core_hz) / 1e6;
    match reset.clock {
        ClockSource::Crystal => {
            format!("{mhz} MHz from a crystal of {} MHz", reset.crystal.used_mhz)
        }
        ClockSource::Internal => format!("{mhz} MHz from the {INTERNAL}"),
        ClockSource::InternalDirect => format!("{mhz} MHz, without PLL, from the {INTERNAL}"),
        ClockSource::Simulator => format!("{mhz} MHz of a simulator"),
    }
}

/// Nominal bit rate of the command link, bit/s.
const COMMAND_BAUD: u32 = firmware::app::COMMAND_BAUD;

fn warnings(reset: &Reset) -> Vec<String> {
    let mut warnings = Vec::new();
    let crystal = &reset.crystal;
    let board = reset.clock != ClockSource::Simulator;
    if board && crystal.used_mhz != crystal.built_mhz {
        let what = match (crystal.used_mhz, crystal.measured_khz) {
            (0, 0) => "it does not run".to_owned(),
            (0, khz) => format!("{khz} kHz are measured, which fits no crystal"),
            (used, khz) => format!("{khz} kHz are measured, and {used} MHz are used"),
        };
        warnings.push(format!(
            "the firmware was built for a crystal of {} MHz, but {what}; remedy: build with \
             LRNN_CRYSTAL_MHZ, or repair the crystal",
            crystal.built_mhz
        ));
    }
    let error = f64::from(reset.command_baud) / f64::from(COMMAND_BAUD) - 1.0;
    if board && error.abs() > 0.02 {
        warnings.push(format!(
            "the command link has {} bit/s in place of {COMMAND_BAUD}, {:+.1} % and the \
             oscillator's error off",
            reset.command_baud,
            error * 100.0
        ));
    }
    if let Some(level) = reset.brown_out.filter(|level| *level < 3) {
        warnings.push(format!(
            "the option bytes have brown-out level {level}; remedy: set level 3 (2.7 V), as \
             docs/firmware.md says"
        ));
    }
    if reset.supply_low {
        warnings.push("the supply is too low for writing flash: nothing is stored".to_owned());
    }
    if reset.reopened > 0 {
        warnings.push(format!(
            "the navigation line did not send and was reopened, {}",
            match reset.reopened {
                1 => "once".to_owned(),
                n => format!("{n} times"),
            }
        ));
    }
    if reset.safe {
        warnings.push(
            "safe start: after repeated resets the device stays in bypass without the stored \
             weights; remedy: find the cause, then switch it off and on"
                .to_owned(),
        );
    }
    warnings
}

fn crash(crash: &Crash) -> String {
    let kind = match crash.kind {
        CrashKind::Fault => "fault of the core".to_owned(),
        CrashKind::StackOverflow => "stack overflow".to_owned(),
        CrashKind::ClockStopped => "the crystal stopped".to_owned(),
        CrashKind::Panic => "panic".to_owned(),
        CrashKind::NotFed => format!("watchdog: {}", not_fed(crash.unwell)),
    };
    let phase = match crash.phase {
        LoopPhase::Starting => "starting",
        LoopPhase::Burst => "reading an ADIS",
        LoopPhase::Poll => "in the application",
        LoopPhase::Open => "opening lines",
        LoopPhase::Store => "storing",
        LoopPhase::Look => "looking for an ADIS",
        LoopPhase::Sleep => "asleep",
        LoopPhase::Learn => "learning",
    };
    let mut text = format!(
        "number {}, starts ago: {}, {:.1} s after the start before, {phase}: {kind}",
        crash.number,
        crash.starts,
        f64::from(crash.uptime_ms) / 1000.0
    );
    if crash.pc != 0 {
        text += &format!("; pc {:#010x}, lr {:#010x}", crash.pc, crash.lr);
    }
    if matches!(crash.kind, CrashKind::Fault | CrashKind::StackOverflow) {
        text += &format!("; CFSR {:#010x}, HFSR {:#010x}", crash.cfsr, crash.hfsr);
        if crash.cfsr & 1 << 7 != 0 {
            text += &format!(", address {:#010x}", crash.mmfar);
        }
        if crash.cfsr & 1 << 15 != 0 {
            text += &format!(", address {:#010x}", crash.bfar);
        }
    }
    text
}

fn not_fed(bits: u8) -> String {
    let names = [
        (unwell::WORDS, "words do not flow"),
        (unwell::LINKS, "the links are not served"),
        (unwell::LEARNER, "the learner does not end its work"),
        (unwell::OUTPUT, "the navigation line does not send"),
    ];
    let unhealthy: Vec<_> = names
        .into_iter()
        .filter_map(|(bit, name)| (bits & bit != 0).then_some(name))
        .collect();
    match unhealthy.as_slice() {
        [] => "the main loop does not turn".to_owned(),
        unhealthy => unhealthy.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::wire::command::Crystal;

    const GOOD: Reset = Reset {
        causes: cause::POWER_ON | cause::BROWN_OUT | cause::PIN,
        uptime_ms: 1500,
        safe: false,
        clock: ClockSource::Crystal,
        core_hz: 168_000_000,
        crystal: Crystal {
            built_mhz: 12,
            used_mhz: 12,
            measured_khz: 12_010,
        },
        command_baud: 913_043,
        brown_out: Some(3),
        supply_low: false,
        reopened: 0,
        crash: None,
    };

    #[test]
    fn a_good_start_has_no_warning() {
        let start = Start::of(&GOOD);
        assert_eq!(start.causes, ["power-on"]);
        assert_eq!(start.clock, "168 MHz from a crystal of 12 MHz");
        assert!(
            start.warnings.is_empty() && start.crash.is_none(),
            "{start:?}"
        );
        for (bits, name) in [
            (cause::PIN, "reset pin"),
            (cause::BROWN_OUT | cause::PIN, "brown-out"),
            (cause::WINDOW | cause::PIN, "window watchdog"),
            (0, "not known"),
        ] {
            assert_eq!(causes(bits), [name]);
        }
    }

    #[test]
    fn everything_that_is_wrong_is_said_with_its_remedy() {
        let bad = Start::of(&Reset {
            safe: true,
            clock: ClockSource::InternalDirect,
            core_hz: 16_000_000,
            crystal: Crystal {
                built_mhz: 12,
                used_mhz: 0,
                measured_khz: 13_500,
            },
            command_baud: 941_176,
            brown_out: Some(0),
            supply_low: true,
            reopened: 2,
            ..GOOD
        });
        let words = [
            "13500 kHz",
            "+2.1 %",
            "level 0",
            "too low",
            "2 times",
            "safe start",
        ];
        assert_eq!(bad.warnings.len(), words.len(), "{:?}", bad.warnings);
        for (warning, word) in bad.warnings.iter().zip(words) {
            assert!(warning.contains(word), "{warning} | {word}");
        }
        assert!(bad.clock.contains("-8 to +4.5 %"), "{}", bad.clock);
    }

    #[test]
    fn a_crash_is_described_in_words() {
        let text = crash(&Crash {
            kind: CrashKind::NotFed,
            phase: LoopPhase::Poll,
            unwell: unwell::LINKS | unwell::OUTPUT,
            pc: 0x0800_1234,
            lr: 0x0800_4321,
            xpsr: 0,
            cfsr: 0x8200,
            hfsr: 1 << 30,
            mmfar: 0,
            bfar: 0x6000_0000,
            uptime_ms: 2500,
            number: 3,
            starts: 1,
        });
        assert_eq!(
            text,
            "number 3, starts ago: 1, 2.5 s after the start before, in the application: \
             watchdog: the links are not served, the navigation line does not send; \
             pc 0x08001234, lr 0x08004321"
        );
    }
}
