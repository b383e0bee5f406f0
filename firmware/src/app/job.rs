//! Jobs of storing that the application gives to the board.

use super::App;
use crate::configuration::record::Record;
use crate::learn::Learner;
use crate::link::spsc::{Consumer, Producer, Queue};
use crate::model::Nets;
use crate::store::{Content, Memory, Notes, Progress, Step};
use crate::wire::command::key::Key;

/// A record to store, and how. The board carries it out with
/// [`Store::carry_out`](crate::store::Store::carry_out) and reports to [`App::stored`].
#[derive(Debug, Clone)]
pub struct Job {
    /// How.
    pub step: Step,
    /// The networks for the next power-on.
    pub nets: Nets,
    /// The configuration record; may be empty.
    pub record: Record,
    /// Memory of the unit that goes with it.
    pub remembers: Remembers,
    /// The unit: [`Content::unit`].
    pub unit: u32,
    /// Minutes since power-on.
    pub minutes: u32,
    /// The device's key.
    pub key: Key,
    pub(super) edition: u8,
}

/// Memory of the unit in a record.
#[derive(Debug, Clone, Copy)]
pub enum Remembers {
    /// No memory.
    Nothing,
    /// The memory of the newest record.
    Same,
    /// Notes, and the length of the memory that the learner has recorded, bytes.
    New(Notes, usize),
}

impl Job {
    /// Content to be stored, with the learner's own bytes.
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

    /// Progress of this job.
    pub fn done(&self, progress: Progress) -> Done {
        Done {
            step: self.step,
            edition: self.edition,
            progress,
        }
    }
}

/// Progress of a job.
#[derive(Debug, Clone, Copy)]
pub struct Done {
    pub(super) step: Step,
    pub(super) edition: u8,
    pub(super) progress: Progress,
}

/// The queues between the frame path and the priority that stores, to be static.
#[derive(Debug)]
pub struct Jobs {
    jobs: Queue<Job, 1>,
    done: Queue<Done, 1>,
}

impl Jobs {
    /// Empty.
    #[expect(clippy::new_without_default, reason = "it is for statics")]
    pub const fn new() -> Jobs {
        Jobs {
            jobs: Queue::new(),
            done: Queue::new(),
        }
    }

    /// Splits the queues into the frame path's end and the main thread's.
    pub fn split(&mut self) -> (Gives<'_>, Stores<'_>) {
        let (jobs_in, jobs_out) = self.jobs.split();
        let (done_in, done_out) = self.done.split();
        let gives = Gives {
            jobs: jobs_in,
            done: done_out,
        };
        let stores = Stores {
            jobs: jobs_out,
            done: done_in,
        };
        (gives, stores)
    }
}

/// The frame path's side of [`Jobs`].
pub struct Gives<'m> {
    jobs: Producer<'m, Job, 1>,
    done: Consumer<'m, Done, 1>,
}

impl Gives<'_> {
    /// To be called in every pass. True: a job was given.
    pub fn turn(&mut self, app: &mut App) -> bool {
        if let Some(done) = self.done.take() {
            app.stored(&done);
        }
        app.job().is_some_and(|job| self.jobs.put(job))
    }
}

/// The side of [`Jobs`] that stores.
pub struct Stores<'m> {
    jobs: Consumer<'m, Job, 1>,
    done: Producer<'m, Done, 1>,
}

impl Stores<'_> {
    /// Carries out a job. False: there is none. Not inlined, so that its stack is free again
    /// afterwards.
    #[inline(never)]
    pub fn turn(&mut self, carry_out: impl FnOnce(&Job) -> Progress) -> bool {
        let Some(job) = self.jobs.take() else {
            return false;
        };
        let done = job.done(carry_out(&job));
        let _ = self.done.put(done); // there is one job at a time
        true
    }

    /// A job waits.
    pub fn waits(&self) -> bool {
        self.jobs.waits()
    }
}
