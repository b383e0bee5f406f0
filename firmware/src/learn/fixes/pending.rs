//! When a fix is used: never close to the end of a block or to another fix.
//!
//! A fix and the end of a block each take the learner several hundred thousand instructions. Apart
//! they never add up, and the answer to a block is ready well before it comes into force. So a fix
//! waits until there is time before and after it; the navigator retains its history and uses the
//! fix as of its own time. How long it waits depends on the numbers of the samples alone, so the
//! same recording gives the same bits on every machine.

use crate::fix::Fix;
use crate::sample::StreamScale;

/// Time that a fix or the end of a block has for itself, s: ten times what it takes at 168 MHz.
const WORK_S: f64 = 0.05;
/// [`WORK_S`] is limited to a block divided by this.
const SHARE: u32 = 4;

/// The fix that waits, and what it waits for.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PendingFix {
    /// The fix and the number of the sample before it.
    fix: Option<(u32, Fix)>,
    /// Samples of the block in progress.
    in_block: u32,
    /// Samples until the work in progress is done.
    busy: u32,
    /// Samples of a block, and those that work takes; 0 before the first fix.
    block: u32,
    work: u32,
}

impl PendingFix {
    /// A fix has come while the navigator runs. True: it waits. One that waits already is not
    /// replaced: the newer one is then not used.
    pub fn defers(&mut self, number: u32, fix: &Fix, stream: &StreamScale) -> bool {
        self.knows(stream);
        if self.fix.is_none() && self.is_free() {
            return false;
        }
        self.fix.get_or_insert((number, *fix));
        true
    }

    /// A sample has come. Gives the fix whose time has come.
    #[inline(always)]
    pub fn sample(&mut self) -> Option<(u32, Fix)> {
        self.in_block = self.in_block.saturating_add(1);
        self.busy = self.busy.saturating_sub(1);
        if self.fix.is_none() || !self.is_free() {
            return None;
        }
        self.fix.take()
    }

    /// A block has ended.
    pub fn block(&mut self) {
        self.in_block = 0;
        self.busy = self.work;
    }

    /// The next sample begins a block.
    pub fn gap(&mut self) {
        self.in_block = 0;
    }

    /// Gives the fix that waits. It does not wait any more.
    pub fn take(&mut self) -> Option<(u32, Fix)> {
        self.fix.take()
    }

    /// A fix has been used.
    pub fn observed(&mut self, stream: &StreamScale) {
        self.knows(stream);
        self.busy = self.work;
    }

    fn knows(&mut self, stream: &StreamScale) {
        self.block = stream.block_samples.into();
        let work = (WORK_S / stream.period_s) as u32; // `as` saturates
        self.work = work.min(self.block / SHARE);
    }

    /// Whether there is time before and after this sample.
    fn is_free(&self) -> bool {
        self.busy == 0 && self.in_block.saturating_add(self.work) <= self.block
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fix::{NOT_MEASURED, OBSERVATIONS, Position};
    use crate::sample::Lsb;
    use std::vec::Vec;

    fn fix(time_ms: u32) -> Fix {
        Fix {
            position: Position::default(),
            velocity: [0.0; 3],
            sigmas: [NOT_MEASURED; OBSERVATIONS],
            heading: None,
            time_ms,
            arrived_us: 0,
            waited: 0,
            age: None,
        }
    }

    /// Whatever the rate, the length of a block, and the distance of the fixes: no two of block's
    /// end and fixes are closer to each other than the work takes, and no fix waits for longer than
    /// it must.
    #[test]
    fn work_never_comes_together() {
        for (rate, block) in [(100, 100), (2000, 2000), (200, 20), (125, 125), (50, 3)] {
            let stream = StreamScale {
                lsb: Lsb { rad: 1.0, mps: 1.0 },
                period_s: 1.0 / f64::from(rate),
                block_samples: block,
            };
            let work = (rate / 20).min(u32::from(block) / SHARE);
            for apart in [1, 3, rate / 10 + 1, rate / 5, rate, rate + 1] {
                let mut pending = PendingFix::default();
                let (mut came, mut used) = (0, 0);
                let mut does = Vec::new();
                for number in 1..=20 * rate {
                    if let Some((arrived, _)) = pending.sample() {
                        pending.observed(&stream);
                        does.push(number);
                        used += 1;
                        assert!(number - arrived <= 3 * work + 1, "{rate} {block} {apart}");
                    }
                    if number.is_multiple_of(u32::from(block)) {
                        pending.block();
                        does.push(number);
                    }
                    if number.is_multiple_of(apart) {
                        came += 1;
                        if !pending.defers(number, &fix(number), &stream) {
                            pending.observed(&stream);
                            if came == 1 {
                                does.clear(); // before it did not know the stream
                            }
                            does.push(number);
                            used += 1;
                        }
                    }
                }
                let closest = does.windows(2).map(|two| two[1] - two[0]).min();
                assert!(closest >= Some(work), "{rate} {block} {apart}: {closest:?}");
                let all = apart > 2 * work + 1 && u32::from(block) > 4 * work;
                assert!(
                    !all || came - used <= 1,
                    "{rate} {block} {apart}: {used} of {came}"
                );
                assert!(used > 0);
            }
        }
    }
}
