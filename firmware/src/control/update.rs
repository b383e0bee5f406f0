//! Updates of the firmware (`crate::update`): why one is refused, and what is reported.

use serde::{Deserialize, Serialize};

/// Why an update is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// It does not begin as an image that this firmware knows.
    Header,
    /// It is signed with another key than the device expects, or was changed afterwards.
    Signature,
    /// It is of another board.
    Board,
    /// It runs at another place of the flash than the free slot.
    Slot,
    /// It is longer than the slot.
    Length,
    /// It is older than the firmware that runs, and that was not asked for.
    Older,
    /// The firmware that runs is itself on trial.
    Trial,
    /// No update was begun.
    NotBegun,
    /// A piece does not follow the one before it; how many bytes have been received is given.
    Order(u32),
    /// What the flash holds is not what was signed.
    Digest,
    /// The flash does not erase, or does not keep what is written.
    Flash,
}

/// The image that runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Running {
    /// A probe has flashed it.
    #[default]
    Flashed,
    /// An update on trial: until it is confirmed, the next start goes back to the one before.
    Trial,
    /// An update that has proved itself.
    Confirmed,
}

/// Progress of an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Step {
    /// None was begun since start.
    #[default]
    Idle,
    /// Pieces are awaited.
    Receives,
    /// It is whole and checked; the next start tries it.
    Ready,
}

/// State of the updates, as reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Report {
    /// The image that runs.
    pub running: Running,
    /// Address of the free slot, and the longest image for it, bytes.
    pub slot: u32,
    /// See above.
    pub room: u32,
    /// The first bytes of the public key (ed25519) that images must be signed for.
    pub signer: u64,
    /// Progress of an update.
    pub step: Step,
    /// The first bytes of the signed digest of the update in progress.
    pub digest: u64,
    /// Bytes of it received.
    pub received: u32,
    /// Version of an update that was tried and has not been confirmed; it is in the free slot.
    pub failed: Option<[u16; 3]>,
}
