//! Networks that are stored for the next power-on of the sensor (activation `NextPowerOn`).
//!
//! In mode learn the networks in use correct all samples of a drive and stay as they are. Networks
//! that the learner has proved meanwhile are stored beside them and come into use when the sensor
//! is powered on again, with the board or by itself. A learner that has proved nothing leaves the
//! store as it is. When the rehearsals of this drive show that the networks in use do harm, zero
//! networks are stored. The learner's memory of the unit is stored beside them ([`super::memory`]).

use super::Flow;
use super::memory::Memo;
use crate::compensator::Block;
use crate::model::Nets;
use crate::store::Step;

/// Interval between two checks for content to store, s.
pub(super) const LOOK_S: f32 = 10.0;
/// Settled networks are stored while the vehicle stands, since then the least is lost if a frame
/// leaves late; or at the latest after this time, s.
const LATEST_S: f32 = 300.0;
/// Least time between two records, s: flash wears, and drives last for hours.
const PAUSE_S: f32 = 600.0;

/// Content of the store for the next power-on, stored or to be stored.
#[derive(Debug, Default)]
pub(in crate::app) struct Keep {
    /// The networks in use are to be stored, by command.
    pub commanded: bool,
    /// Number of records still to be stored by command, each of which erases older ones: the key
    /// has changed.
    pub renewals: u8,
    /// The configuration in use is the stored one, so weights may be stored beside it.
    pub beside: bool,
    /// Memory of the unit.
    pub memo: Memo,
    /// A record is being written, a piece at a time.
    pub begun: bool,
    /// Changes with what is to be stored: what was begun before is not gone on with.
    pub edition: u8,
    /// Networks for the next power-on, if they are not those in use.
    next: Option<Nets>,
    /// Whether they are to be stored.
    waits: bool,
    /// Output of the networks when they were taken, rad/s and m/s2.
    output: [[f32; 3]; 2],
    /// Until the next look, and until something may be stored again, s.
    look_s: f32,
    pause_s: f32,
    /// Time for which the correction that the learner has found has been settled, s.
    settled_s: f32,
}

impl Keep {
    /// `beside`: the configuration in use is the stored one.
    pub fn new(beside: bool) -> Keep {
        Keep {
            beside,
            ..Keep::default()
        }
    }

    /// Networks that the learner has proved, or what it remembers, are to be stored.
    pub fn waits(&self) -> bool {
        self.waits || self.memo.waits()
    }

    /// Something is to be stored, and all of it is there.
    pub fn is_due(&self) -> bool {
        (self.commanded || self.waits()) && !self.memo.is_asked()
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

    /// The board has stored [`Keep::nets`], or has failed.
    pub fn stored(&mut self, done: bool) {
        self.renewals = if done {
            self.renewals.saturating_sub(1)
        } else {
            0
        };
        (self.commanded, self.begun) = (self.renewals > 0, false);
        self.memo.stored(done);
        if core::mem::take(&mut self.waits) && !done {
            self.next = None; // the last good record is still there
        }
    }

    /// The sensor is powered on: what the store holds comes into use.
    pub fn take_next(&mut self) -> Option<Nets> {
        let held = !core::mem::take(&mut self.waits);
        self.drop_begun();
        (self.settled_s, self.pause_s) = (0.0, 0.0);
        self.next.take().filter(|_| held)
    }

    /// Another configuration has come into use, which is not stored.
    pub fn alone(&mut self) {
        self.beside = false;
        if self.waits() {
            self.forget_next();
        }
    }

    /// Other networks have come into use by command. They are stored by command too.
    pub fn forget_next(&mut self) {
        (self.next, self.waits) = (None, false);
        self.drop_begun();
        self.memo.give_up();
    }

    fn drop_begun(&mut self) {
        self.begun = false;
        self.edition = self.edition.wrapping_add(1);
    }

    fn offer(&mut self, nets: Nets, output: [[f32; 3]; 2]) {
        (self.next, self.output) = (Some(nets), output);
        (self.waits, self.pause_s) = (true, PAUSE_S);
    }
}

impl Flow<'_> {
    /// Called at the end of a block: whether something is to be stored.
    pub(super) fn retain(&mut self, block: &Block, block_s: f32) {
        let keep = &mut self.pending;
        keep.pause_s = (keep.pause_s - block_s).max(0.0);
        keep.look_s -= block_s;
        let able = keep.beside && self.config.store && self.config.found.newer.is_none();
        if keep.look_s <= 0.0 && able && !keep.waits() {
            keep.look_s = LOOK_S;
            self.count_learnt(block, LOOK_S);
            // with a live activation only what is remembered is stored
            let nets = self.session.acts_from_power_on(self.config.activation)
                && self.look_for_winner(block);
            let stands = self.learning.still_s() >= super::learning::STANDS_S;
            self.take_down(stands, nets);
        }
    }

    /// Whether networks are to be stored.
    #[inline(never)]
    fn look_for_winner(&mut self, block: &Block) -> bool {
        let Some(answer) = self.learning.port.answer() else {
            return false;
        };
        let keep = &mut self.pending;
        let harms = answer.stored_harms;
        if harms && keep.next.is_none() && !self.config.nets.same_images(&Nets::NONE) {
            keep.offer(Nets::NONE, [[0.0; 3]; 2]);
            return true;
        }
        let Some(winner) = answer.next.filter(|winner| winner.settled) else {
            keep.settled_s = 0.0;
            return false;
        };
        keep.settled_s += LOOK_S;
        let stands = answer.still_s >= super::learning::STANDS_S;
        // of what is in use it is known what its networks say now
        let held = match keep.next {
            Some(_) => keep.output,
            None => block.network_output,
        };
        let moved = (winner.estimate.as_flattened().iter())
            .zip(held.as_flattened())
            .zip(winner.sigma.as_flattened())
            .any(|((now, held), sigma)| (now - held).abs() > *sigma);
        let due = moved && keep.pause_s <= 0.0 && (stands || keep.settled_s >= LATEST_S);
        if due {
            keep.offer(winner.nets, winner.estimate);
        }
        due
    }
}
