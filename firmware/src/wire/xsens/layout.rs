//! Offsets of the values of a message. Its payload is a row of packets that name themselves:
//!
//! ```text
//! data identifier u16 | length u8 | data        the low four bits of the identifier: coordinates,
//! precision
//! ```

use crate::wire::field::take;

/// Precision in the two low bits of an identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Single precision, most significant byte first.
    Single,
    /// A number of 32 bits, of which 20 stand behind the point.
    Fixed,
}

/// Bytes before the data of a packet.
const HEADER: usize = 3;

/// Positions of the packets that are read or changed; 0: not there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layout {
    /// `DeltaQ`, `RateOfTurn`, `RateOfTurnHR`.
    pub gyro: [u8; 3],
    /// `DeltaV`, `Acceleration`, `AccelerationHR`.
    pub accel: [u8; 3],
    /// `SampleTimeFine`, u32.
    pub time: u8,
    /// `PacketCounter`, u16.
    pub counter: u8,
    /// `StatusWord`, u32.
    pub status: u8,
    /// Degrees Celsius.
    pub temperature: u8,
}

impl Layout {
    /// The layout of the packets in `from..to` of a message of at most 256 bytes. `None` where
    /// their lengths do not add up, or an identifier is not that of a packet.
    pub fn of(message: &[u8], from: usize, to: usize) -> Option<Layout> {
        let mut layout = Layout::default();
        let mut at = from;
        while at < to {
            let id = u16::from_be_bytes(take(message, at));
            let [length] = take(message, at + 2);
            let next = at + HEADER + usize::from(length);
            // type 0 and coordinates 12 do not exist
            if next > to || length == 0 || id & 0x07F0 == 0 || id & 0xC == 0xC {
                return None;
            }
            let [delta, rate, high_rate] = &mut layout.gyro;
            let [velocity, accel, high_accel] = &mut layout.accel;
            let place = match (id & 0xFFF0, length) {
                (0x8030, 16) => Some(delta),
                (0x8020, 12) => Some(rate),
                (0x8040, 12) => Some(high_rate),
                (0x4010, 12) => Some(velocity),
                (0x4020, 12) => Some(accel),
                (0x4040, 12) => Some(high_accel),
                (0x1060, 4) => Some(&mut layout.time),
                (0x1020, 2) => Some(&mut layout.counter),
                (0xE020, 4) => Some(&mut layout.status),
                (0x0810, 4) => Some(&mut layout.temperature),
                _ => None,
            };
            if let Some(place) = place {
                *place = at as u8;
            }
            at = next;
        }
        (at == to).then_some(layout)
    }

    /// Index of the best of the three values of a triad for navigation: increments, else rates.
    pub fn best(places: &[u8; 3]) -> Option<usize> {
        places.iter().position(|at| *at != 0)
    }
}

/// Precision of the packet at a position; `None`: a number of 48 bits, or double precision.
pub fn precision(message: &[u8], at: u8) -> Option<Precision> {
    let [_, low] = take(message, usize::from(at));
    match low & 3 {
        0 => Some(Precision::Single),
        1 => Some(Precision::Fixed),
        _ => None,
    }
}

/// Offset of the first of the three values of a packet: behind the scalar of a `DeltaQ`.
pub fn values(which: usize, gyro: bool, at: u8) -> usize {
    let scalar = if gyro && which == 0 { 4 } else { 0 };
    usize::from(at) + HEADER + scalar
}

/// Offset of the data of a packet.
pub fn data(at: u8) -> usize {
    usize::from(at) + HEADER
}
