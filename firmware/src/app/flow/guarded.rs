//! A value that is there or not, stated twice.
//!
//! Whether an [`Option`] holds something is one bit or one word of memory. If a bit of it flips,
//! the last content of that memory counts as a value. Here two words must agree, which no single
//! bit turns from "nothing" into "something". The value stays where it is, so that it can be
//! rebuilt there without a copy.

/// Something is there.
const THERE: u32 = 0x5A3C_C3A5;
/// There is no value.
const NOTHING: u32 = !THERE;

/// A value or nothing.
#[derive(Debug)]
pub(in crate::app) struct Guarded<T> {
    value: T,
    marks: [u32; 2],
}

impl<T> Guarded<T> {
    /// No value; `value` is the content of its memory.
    pub const fn nothing(value: T) -> Guarded<T> {
        Guarded {
            value,
            marks: [NOTHING; 2],
        }
    }

    /// The value, if both say that there is one.
    #[inline(always)]
    pub fn get(&self) -> Option<&T> {
        self.is_some().then_some(&self.value)
    }

    /// The value, to be changed.
    #[inline(always)]
    pub fn get_mut(&mut self) -> Option<&mut T> {
        self.is_some().then_some(&mut self.value)
    }

    /// From now on there is a value: the last content of its memory, to be rebuilt.
    #[inline(always)]
    pub fn put(&mut self) -> &mut T {
        self.marks = [THERE; 2];
        &mut self.value
    }

    /// The value's place while there is none, to be made before it counts.
    pub fn place(&mut self) -> Option<&mut T> {
        self.is_none().then_some(&mut self.value)
    }

    /// Clears the value.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.marks = [NOTHING; 2];
    }

    /// Whether there is a value.
    #[inline(always)]
    pub fn is_some(&self) -> bool {
        self.marks == [THERE; 2]
    }

    /// Whether there is no value.
    #[inline(always)]
    pub fn is_none(&self) -> bool {
        !self.is_some()
    }

    /// Whether both words agree.
    pub fn agrees(&self) -> bool {
        self.marks == [THERE; 2] || self.marks == [NOTHING; 2]
    }
}

#[cfg(test)]
impl<T> Guarded<T> {
    /// Flips a bit of its memory.
    pub fn upset(&mut self) {
        self.marks[1] ^= 1 << 7;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_says_so_is_not_enough() {
        let mut guarded = Guarded::nothing(0);
        assert!(guarded.is_none() && guarded.agrees());
        guarded.marks[0] = THERE;
        assert!(guarded.is_none() && !guarded.agrees());
        assert_eq!(guarded.get(), None);
        assert_eq!(guarded.get_mut(), None);
        *guarded.put() = 2;
        assert!(guarded.agrees() && guarded.get() == Some(&2));
        for (word, bit) in [0, 1]
            .into_iter()
            .flat_map(|word| (0..32).map(move |bit| (word, bit)))
        {
            guarded.marks[word] ^= 1 << bit;
            assert!(guarded.is_none() && !guarded.agrees());
            guarded.marks[word] ^= 1 << bit;
        }
        guarded.clear();
        assert!(guarded.is_none() && guarded.agrees());
    }
}
