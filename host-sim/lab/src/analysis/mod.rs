//! Analyses of sensors: Allan variance, and the limits of learning their errors.

pub mod allan;
pub mod learnability;
