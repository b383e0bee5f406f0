//! What the boards share. An image need not use all of it.
#![allow(dead_code, reason = "an image without the learner from fixes")]

pub mod blackbox;
pub mod crash;
pub mod cut;
pub mod learners;
pub mod time;
pub mod wake;
