//! Events, in a word each.

use super::memory::EVENT_LEN;
use crate::wire::field::{put, take};

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum EventKind {
    /// The device started: 0 with blank memory, 1 after a reset that the memory survived.
    Start = 1,
    /// The fault bits changed to this.
    Faults,
    /// Another mode: its number in [`crate::control::Mode`].
    Mode,
    /// Another state of the application: its number in [`super::AppState`].
    Stage,
    /// The sensor restarted: how often so far.
    Restart,
    /// The navigation computer's alignment: 1 begun, 2 finished.
    Alignment,
    /// Other networks are in use: CRC-32 of the gyro network's first weights as bits.
    Nets,
    /// A fix of the receiver: its time of validity, ms. Only the first after ten seconds without.
    Fix,
    /// Another configuration has come into use.
    Configured,
    /// The box was released.
    Released,
    /// A rest from which the gyros are learnt: 1 begun, 0 over.
    Rest,
}

const ALL: [EventKind; 11] = [
    EventKind::Start,
    EventKind::Faults,
    EventKind::Mode,
    EventKind::Stage,
    EventKind::Restart,
    EventKind::Alignment,
    EventKind::Nets,
    EventKind::Fix,
    EventKind::Configured,
    EventKind::Released,
    EventKind::Rest,
];

/// One event: number u32, time u32 in ms, value u32, what u8, 0, and the sum of these 14 bytes u16.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// Number of the event since the memory was blank.
    pub number: u32,
    /// Milliseconds since the device's start, modulo 2^32.
    pub at_ms: u32,
    /// See [`EventKind`].
    pub value: u32,
    /// Kind of the event.
    pub what: EventKind,
}

impl Event {
    /// Encodes the event.
    #[must_use]
    pub fn bytes(&self) -> [u8; EVENT_LEN] {
        let mut bytes = [0; EVENT_LEN];
        put(&mut bytes, 0, self.number.to_le_bytes());
        put(&mut bytes, 4, self.at_ms.to_le_bytes());
        put(&mut bytes, 8, self.value.to_le_bytes());
        put(&mut bytes, 12, [self.what as u8]);
        let sum = sum(&bytes);
        put(&mut bytes, 14, sum.to_le_bytes());
        bytes
    }

    /// Decodes an event; `None` where the bytes are none.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Event> {
        let bytes: &[u8; EVENT_LEN] = bytes.first_chunk()?;
        let [what] = take(bytes, 12);
        let what = ALL.into_iter().find(|known| *known as u8 == what)?;
        (u16::from_le_bytes(take(bytes, 14)) == sum(bytes)).then_some(Event {
            number: u32::from_le_bytes(take(bytes, 0)),
            at_ms: u32::from_le_bytes(take(bytes, 4)),
            value: u32::from_le_bytes(take(bytes, 8)),
            what,
        })
    }
}

fn sum(bytes: &[u8; EVENT_LEN]) -> u16 {
    let counted = bytes.iter().take(14);
    counted.fold(0x5A5A, |sum, byte| {
        sum.rotate_left(3).wrapping_add(u16::from(*byte))
    })
}
