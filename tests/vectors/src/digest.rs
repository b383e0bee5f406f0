//! The digest: FNV-1a, 64 bit, over the bits of every number.

/// FNV-1a state; it depends on the order of its input.
#[derive(Clone, Copy, Debug)]
pub struct Digest(u64);

impl Digest {
    /// The offset basis of FNV-1a.
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Feeds one byte.
    pub const fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// Feeds the bits of one number. NaNs are all the same: IEEE 754 leaves their sign and payload
    /// to the machine (x86 and ARM differ), and -0.0 is not +0.0.
    pub fn number(&mut self, value: f32) {
        let bits = if value.is_nan() {
            0x7fc0_0000
        } else {
            value.to_bits()
        };
        for byte in bits.to_le_bytes() {
            self.byte(byte);
        }
    }

    /// Feeds several numbers.
    pub fn numbers(&mut self, values: impl IntoIterator<Item = f32>) {
        for value in values {
            self.number(value);
        }
    }

    /// The digest of all that was fed.
    pub const fn value(self) -> u64 {
        self.0
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::Digest;

    #[test]
    fn published_test_vectors_of_fnv_1a() {
        let of = |text: &[u8]| {
            let mut digest = Digest::new();
            text.iter().for_each(|&byte| digest.byte(byte));
            digest.value()
        };
        assert_eq!(of(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn one_bit_changes_it() {
        let of = |value: f32| {
            let mut digest = Digest::new();
            digest.number(value);
            digest.value()
        };
        assert_ne!(of(1.0), of(f32::from_bits(1.0f32.to_bits() + 1)));
        assert_ne!(of(0.0), of(-0.0));
        assert_eq!(of(f32::NAN), of(-f32::NAN));
    }
}
