//! A value that is there or not, stated twice.
//!
//! Whether an [`Option`] holds something is one bit or one word of memory. If a bit of it flips,
//! what last was in that memory counts as a value. Here a word beside it must agree, which no
//! single bit turns from "nothing" into "something".

/// Something is there.
const THERE: u32 = 0x5A3C_C3A5;
/// Nothing is.
const NOTHING: u32 = !THERE;

/// A value or nothing.
#[derive(Debug)]
pub(super) struct Guarded<T> {
    value: Option<T>,
    mark: u32,
}

impl<T> Guarded<T> {
    /// Nothing.
    pub const NONE: Guarded<T> = Guarded {
        value: None,
        mark: NOTHING,
    };

    /// The value, if both say that there is one.
    #[inline(always)]
    pub fn get(&self) -> Option<&T> {
        self.value.as_ref().filter(|_| self.mark == THERE)
    }

    /// The same, to be changed.
    #[inline(always)]
    pub fn get_mut(&mut self) -> Option<&mut T> {
        self.value.as_mut().filter(|_| self.mark == THERE)
    }

    /// From now on it is this.
    #[inline(always)]
    pub fn put(&mut self, value: T) -> &mut T {
        self.mark = THERE;
        self.value.insert(value)
    }

    /// From now on there is nothing.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.value = None;
        self.mark = NOTHING;
    }

    /// There is a value.
    #[inline(always)]
    pub fn is_some(&self) -> bool {
        self.get().is_some()
    }

    /// There is none.
    #[inline(always)]
    pub fn is_none(&self) -> bool {
        !self.is_some()
    }

    /// Both say the same.
    pub fn agrees(&self) -> bool {
        self.mark == if self.value.is_some() { THERE } else { NOTHING }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_says_so_is_not_enough() {
        let mut guarded = Guarded::<u8>::NONE;
        assert!(guarded.is_none() && guarded.agrees());
        guarded.value = Some(1);
        assert!(guarded.is_none() && !guarded.agrees());
        assert_eq!(guarded.get(), None);
        assert_eq!(guarded.get_mut(), None);
        guarded.put(2);
        assert!(guarded.agrees() && guarded.get() == Some(&2));
        for bit in 0..32 {
            guarded.mark ^= 1 << bit;
            assert!(guarded.is_none() && !guarded.agrees());
            guarded.mark ^= 1 << bit;
        }
        guarded.clear();
        assert!(guarded.is_none() && guarded.agrees());
    }
}
