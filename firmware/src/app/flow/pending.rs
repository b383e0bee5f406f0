//! Networks that are stored for the next power-on of the sensor (activation `NextPowerOn`).
//!
//! In mode learn the networks in use correct all samples of a drive and stay as they are. Networks
//! that the learner has proved meanwhile are stored beside them, with its memory of the unit
//! ([`super::memory`]), and come into use when the sensor is powered on again, with the board or by
//! itself. Where nothing has been proved the networks in use stay for the next drive. When the
//! rehearsals of this drive show that they do harm, others or zero networks are stored at once.

use super::Flow;
use super::memory::UnitMemory;
use crate::compensator::Block;
use crate::model::Nets;
use crate::store::Step;

/// Interval between two checks for content to store, s.
pub(super) const CHECK_INTERVAL_S: f32 = 10.0;

/// Content of the store for the next power-on, stored or to be stored.
#[derive(Debug, Default)]
pub(in crate::app) struct Pending {
    /// The networks in use are to be stored, by command.
    pub commanded: bool,
    /// Number of records still to be stored by command, each of which erases older ones: the key
    /// has changed.
    pub renewals: u8,
    /// The configuration in use is the stored one, so weights may be stored beside it.
    pub config_stored: bool,
    /// Memory of the unit.
    pub unit_memory: UnitMemory,
    /// A record is being written, a piece at a time.
    pub begun: bool,
    /// Number of changes of the content to store, modulo 256: a record begun before one is dropped.
    pub edition: u8,
    /// Networks for the next power-on, if they are not those in use.
    next: Option<Nets>,
    /// Whether they are to be stored.
    waits: bool,
    /// Time until the next check, s.
    next_check_s: f32,
}

impl Pending {
    /// `config_stored`: the configuration in use is the stored one.
    pub fn new(config_stored: bool) -> Pending {
        Pending {
            config_stored,
            ..Pending::default()
        }
    }

    /// Networks that the learner has proved, or what it remembers, are to be stored.
    pub fn waits(&self) -> bool {
        self.waits || self.unit_memory.has_unsaved()
    }

    /// Networks for the next power-on are in the store, and are not zero.
    pub fn holds_next(&self) -> bool {
        let next = self.next.as_ref().filter(|_| !self.waits);
        next.is_some_and(|next| !next.same_images(&Nets::NONE))
    }

    /// Something is to be stored, and all of it is there.
    pub fn is_due(&self) -> bool {
        (self.commanded || self.waits()) && !self.unit_memory.is_requested()
    }

    /// The next renewal, or the one in progress, is the last one.
    pub fn is_last_renewal(&self) -> bool {
        self.renewals <= 1
    }

    /// Next step of storing.
    pub fn step(&self) -> Step {
        match (self.commanded, self.begun) {
            (true, _) if self.renewals > 0 => Step::Renew,
            (true, _) => Step::Save,
            (false, false) => Step::Begin,
            (false, true) => Step::GoOn,
        }
    }

    /// Networks to be stored, with networks `in_use`.
    pub fn nets<'n>(&'n self, in_use: &'n Nets) -> &'n Nets {
        self.next.as_ref().unwrap_or(in_use)
    }

    /// The board has stored [`Pending::nets`], or has failed.
    pub fn stored(&mut self, done: bool) {
        self.renewals = if done {
            self.renewals.saturating_sub(1)
        } else {
            0
        };
        (self.commanded, self.begun) = (self.renewals > 0, false);
        self.unit_memory.stored(done);
        if core::mem::take(&mut self.waits) && !done {
            self.next = None; // the last good record is still there
        }
    }

    /// The sensor is powered on: the networks for it come into use. If they wait to be stored, they
    /// still do.
    pub fn take_next(&mut self) -> Option<Nets> {
        self.drop_begun();
        self.next.take()
    }

    /// A configuration has come into use that is not stored.
    pub fn configuration_changed(&mut self) {
        self.config_stored = false;
        if self.waits() {
            self.forget_next();
        }
    }

    /// Other networks have come into use by command. They are stored by command too.
    pub fn forget_next(&mut self) {
        (self.next, self.waits) = (None, false);
        self.drop_begun();
        self.unit_memory.give_up();
    }

    fn drop_begun(&mut self) {
        self.begun = false;
        self.edition = self.edition.wrapping_add(1);
    }

    fn offer(&mut self, nets: Nets) {
        (self.next, self.waits) = (Some(nets), true);
    }
}

impl Flow<'_> {
    /// Called at the end of a block: whether something is to be stored.
    pub(super) fn retain(&mut self, block: &Block, block_s: f32) {
        let pending = &mut self.pending;
        pending.next_check_s -= block_s;
        let able =
            pending.config_stored && self.config.store && self.config.store_faults.newer.is_none();
        if pending.next_check_s > 0.0 || !able || pending.waits() {
            return;
        }
        pending.next_check_s = CHECK_INTERVAL_S;
        self.count_learnt(block, CHECK_INTERVAL_S);
        let withdraws = self
            .learning
            .port
            .answer()
            .is_some_and(|answer| answer.withdraws);
        let due = withdraws || self.pending.unit_memory.is_due();
        // with a live activation only what is remembered is stored
        let acts = self.session.acts_from_power_on(self.config.activation);
        let nets = acts && self.look_for_nets(due);
        if due || nets {
            self.ask_to_remember();
        }
    }

    /// Whether networks are to be stored: those that the learner has proved if a record is `due`,
    /// at once the first ones, and at once others than those in use where these do harm. What a
    /// lost navigator has taught is replaced by those in use, unless these do harm.
    #[inline(never)]
    fn look_for_nets(&mut self, due: bool) -> bool {
        let Some(answer) = self.learning.port.answer() else {
            return false;
        };
        let pending = &mut self.pending;
        let in_use = &self.config.nets;
        let first = pending.next.is_none() && in_use.same_images(&Nets::NONE);
        let harms = answer.stored_harms && pending.next.is_none() && !first;
        if answer.withdraws {
            let harmless = if answer.stored_harms {
                Nets::NONE
            } else {
                *in_use
            };
            if pending.next.is_some() {
                pending.offer(harmless);
            }
            return true;
        }
        match answer.next {
            Some(next) if due || first || harms => pending.offer(next.nets),
            None if harms => pending.offer(Nets::NONE),
            _ => return false,
        }
        true
    }
}
