//! Consumer of the samples: none, the alignment in motion, or the navigator. Only one of them
//! exists at a time, so that they share their memory.

use crate::align::motion::InMotion;
use crate::nav::{self, Navigator};
use crate::sample::Counts;

/// Consumer of the samples.
#[derive(Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap, and the largest one is needed"
)]
pub(super) enum Course {
    /// Before the first fix.
    Waits,
    /// Between the first fix and the end of the alignment.
    Aligns(InMotion),
    Navigates(Navigator),
}

impl Course {
    pub fn navigates(&self) -> bool {
        matches!(self, Course::Navigates(_))
    }

    pub fn navigator(&self) -> Option<&Navigator> {
        match self {
            Course::Navigates(navigator) => Some(navigator),
            Course::Waits | Course::Aligns(_) => None,
        }
    }

    pub fn navigator_mut(&mut self) -> Option<&mut Navigator> {
        match self {
            Course::Navigates(navigator) => Some(navigator),
            Course::Waits | Course::Aligns(_) => None,
        }
    }

    pub fn motion(&self) -> Option<&InMotion> {
        match self {
            Course::Aligns(motion) => Some(motion),
            Course::Waits | Course::Navigates(_) => None,
        }
    }

    pub fn motion_mut(&mut self) -> Option<&mut InMotion> {
        match self {
            Course::Aligns(motion) => Some(motion),
            Course::Waits | Course::Navigates(_) => None,
        }
    }

    /// Takes a sample.
    #[inline]
    pub fn sample(&mut self, counts: &Counts) {
        match self {
            Course::Navigates(navigator) => navigator.sample(counts),
            Course::Aligns(motion) => motion.sample(counts),
            Course::Waits => {}
        }
    }

    /// A new navigator takes over, if it can begin. By itself, so that the copy on the stack is
    /// gone afterwards.
    #[inline(never)]
    pub fn navigate(&mut self, config: &nav::Config, state: nav::State) -> Option<()> {
        *self = Course::Navigates(Navigator::new(*config, state).ok()?);
        Some(())
    }
}
