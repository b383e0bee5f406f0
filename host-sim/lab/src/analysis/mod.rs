//! Analyses of sensors: Allan variance, and how well their errors can be learnt.

pub mod allan;
pub mod learnability;
