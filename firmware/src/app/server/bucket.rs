//! How often something may happen: a token bucket by the device's clock.

/// A number of tokens that grows with time up to a most.
#[derive(Debug)]
pub(super) struct Bucket {
    most: u16,
    /// Time for one more, microseconds, > 0.
    period_us: u64,
    left: u16,
    /// Time at which the last one was added, or at which the bucket was last full.
    since_us: u64,
}

impl Bucket {
    /// Full.
    pub const fn new(most: u16, period_us: u64) -> Bucket {
        Bucket {
            most,
            period_us,
            left: most,
            since_us: 0,
        }
    }

    /// Tokens there are now.
    pub fn left(&mut self, now_us: u64) -> u16 {
        let passed = now_us.saturating_sub(self.since_us);
        let new = passed.checked_div(self.period_us).unwrap_or(0);
        let missing = self.most.saturating_sub(self.left);
        match u16::try_from(new) {
            Ok(new) if new < missing => {
                self.left = self.left.saturating_add(new);
                let added = self.period_us.saturating_mul(u64::from(new));
                self.since_us = self.since_us.saturating_add(added);
            }
            _ => (self.left, self.since_us) = (self.most, now_us),
        }
        self.left
    }

    /// Time until there is a token, ms, at least 1; `None`: there is one.
    pub fn wait(&mut self, now_us: u64) -> Option<u32> {
        if self.left(now_us) > 0 {
            return None;
        }
        let due = self.since_us.saturating_add(self.period_us);
        let ms = due.saturating_sub(now_us).div_ceil(1000);
        Some(u32::try_from(ms).unwrap_or(u32::MAX).max(1))
    }

    /// Takes a token.
    ///
    /// # Errors
    /// There is none; as [`Bucket::wait`].
    pub fn take(&mut self, now_us: u64) -> Result<(), u32> {
        match self.wait(now_us) {
            Some(ms) => Err(ms),
            None => {
                self.left = self.left.saturating_sub(1);
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_at_once_as_it_holds_then_one_a_period() {
        let mut bucket = Bucket::new(3, 1000);
        assert_eq!([0, 0, 0].map(|now| bucket.take(now)), [Ok(()); 3]);
        assert_eq!(bucket.take(0), Err(1));
        assert_eq!(bucket.take(999), Err(1));
        assert_eq!((bucket.take(1000), bucket.take(1001)), (Ok(()), Err(1)));
        // 2500 us later: two, and the half one is not lost
        assert_eq!(bucket.left(3500), 2);
        assert_eq!(
            [3500, 3500, 3999, 4000].map(|now| bucket.take(now).is_ok()),
            [true, true, false, true]
        );
    }

    #[test]
    fn never_more_than_it_holds_and_the_wait_is_told() {
        let mut bucket = Bucket::new(2, 600_000_000);
        assert_eq!(bucket.left(u64::MAX / 2), 2);
        let now = u64::MAX / 2 + 5;
        assert_eq!([now; 2].map(|now| bucket.take(now)), [Ok(()); 2]);
        assert_eq!(bucket.take(now + 1_000_000), Err(599_000));
        assert_eq!(bucket.left(now + 1_300_000_000), 2);
    }
}
