//! What the application has the board store.

use crate::configuration::record::Record;
use crate::learn::Learner;
use crate::model::Nets;
use crate::store::{Content, Memory, Notes, Step};
use crate::wire::command::key::Key;

/// What is to be stored now, and how. The board carries it out with
/// [`Store::carry_out`](crate::store::Store::carry_out) and reports to [`App::stored`](super::App).
#[derive(Debug, Clone)]
pub struct Job {
    /// How.
    pub step: Step,
    /// The networks for the next power-on.
    pub nets: Nets,
    /// The configuration record; may be empty.
    pub record: Record,
    /// What goes with it of the unit.
    pub remembers: Remembers,
    /// The unit: [`Content::unit`].
    pub unit: u32,
    /// Minutes since power-on.
    pub minutes: u32,
    /// The device's key.
    pub key: Key,
    pub(super) edition: u8,
}

/// What a record remembers of the unit.
#[derive(Debug, Clone, Copy)]
pub enum Remembers {
    /// Nothing.
    Nothing,
    /// What the newest record remembers.
    Same,
    /// So many bytes that the learner has taken down.
    New(Notes, usize),
}

impl Job {
    /// What is to be stored, with the learner's own bytes.
    pub fn content<'c>(&'c self, learner: Option<&'c dyn Learner>) -> Content<'c> {
        let memory = match (self.remembers, learner) {
            (Remembers::New(notes, len), Some(learner)) => Memory::New(notes, learner, len),
            (Remembers::Same, _) => Memory::Same,
            (Remembers::New(..) | Remembers::Nothing, _) => Memory::None,
        };
        Content {
            nets: &self.nets,
            record: &self.record,
            memory,
            unit: self.unit,
            minutes: self.minutes,
            key: self.key,
        }
    }
}
