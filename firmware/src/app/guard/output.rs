//! Whether a line sends what it was given.

/// A line that has something to send and does not send for so long is stuck, microseconds. At the
/// slowest bit rate a byte takes 8 ms.
pub const STUCK_US: u64 = 100_000;
/// Number of attempts in a row to reopen it after which it is broken.
pub const ATTEMPTS: u8 = 3;

/// Action for the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing to do: it sends, or has nothing to send.
    Fine,
    /// It is stuck: reopen it.
    Reopen,
    /// It is stuck although it was reopened.
    Broken,
}

/// Watches the sending side of a line.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watch {
    /// Bytes that had left at the last look, and when that changed last, microseconds.
    left: usize,
    moved_us: u64,
    /// Attempts since it sent last.
    attempts: u8,
}

impl Watch {
    /// Called in every turn: how many bytes have left since start (modulo 2^32), and whether more
    /// wait.
    pub fn look(&mut self, now_us: u64, left: usize, waits: bool) -> Verdict {
        if left != self.left {
            (self.left, self.moved_us, self.attempts) = (left, now_us, 0);
            return Verdict::Fine;
        }
        if !waits {
            self.moved_us = now_us;
        }
        if now_us.saturating_sub(self.moved_us) < STUCK_US {
            return if self.attempts > ATTEMPTS {
                Verdict::Broken
            } else {
                Verdict::Fine
            };
        }
        self.moved_us = now_us;
        self.attempts = self.attempts.saturating_add(1);
        if self.attempts > ATTEMPTS {
            Verdict::Broken
        } else {
            Verdict::Reopen
        }
    }

    /// The line was reopened: pending bytes are gone, and `left` bytes count as sent.
    pub fn reopened(&mut self, left: usize) {
        self.left = left;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_sends_or_is_silent_is_fine() {
        let mut watch = Watch::default();
        for ms in 0..5000usize {
            // a byte in 8 ms, then nothing to send for two seconds, then bytes again
            let left = if ms < 2000 {
                ms / 8
            } else {
                250 + ms.saturating_sub(4000) / 8
            };
            let waits = !(2000..4000).contains(&ms);
            assert_eq!(
                watch.look(ms as u64 * 1000, left, waits),
                Verdict::Fine,
                "{ms}"
            );
        }
    }

    #[test]
    fn a_stuck_line_is_opened_anew_three_times_and_then_broken() {
        let mut watch = Watch::default();
        watch.look(0, 7, true);
        let mut verdicts = std::vec::Vec::new();
        for ms in 1..=450u64 {
            let verdict = watch.look(ms * 1000, 7, true);
            if verdict == Verdict::Reopen {
                watch.reopened(7);
            }
            verdicts.push((ms, verdict));
        }
        verdicts.retain(|(_, verdict)| *verdict != Verdict::Fine);
        let first: std::vec::Vec<_> = verdicts.iter().take(4).copied().collect();
        let (again, broken) = (Verdict::Reopen, Verdict::Broken);
        assert_eq!(
            first,
            [(100, again), (200, again), (300, again), (400, broken)]
        );
        assert_eq!(verdicts.len(), 54, "it stays broken");
        // and it is fine when it sends again
        assert_eq!(watch.look(451_000, 8, true), Verdict::Fine);
        assert_eq!(watch.look(500_000, 8, true), Verdict::Fine);
    }
}
