//! State that survives a reset in RAM that nothing initialises at start: how often the board has
//! started early, and the record of the last crash. A magic number and a CRC distinguish it from
//! the content of RAM after power-on.

use crate::wire::checksum::crc32_zlib;
use crate::wire::command::{Crash, CrashKind, LoopPhase, cause};

/// Words of RAM that it takes.
pub const WORDS: usize = 16;
const MAGIC: u32 = u32::from_le_bytes(*b"KEPT");
/// A run that ends earlier counts as cut short, microseconds.
pub const EARLY_US: u64 = 10_000_000;
/// Number of runs cut short in a row after which the next start is a safe one.
pub const SAFE_AFTER: u32 = 3;

const KINDS: [CrashKind; 5] = [
    CrashKind::Fault,
    CrashKind::StackOverflow,
    CrashKind::ClockStopped,
    CrashKind::Panic,
    CrashKind::NotFed,
];
const PHASES: [LoopPhase; 8] = [
    LoopPhase::Starting,
    LoopPhase::Burst,
    LoopPhase::Poll,
    LoopPhase::Open,
    LoopPhase::Store,
    LoopPhase::Look,
    LoopPhase::Sleep,
    LoopPhase::Learn,
];

/// State that survives a reset.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Retained {
    /// Starts in a row whose run did not reach [`EARLY_US`], the present one included until it
    /// does.
    pub early: u32,
    /// The last crash.
    pub crash: Option<Crash>,
}

/// A phase by its number, as an atomic holds it.
#[must_use]
pub fn phase(number: u8) -> LoopPhase {
    PHASES
        .get(usize::from(number))
        .copied()
        .unwrap_or(LoopPhase::Starting)
}

impl Retained {
    /// At start: the state found in RAM, and the causes of the reset. The second value: the start
    /// is a safe one. Only resets that the board did itself count: switching it off and on, or
    /// pressing the button, restarts the count.
    #[must_use]
    pub fn started(words: &[u32; WORDS], causes: u8) -> (Retained, bool) {
        let mut retained = Retained::from_words(words).unwrap_or_default();
        let by_itself = causes & (cause::SOFTWARE | cause::WATCHDOG | cause::WINDOW) != 0;
        let new = causes & (cause::POWER_ON | cause::BROWN_OUT) != 0;
        if new || !by_itself {
            retained.early = 0;
        }
        let safe = retained.early >= SAFE_AFTER;
        retained.early = retained.early.saturating_add(1);
        if let Some(crash) = &mut retained.crash {
            crash.starts = crash.starts.saturating_add(1);
        }
        (retained, safe)
    }

    /// A crash. Its number follows from the one before.
    #[must_use]
    pub fn crashed(&self, crash: Crash) -> Retained {
        let number = self.crash.map_or(0, |last| last.number).saturating_add(1);
        let crash = Crash {
            number,
            starts: 0,
            ..crash
        };
        Retained {
            crash: Some(crash),
            ..*self
        }
    }

    /// Encodes the state as words of RAM.
    #[must_use]
    pub fn words(&self) -> [u32; WORDS] {
        let mut words = [0; WORDS];
        let [kind, crash] = match self.crash {
            None => [0; 2],
            Some(crash) => {
                let at = |known: &[CrashKind]| known.iter().position(|k| *k == crash.kind);
                let phase = PHASES.iter().position(|p| *p == crash.phase).unwrap_or(0);
                let kind = at(&KINDS).unwrap_or(0) + 1;
                [kind as u32, phase as u32 | u32::from(crash.unwell) << 8]
            }
        };
        let of = |get: fn(&Crash) -> u32| self.crash.as_ref().map_or(0, get);
        let all = [
            MAGIC,
            self.early,
            kind,
            crash,
            of(|c| c.pc),
            of(|c| c.lr),
            of(|c| c.xpsr),
            of(|c| c.cfsr),
            of(|c| c.hfsr),
            of(|c| c.mmfar),
            of(|c| c.bfar),
            of(|c| c.uptime_ms),
            of(|c| c.number),
            of(|c| c.starts),
        ];
        for (place, word) in words.iter_mut().zip(all) {
            *place = word;
        }
        let [.., last] = &mut words;
        *last = crc(&all);
        words
    }

    /// Decodes words of RAM; `None`: they are something else, or damaged.
    #[must_use]
    pub fn from_words(words: &[u32; WORDS]) -> Option<Retained> {
        let [all @ .., _, stated] = words;
        if *stated != crc(all) {
            return None;
        }
        let [
            MAGIC,
            early,
            kind,
            crash,
            pc,
            lr,
            xpsr,
            cfsr,
            hfsr,
            mmfar,
            bfar,
            uptime_ms,
            number,
            starts,
        ] = *all
        else {
            return None;
        };
        let kind = (kind as usize)
            .checked_sub(1)
            .and_then(|kind| KINDS.get(kind));
        let crash = kind.map(|kind| Crash {
            kind: *kind,
            phase: phase(crash as u8),
            unwell: (crash >> 8) as u8,
            pc,
            lr,
            xpsr,
            cfsr,
            hfsr,
            mmfar,
            bfar,
            uptime_ms,
            number,
            starts,
        });
        Some(Retained { early, crash })
    }
}

fn crc(words: &[u32]) -> u32 {
    let mut bytes = [0; 4 * WORDS];
    let mut len = 0;
    for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
        len += 4;
    }
    crc32_zlib(bytes.get(..len).unwrap_or_default())
}

#[cfg(test)]
mod tests;
