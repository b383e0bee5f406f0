//! Analyses of samples: Allan variance, the limits of learning, how far corrections can lead, and
//! what contradicts a recording.

pub mod allan;
pub mod doubts;
pub mod error_bound;
pub mod learnability;
pub mod offset;
pub mod positions;
pub mod standing;
pub mod time_offset;
