//! Counts of read and accepted frames.

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
    /// Undamaged frames accepted at their position.
    pub found: u64,
    /// Pieces of damage.
    pub damaged: u64,
    /// Frames accepted that are undamaged by chance: damage can leave a frame intact, or the next
    /// frame can begin with the missing bytes.
    pub whole: u64,
    /// How often a checksum was compared with bytes that were not sent as a frame.
    pub trials: u64,
    /// Frames accepted that were not sent, by the kind of damage. Their checksum matches by chance.
    pub accidents: BTreeMap<Kind, u64>,
    /// Undamaged frames lost because such an accident overlapped them, or because damage joined
    /// them.
    pub lost: u64,
    /// Most of these in a row, without damage between them.
    pub lost_in_a_row: u64,
    /// Most bytes received after the end of a good frame before it was accepted.
    pub late_bytes: u64,
    /// Most good frames received meanwhile.
    pub late_frames: u64,
}

impl Figures {
    /// All frames accepted that were not sent.
    pub fn accidents(&self) -> u64 {
        self.accidents.values().sum()
    }

    /// Expected number of accidents, if checksums match by chance.
    pub fn expected(&self, protocol: Protocol) -> f64 {
        self.trials as f64 / f64::from(protocol.bits()).exp2()
    }

    /// Adds other counts.
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

    /// Checks the counts: a CRC must not accept more than by chance; an accident may cost at most
    /// two frames, where the checksum has more than 8 bits; a false start may delay the following
    /// bytes by at most the longest message.
    ///
    /// # Errors
    /// A sentence that names the broken rule.
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
