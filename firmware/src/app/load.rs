//! Load of the processor: the share of each second in which it did not sleep.

use crate::link::Clock;

/// A second, microseconds.
const SECOND: u64 = 1_000_000;

/// The load, per mille. `None` before the first second is over and where the clock does not know
/// it.
#[derive(Debug, Default)]
pub(super) struct Load {
    /// Time and time asleep when the second began, microseconds.
    since: (u64, u64),
    /// Load of the last whole second.
    pub last: Option<u16>,
    /// Load of the busiest second.
    pub most: Option<u16>,
}

impl Load {
    /// Called in every pass. True: a second is over.
    #[inline(always)]
    pub fn look(&mut self, now: u64, clock: &impl Clock) -> bool {
        // the lower halves, which differ by less than 2^32 us: there are passes more often
        if (now as u32).wrapping_sub(self.since.0 as u32) < SECOND as u32 {
            return false;
        }
        self.second_is_over(now, clock.asleep_us());
        true
    }

    #[cold]
    #[inline(never)]
    fn second_is_over(&mut self, now: u64, asleep: Option<u64>) {
        let time = now.wrapping_sub(self.since.0);
        self.since.0 = now;
        let Some(asleep) = asleep else {
            return;
        };
        let slept = asleep.wrapping_sub(self.since.1).min(time);
        let awake = ((time - slept) * 1000).checked_div(time);
        let permille = awake.and_then(|permille| u16::try_from(permille).ok());
        self.since.1 = asleep;
        self.last = permille;
        self.most = self.most.max(permille);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Time(u64, Option<u64>);

    impl Clock for Time {
        fn now_us(&self) -> u64 {
            self.0
        }
        fn asleep_us(&self) -> Option<u64> {
            self.1
        }
    }

    #[test]
    fn the_share_awake_of_each_second() {
        let mut load = Load::default();
        let mut look = |now, asleep| {
            let clock = Time(now, asleep);
            load.look(clock.now_us(), &clock);
            (load.last, load.most)
        };
        assert_eq!(look(999_999, Some(10)), (None, None));
        assert_eq!(look(1_000_000, Some(750_000)), (Some(250), Some(250)));
        assert_eq!(look(1_999_999, Some(750_000)), (Some(250), Some(250)));
        assert_eq!(look(2_000_000, Some(1_740_000)), (Some(10), Some(250)));
        assert_eq!(look(4_000_000, Some(1_740_000)), (Some(1000), Some(1000)));
        assert_eq!(look(9_000_000, None), (Some(1000), Some(1000)));
    }
}
