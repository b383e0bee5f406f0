//! Which requests need a key, and what is said of the key over the link.

use super::Request;
use super::key::{Key, Secret};
use serde::{Deserialize, Serialize};

/// Key state that [`Request::Provision`] sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Provision {
    /// From now on a key is needed. To a device that has one already, the new secret is sent veiled
    /// ([`Secret::veiled`]).
    Secret(Secret),
    /// No key is needed, by choice.
    OpenByChoice,
}

/// Whether a key is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Protection {
    /// No: nobody has chosen yet.
    Unprovisioned,
    /// No, by choice.
    OpenByChoice,
    /// Yes.
    Keyed,
}

impl From<&Key> for Protection {
    fn from(key: &Key) -> Protection {
        match key {
            Key::Unprovisioned => Protection::Unprovisioned,
            Key::OpenByChoice => Protection::OpenByChoice,
            Key::Secret(_) => Protection::Keyed,
        }
    }
}

/// The answer to [`Request::GetSecurity`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Security {
    /// Whether a key is needed.
    pub protection: Protection,
    /// The board has given random bytes. Without them a challenge may come again after a restart,
    /// and with it a recorded session.
    pub random: bool,
    /// Sealed requests refused since power-on because the secret was another one or they were
    /// forged; saturates.
    pub forged: u32,
    /// Records that may be stored now, one after the other.
    pub stores: u16,
}

impl Request<'_> {
    /// Whether the request changes what leaves the device, what it learns, or what it stores. Such
    /// a request needs the key where there is one. To hold the black box ends its recording, so who
    /// may not release it may not hold it either.
    #[must_use]
    pub fn changes(&self) -> bool {
        match self {
            Request::SetMode(_)
            | Request::WriteImage { .. }
            | Request::CommitImage { .. }
            | Request::Reference(_)
            | Request::Alignment(_)
            | Request::StoreImage
            | Request::CommitLearnt
            | Request::WriteConfiguration { .. }
            | Request::CommitConfiguration { .. }
            | Request::Heading(_)
            | Request::WheelSpeed(_)
            | Request::Record(_)
            | Request::Provision(_)
            | Request::BeginUpdate { .. }
            | Request::WriteUpdate { .. }
            | Request::FinishUpdate
            | Request::Restart => true,
            Request::GetVersion
            | Request::GetHealth
            | Request::ReadImage { .. }
            | Request::GetCounters
            | Request::GetEstimate
            | Request::ReadLearnt { .. }
            | Request::ReadConfiguration { .. }
            | Request::GetBoard
            | Request::GetAntenna
            | Request::GetReceiver
            | Request::GetMemory
            | Request::GetStore
            | Request::GetReset
            | Request::GetRecording
            | Request::ReadRecording { .. }
            | Request::GetSecurity
            | Request::GetChallenge
            | Request::GetSolution
            | Request::GetTrials
            | Request::GetProgress
            | Request::GetUpdate
            | Request::GetTimes => false,
        }
    }
}
