//! Random numbers: xorshift64* (Vigna 2016), the same on every machine.

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// `stream` selects independent streams of the same seed.
    pub fn new(seed: u64, stream: u64) -> Random {
        let mut random = Random((seed ^ stream.rotate_left(40)) | 1 << 63);
        for _ in 0..8 {
            random.next();
        }
        random
    }

    /// 32 random bits.
    pub fn next(&mut self) -> u32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 32) as u32
    }

    /// From 0 to `below` - 1; `below` is at least 1.
    pub fn below(&mut self, below: u32) -> u32 {
        ((u64::from(self.next()) * u64::from(below.max(1))) >> 32) as u32
    }

    /// From -1 to 1.
    pub fn signed(&mut self) -> f32 {
        (self.next().cast_signed() >> 8) as f32 * (1.0 / 8_388_608.0)
    }

    /// Approximately normal, with standard deviation 1: a sum of four numbers.
    pub fn normal(&mut self) -> f32 {
        let sum = self.signed() + self.signed() + self.signed() + self.signed();
        sum * 0.866_025_4
    }
}
