//! Learning: the teacher, the fit over a window, promotion, the learner from fixes, and the baselines.

pub mod baseline;
pub mod fit;
pub mod fix_learner;
pub mod promotion;
pub mod teacher;
pub mod window;
