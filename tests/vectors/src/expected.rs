//! The digests the desktop computed, written by `cargo xtask vectors`.

pub const STEP_RATIONAL: u64 = 0x40db_c45b_838b_aa91;
pub const STEP_TANH: u64 = 0xb5ee_4c27_8c62_e531;
pub const GRADIENT_RATIONAL: u64 = 0x8466_e7b0_e4a6_f642;
pub const GRADIENT_TANH: u64 = 0x59e7_ac80_aea0_4b74;
pub const LEARNERS_RATIONAL: u64 = 0xbe80_949f_40e5_b65f;
pub const LEARNERS_TANH: u64 = 0x5677_d9f5_087c_b2a6;
pub const KERNEL_M4: u64 = 0x7a15_3ae6_30fa_0865;
pub const KERNEL_M7: u64 = 0x3300_e785_fe1e_db5c;
pub const DRIVEN: u64 = 0xf257_9fd1_d871_a5fc;
