//! What was counted.

use crate::kind::Kind;
use crate::protocol::Protocol;
use firmware::wire::framer::LONGEST;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Counts of one or more chunks.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Bytes read.
    pub bytes: u64,
    /// Undamaged frames sent.
    pub good: u64,
    /// ... and accepted in their place.
    pub found: u64,
    /// Pieces of damage.
    pub damaged: u64,
    /// Frames accepted that an undamaged piece of the stream happens to hold: damage can leave a
    /// frame whole, or the next frame can begin with what it lacks.
    pub whole: u64,
    /// How often a checksum was compared with bytes that were not sent so.
    pub trials: u64,
    /// Frames accepted that were not sent, by the kind of damage. Their checksum is right.
    pub accidents: BTreeMap<Kind, u64>,
    /// Undamaged frames that such an accident reached into, or that were joined to damage.
    pub lost: u64,
    /// The most of these in a row, without damage between them.
    pub lost_in_a_row: u64,
    /// The most bytes that had come after the end of a good frame before it was accepted.
    pub late_bytes: u64,
    /// ... and good frames among them.
    pub late_frames: u64,
}

impl Figures {
    /// All frames accepted that were not sent.
    pub fn accidents(&self) -> u64 {
        self.accidents.values().sum()
    }

    /// How many there should be if each comparison were right by chance.
    pub fn expected(&self, protocol: Protocol) -> f64 {
        self.trials as f64 / f64::from(protocol.bits()).exp2()
    }

    /// Puts both together.
    pub fn add(&mut self, other: &Figures) {
        self.bytes += other.bytes;
        self.good += other.good;
        self.found += other.found;
        self.damaged += other.damaged;
        self.whole += other.whole;
        self.trials += other.trials;
        for (kind, count) in &other.accidents {
            *self.accidents.entry(*kind).or_default() += count;
        }
        self.lost += other.lost;
        self.lost_in_a_row = self.lost_in_a_row.max(other.lost_in_a_row);
        self.late_bytes = self.late_bytes.max(other.late_bytes);
        self.late_frames = self.late_frames.max(other.late_frames);
    }

    /// What these counts break: a CRC lets through more than by chance; an accident costs more than
    /// two frames, where the checksum has more than 8 bits; a false start holds up what follows it
    /// for longer than the longest message.
    ///
    /// # Errors
    /// The sentence.
    pub fn check(&self, protocol: Protocol) -> Result<(), String> {
        let expected = self.expected(protocol);
        let most = expected + 6.0 * expected.sqrt() + 3.0;
        let accidents = self.accidents();
        if protocol.bits() == 32 && accidents > 0 {
            return Err(format!("{accidents} frames that nobody sent"));
        }
        if !protocol.is_sum() && accidents as f64 > most {
            return Err(format!(
                "{accidents} frames by chance, expected {expected:.1}"
            ));
        }
        if protocol.bits() > 8 && self.lost_in_a_row > 2 {
            return Err(format!("{} frames lost in a row", self.lost_in_a_row));
        }
        if self.late_bytes > LONGEST as u64 {
            return Err(format!("a frame came {} bytes late", self.late_bytes));
        }
        if self.lost + self.found != self.good {
            return Err("lost and found are not all".into());
        }
        Ok(())
    }
}
