//! The formats of GNSS receivers. Their frames are fixes and hold no inertial values.

use super::{Framing, Scan, ubx};

/// What a receiver speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReceiverFormat {
    /// [`ubx`]
    Ubx,
}

impl ReceiverFormat {
    /// All of them.
    pub const ALL: [ReceiverFormat; 1] = [ReceiverFormat::Ubx];
}

impl Framing for ReceiverFormat {
    #[inline(always)]
    fn scan(self, bytes: &[u8]) -> Scan {
        match self {
            ReceiverFormat::Ubx => ubx::scan(bytes),
        }
    }
}

#[cfg(test)]
impl super::examples::Examples for ReceiverFormat {
    fn example(self, n: u8) -> std::vec::Vec<u8> {
        ubx::tests::example(n)
    }

    fn remade(self, frame: &[u8]) -> Result<std::vec::Vec<u8>, super::Error> {
        ubx::Pvt::parse(frame).map(|pvt| pvt.emit().to_vec())
    }
}
