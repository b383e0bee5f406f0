//! Learning: the teacher, the fit of the networks to its references, the decision whether they may
//! be used, the device's learner from fixes, and the linear baselines.

pub mod aiding;
pub mod baseline;
pub mod considered;
pub mod corrected;
pub mod device;
pub mod fit;
pub mod fix_learner;
pub mod fleet;
pub mod in_motion;
pub mod promotion;
pub mod recall;
pub mod rests;
pub mod teacher;
pub mod window;

/// The scheme that corrects nothing.
pub const NONE: &str = "uncorrected";
