//! The digests the desktop computed, written by `cargo xtask vectors`.

pub const STEP_RATIONAL: u64 = 0x40db_c45b_838b_aa91;
pub const STEP_TANH: u64 = 0xb5ee_4c27_8c62_e531;
pub const GRADIENT_RATIONAL: u64 = 0xf996_9442_2acc_88ef;
pub const GRADIENT_TANH: u64 = 0xfc57_3a69_acf6_d06c;
pub const LEARNERS_RATIONAL: u64 = 0x75bf_de9e_1521_29f3;
pub const LEARNERS_TANH: u64 = 0x0742_6edf_d380_2f78;
