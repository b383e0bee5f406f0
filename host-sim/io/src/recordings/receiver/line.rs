//! One protocol of a receiver's log.

use super::DAY_MS;
use super::message_counts::MessageCounts;
use super::name;
use firmware::fix::{Fix, WEEK_MS, ms_since};
use firmware::wire::Framer;
use firmware::wire::receiver::ReceiverFormat;
use firmware::wire::receiver::epoch::Arrival;
use firmware::wire::receiver::stream::{Receiver, SILENCE_US};
use host_core::words::counted;

/// A fix, and whether its day is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solved {
    pub(super) fix: Fix,
    pub(super) dated: bool,
}

/// What the log holds of a protocol.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) format: ReceiverFormat,
    /// The user has given it: no other one is looked for.
    pub(super) given: bool,
    receiver: Receiver,
    framer: Framer<ReceiverFormat>,
    pub(super) seen: MessageCounts,
    pub(super) fixes: Vec<Solved>,
}

impl Line {
    pub(super) fn new(format: ReceiverFormat, given: bool) -> Self {
        Self {
            format,
            given,
            receiver: Receiver::new(Some(format)),
            framer: Framer::new(format),
            seen: MessageCounts::default(),
            fixes: Vec::new(),
        }
    }

    /// The next bytes; none at the end of the log.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.framer.push(bytes);
        while let Some(event) = self.framer.next_event() {
            self.seen.note(self.format, event.kind(), event.bytes());
        }
        // the silence at the end completes the last epoch
        let us = if bytes.is_empty() { SILENCE_US } else { 0 };
        self.receiver.push(bytes, Arrival { us, sample: 0 });
        while let Some(solution) = self.receiver.next_fix() {
            // without a checksum anything may be a fix: only where it is given
            let counts = self.given || !self.seen.lacks_checksums();
            if let Some(fix) = solution.fix.filter(|_| counts) {
                let dated = solution.dated;
                self.fixes.push(Solved { fix, dated });
            }
        }
    }

    /// Values that a fix of it has, at most.
    pub(super) fn values(&self) -> usize {
        let has = |value: &usize| {
            let sigmas = self.fixes.iter().map(|solved| solved.fix.sigmas[*value]);
            { sigmas }.any(f32::is_finite)
        };
        (0..6).filter(has).count()
    }

    /// Time from the first fix to the last, ms.
    pub(super) fn span_ms(&self) -> u64 {
        let times = self.fixes.iter().map(|solved| solved.fix.time_ms);
        let steps = times.clone().zip(times.skip(1));
        let ahead = steps.map(|(then, now)| ms_since(then, now));
        ahead.filter(|ms| *ms < WEEK_MS / 2).map(u64::from).sum()
    }

    /// A note that it is in the log, too.
    pub(super) fn also(&self) -> Option<String> {
        let (name, fixes) = (name(self.format), self.fixes.len());
        (fixes > 0).then(|| {
            format!(
                "{name} is in the log, too, with {}; --fixes-protocol {} takes these",
                counted(fixes, "fix"),
                name.to_lowercase()
            )
        })
    }

    /// Carries the date back to the fixes before the first one that has it, or before the end of
    /// the log. False: there is none.
    pub(super) fn date(&mut self) -> bool {
        let dated = self.fixes.iter().position(|solved| solved.dated);
        let first = dated.unwrap_or(self.fixes.len());
        let (before, after) = self.fixes.split_at_mut(first);
        let known = after.first().map(|solved| solved.fix.time_ms);
        let Some(known) = known.or_else(|| self.receiver.time_of_week()) else {
            return false;
        };
        if let Some(last) = before.last() {
            let last = last.fix.time_ms;
            // the day that the known one would have had
            let midnight = known % DAY_MS + DAY_MS / 2 < last % DAY_MS;
            let counted = last / DAY_MS + u32::from(midnight);
            let days = (known / DAY_MS + 7 - counted % 7) % 7;
            for solved in before {
                solved.fix.time_ms = (solved.fix.time_ms + days * DAY_MS) % WEEK_MS;
            }
        }
        true
    }
}
