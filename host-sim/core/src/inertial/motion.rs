//! The increments of a session, epoch by epoch. They are a list in memory, or are made from the
//! counts on request, so that a day at 200 Hz and its corrected forms need not be in memory.

use crate::inertial::sins::Increment;
use std::borrow::Cow;

/// Increments by epochs of `steps` each.
pub trait Motion {
    /// The increments of epoch `k`.
    fn epoch(&self, k: usize, steps: usize) -> Cow<'_, [Increment]>;

    /// The increments of the first `epochs` epochs.
    fn beginning(&self, epochs: usize, steps: usize) -> Cow<'_, [Increment]> {
        let each = (0..epochs).map(|k| self.epoch(k, steps));
        each.fold(Vec::new(), |mut all, epoch| {
            all.extend_from_slice(&epoch);
            all
        })
        .into()
    }
}

impl Motion for &[Increment] {
    fn epoch(&self, k: usize, steps: usize) -> Cow<'_, [Increment]> {
        self[k * steps..(k + 1) * steps].into()
    }

    fn beginning(&self, epochs: usize, steps: usize) -> Cow<'_, [Increment]> {
        self[..epochs * steps].into()
    }
}

impl Motion for Vec<Increment> {
    fn epoch(&self, k: usize, steps: usize) -> Cow<'_, [Increment]> {
        self[k * steps..(k + 1) * steps].into()
    }

    fn beginning(&self, epochs: usize, steps: usize) -> Cow<'_, [Increment]> {
        self[..epochs * steps].into()
    }
}

/// Makes the increments of an epoch.
type Maker<'a> = Box<dyn Fn(usize) -> Vec<Increment> + 'a>;

/// Increments in one of the two forms.
pub enum Increments<'a> {
    /// In memory.
    All(Vec<Increment>),
    /// Made epoch by epoch.
    Made(Maker<'a>),
}

impl<'a> Increments<'a> {
    /// Each increment changed.
    #[must_use]
    pub fn map(self, change: impl Fn(&Increment) -> Increment + 'a) -> Self {
        match self {
            Self::All(all) => Self::All(all.iter().map(change).collect()),
            Self::Made(make) => {
                Self::Made(Box::new(move |k| make(k).iter().map(&change).collect()))
            }
        }
    }
}

impl Motion for Increments<'_> {
    fn epoch(&self, k: usize, steps: usize) -> Cow<'_, [Increment]> {
        match self {
            Self::All(all) => all.epoch(k, steps),
            Self::Made(make) => make(k).into(),
        }
    }

    fn beginning(&self, epochs: usize, steps: usize) -> Cow<'_, [Increment]> {
        match self {
            Self::All(all) => all.beginning(epochs, steps),
            Self::Made(make) => (0..epochs).flat_map(make).collect(),
        }
    }
}
