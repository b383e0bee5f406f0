//! The digests the desktop computed, written by `cargo xtask vectors`.

pub const STEP_RATIONAL: u64 = 0x84c6_4cd6_7158_50b1;
pub const STEP_TANH: u64 = 0xb5ee_4c27_8c62_e531;
pub const GRADIENT_RATIONAL: u64 = 0x3006_b0cb_ad75_7d1a;
pub const GRADIENT_TANH: u64 = 0xfc57_3a69_acf6_d06c;
pub const LEARNERS_RATIONAL: u64 = 0x3006_b0cb_ad75_7d1a;
pub const LEARNERS_TANH: u64 = 0xfc57_3a69_acf6_d06c;
