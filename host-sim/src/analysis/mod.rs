//! Analyses of sensors: Allan variance, and how well each quantity can be learnt.

pub mod allan;
pub mod learnability;
