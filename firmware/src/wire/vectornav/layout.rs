//! Offsets of the fields of a message: its header names them by groups and bits.
//!
//! ```text
//! FA | groups u8 | one word u16 a group | fields, lowest group and bit first | CRC-16
//! ```
//!
//! Bit 7 of the groups says that another byte of groups follows, bit 15 of a word that another word
//! of the same group follows. A message with a field that is not in the tables here is not taken
//! for a message, since its length is not known.

use crate::wire::Scan;
use crate::wire::field::take;
use crate::wire::framer::LONGEST;
use serde::{Deserialize, Serialize};

/// Bytes of the CRC.
pub const TRAILER: usize = 2;
/// Known groups. Bit 12 is the third receiver's group, the only one in the second byte.
const GROUPS: u16 = 0x107F;

/// The row of the tables for the receivers' groups.
const RECEIVER: usize = 3;

/// Bytes of the fields by their bit; 0: no such field, or its length is in the message. Rows:
/// common, time, IMU, receiver, attitude and INS group.
static BYTES: [[u8; 15]; 6] = [
    [8, 8, 8, 12, 16, 12, 24, 12, 12, 24, 20, 28, 2, 4, 8],
    [8, 8, 8, 2, 8, 8, 8, 4, 4, 1, 0, 0, 0, 0, 0],
    [2, 12, 12, 12, 4, 4, 16, 12, 12, 12, 12, 2, 40, 0, 0],
    [8, 8, 2, 1, 1, 24, 24, 12, 12, 12, 4, 4, 2, 28, 0],
    [2, 12, 16, 36, 12, 12, 12, 12, 12, 12, 28, 24, 12, 4, 0],
    [2, 24, 24, 12, 12, 12, 12, 12, 12, 4, 4, 68, 64, 0, 0],
];

/// Places of the fields that are read, in [`Layout::positions`]; 0: all others.
mod place {
    pub const TIME_STARTUP: u8 = 1;
    pub const TIME_GPS: u8 = 2;
    pub const INS_STATUS: u8 = 3;
    pub const IMU_STATUS: u8 = 4;
    pub const VPE_STATUS: u8 = 5;
    pub const SATURATION: u8 = 6;
    pub const TEMPERATURE: u8 = 7;
    /// Fields of the common group, from here on.
    pub const MAG_PRES: u8 = 8;
    pub const RATE: u8 = 9;
    pub const ACCEL: u8 = 10;
    pub const IMU: u8 = 11;
    pub const DELTAS: u8 = 12;
    /// Fields of the IMU group, from here on.
    pub const UNCOMP_ACCEL: u8 = 13;
    pub const UNCOMP_GYRO: u8 = 14;
    pub const DELTA_THETA: u8 = 15;
    pub const DELTA_VEL: u8 = 16;
    pub const IMU_ACCEL: u8 = 17;
    pub const IMU_RATE: u8 = 18;
    pub const NUMBER: usize = 19;
}

/// [`place`] of the fields by their bit, in the rows of [`BYTES`].
static PLACES: [[u8; 15]; 6] = [
    [1, 2, 0, 0, 0, 9, 0, 0, 10, 11, 8, 12, 3, 0, 0],
    [1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    [4, 0, 13, 14, 7, 0, 15, 16, 0, 17, 18, 6, 0, 0, 0],
    [0; 15],
    [5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    [3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0],
];

/// Quantity of three numbers of a message, from the best for navigation on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `DeltaTheta`, degrees, and `DeltaVel`, m/s, since the last message.
    Increments = 0,
    /// `UncompGyro`, rad/s, and `UncompAccel`, m/s^2: without the biases of the sensor's own
    /// filter.
    Uncompensated = 1,
    /// `AngularRate`, rad/s, and `Accel`, m/s^2: with them subtracted.
    Compensated = 2,
}

/// Values that are the sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Values {
    /// Values with the sensor's own errors: increments, else uncompensated rates.
    Sensors,
    /// Compensated rates, with what the sensor's filter leaves of the errors.
    Filtered,
}

impl Values {
    /// The values for navigation.
    pub const USUAL: Values = Values::Sensors;

    fn has(self, quantity: Quantity) -> bool {
        (quantity == Quantity::Compensated) == (self == Values::Filtered)
    }
}

/// Three numbers of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Triad {
    /// Quantity that they measure.
    pub quantity: Quantity,
    /// Whether they are of the accelerometers, not the gyros.
    pub accel: bool,
    /// [`place`] of their field, and where they begin in it.
    field: (u8, u8),
}

const fn triad(accel: bool, quantity: Quantity, field: u8, offset: u8) -> Triad {
    Triad {
        quantity,
        accel,
        field: (field, offset),
    }
}

/// All triads that a message can have, in the order in which they stand in it.
pub static TRIADS: [Triad; 12] = [
    triad(false, Quantity::Compensated, place::RATE, 0),
    triad(true, Quantity::Compensated, place::ACCEL, 0),
    triad(true, Quantity::Uncompensated, place::IMU, 0),
    triad(false, Quantity::Uncompensated, place::IMU, 12),
    triad(false, Quantity::Increments, place::DELTAS, 4), // behind their time
    triad(true, Quantity::Increments, place::DELTAS, 16),
    triad(true, Quantity::Uncompensated, place::UNCOMP_ACCEL, 0),
    triad(false, Quantity::Uncompensated, place::UNCOMP_GYRO, 0),
    triad(false, Quantity::Increments, place::DELTA_THETA, 4), // behind their time
    triad(true, Quantity::Increments, place::DELTA_VEL, 0),
    triad(true, Quantity::Compensated, place::IMU_ACCEL, 0),
    triad(false, Quantity::Compensated, place::IMU_RATE, 0),
];

/// Samples a second of the sensor's own IMU. An output has one message for some of them.
const IMU_RATE: f64 = 800.0;
/// Numbers of them that divide it, from 800 to 5 messages a second.
static PERIODS: [u8; 15] = [1, 2, 4, 5, 8, 10, 16, 20, 25, 32, 40, 50, 80, 100, 160];

/// Messages a second by [`Layout::period`]; without it the configured ones.
pub fn rate(period: u8, configured: f64) -> f64 {
    let samples = PERIODS.get(usize::from(period).wrapping_sub(1));
    samples.map_or(configured, |samples| IMU_RATE / f64::from(*samples))
}

/// The places in [`TRIADS`] of the gyros' triads, best first.
static GYROS: [u8; 6] = [4, 8, 3, 7, 0, 11];
/// Fields of the accelerometers.
static ACCELS: [u8; 6] = [5, 9, 2, 6, 1, 10];

/// Positions of the fields of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Bytes of the message.
    pub len: usize,
    /// Offset of the fields.
    pub fields: usize,
    /// Offsets by [`place`]; 0: not there. See [`Layout::has_sample`].
    positions: [u8; place::NUMBER],
}

impl Layout {
    /// The layout of the message at the beginning of `bytes`, whether or not all of it is there.
    ///
    /// # Errors
    /// The result of [`crate::wire::Framing::scan`] instead.
    pub fn of(bytes: &[u8]) -> Result<Layout, Scan> {
        let (groups, mut words) = groups(bytes)?;
        let fields = data(bytes, groups, words)?;
        let mut layout = Layout {
            len: 0,
            fields,
            positions: [0; place::NUMBER],
        };
        let mut at = fields;
        let mut left = groups;
        while left != 0 {
            let row = match left.trailing_zeros() {
                6 | 12 => RECEIVER,
                group => group as usize,
            };
            left &= left - 1;
            let word = u16::from_le_bytes(take(bytes, words));
            words += 2;
            at = layout.walk(bytes, row, word, at)?;
            if word & 0x8000 != 0 {
                let word = u16::from_le_bytes(take(bytes, words));
                words += 2;
                at = walk_second(bytes, row, word, at)?;
            }
        }
        layout.len = at + TRAILER;
        Ok(layout)
    }

    /// Notes the fields of a group's first word from `at` on, and gives their end.
    #[inline(always)]
    fn walk(&mut self, bytes: &[u8], row: usize, word: u16, at: usize) -> Result<usize, Scan> {
        let (Some(sizes), Some(places)) = (BYTES.get(row), PLACES.get(row)) else {
            return Err(Scan::Garbage);
        };
        let (mut at, mut left) = (at, word & 0x7FFF);
        while left != 0 {
            let bit = left.trailing_zeros() as usize;
            left &= left - 1;
            let size = match sizes.get(bit) {
                Some(size @ 1..) => usize::from(*size),
                _ if row == RECEIVER && bit == 14 => satellites(bytes, at, 2, 8)?,
                _ => return Err(Scan::Garbage),
            };
            let place = places.get(bit).copied().unwrap_or_default();
            if let Some(position) = self.positions.get_mut(usize::from(place)) {
                *position = at as u8;
            }
            at += size;
        }
        Ok(at)
    }

    /// Position of a field; 0: it is not there.
    fn position(&self, place: u8) -> usize {
        let position = self.positions.get(usize::from(place));
        position.copied().map_or(0, usize::from)
    }

    /// Position of a triad; 0: it is not there.
    pub fn at(&self, triad: &Triad) -> usize {
        let (place, offset) = triad.field;
        match self.position(place) {
            0 => 0,
            at => at + usize::from(offset),
        }
    }

    /// Nanoseconds since the start of the sensor, u64, else nanoseconds of GPS time.
    pub fn time(&self) -> usize {
        match self.position(place::TIME_STARTUP) {
            0 => self.position(place::TIME_GPS),
            at => at,
        }
    }

    /// `InsStatus`
    pub fn ins_status(&self) -> usize {
        self.position(place::INS_STATUS)
    }

    /// `ImuStatus`
    pub fn imu_status(&self) -> usize {
        self.position(place::IMU_STATUS)
    }

    /// `VpeStatus`
    pub fn vpe_status(&self) -> usize {
        self.position(place::VPE_STATUS)
    }

    /// `SensSat`
    pub fn saturation(&self) -> usize {
        self.position(place::SATURATION)
    }

    /// Degrees Celsius, f32.
    pub fn temperature(&self) -> usize {
        let fields = (
            self.position(place::TEMPERATURE),
            self.position(place::MAG_PRES),
        );
        match fields {
            (0, 0) => 0,
            (0, magnetic) => magnetic + 12,
            (at, _) => at,
        }
    }

    /// The triad that is read as the sample's: of the configured values, the best quantity that the
    /// message has.
    pub fn best(&self, values: Values, accel: bool) -> Option<&'static Triad> {
        let best = if accel { &ACCELS } else { &GYROS };
        let mut triads = best.iter().filter_map(|at| TRIADS.get(usize::from(*at)));
        triads.find(|triad| values.has(triad.quantity) && self.at(triad) != 0)
    }

    /// `DeltaTime` of the increments that are the sample, f32, s. It stands before `DeltaTheta`.
    pub fn delta_time(&self) -> Option<usize> {
        let triad = self.best(Values::Sensors, false)?;
        (triad.quantity == Quantity::Increments).then(|| self.at(triad).saturating_sub(4))
    }

    /// The time over which the message's increments were taken, as the place in `PERIODS` from 1
    /// on; 0: it has none, or one that is not there.
    #[inline(never)] // not in the code of all formats
    pub fn period(&self, bytes: &[u8]) -> u8 {
        let Some(at) = self.delta_time() else {
            return 0;
        };
        let samples = f32::from_le_bytes(take(bytes, at)) * IMU_RATE as f32;
        if samples < 0.9 {
            return 0; // no time at all: the usual frame waits for this
        }
        let near = |of: &u8| (samples - f32::from(*of)).abs() < 0.02 * f32::from(*of);
        let place = PERIODS.iter().position(near);
        place.map_or(0, |place| place as u8 + 1) // 15 at most
    }

    /// Whether the message has a sample, at least of the gyros. A longer message than a framer
    /// holds has none, so that all positions fit into a byte.
    pub fn has_sample(&self, values: Values) -> bool {
        self.len <= LONGEST && self.best(values, false).is_some()
    }
}

/// The groups, and where their words begin.
fn groups(bytes: &[u8]) -> Result<(u16, usize), Scan> {
    const SHORTEST: usize = 4;
    match bytes.first() {
        None | Some(0xFA) => {}
        Some(_) => return Err(Scan::Garbage),
    }
    if bytes.len() < SHORTEST {
        return Err(Scan::Partial(SHORTEST));
    }
    let [first, second] = take(bytes, 1);
    let (groups, words) = if first & 0x80 == 0 {
        (u16::from(first), 2)
    } else {
        (u16::from_le_bytes([first & 0x7F, second]), 3)
    };
    if groups == 0 || groups & !GROUPS != 0 {
        return Err(Scan::Garbage);
    }
    Ok((groups, words))
}

/// Offset of the fields: behind the words of all groups.
fn data(bytes: &[u8], groups: u16, words: usize) -> Result<usize, Scan> {
    let mut at = words;
    for _ in 0..groups.count_ones() {
        // a second word is the last one
        for last in [false, true] {
            let next = at + 2;
            if bytes.len() < next {
                return Err(Scan::Partial(next));
            }
            let word = u16::from_le_bytes(take(bytes, at));
            at = next;
            if word == 0 || (last && word & 0x8000 != 0) {
                return Err(Scan::Garbage);
            }
            if word & 0x8000 == 0 {
                break;
            }
        }
    }
    Ok(at)
}

/// The end of the fields of a group's second word, which only receivers have: raw measurements,
/// status, height.
#[cold]
fn walk_second(bytes: &[u8], row: usize, word: u16, at: usize) -> Result<usize, Scan> {
    if row != RECEIVER || word & !7 != 0 {
        return Err(Scan::Garbage);
    }
    let mut at = at;
    if word & 1 != 0 {
        at += satellites(bytes, at + 10, 12, 28)?;
    }
    Ok(at + usize::from(word & 2) + 2 * usize::from(word & 4))
}

/// Length of a field whose byte at `at` gives the number of blocks behind the `fixed` part, bytes.
#[cold]
fn satellites(bytes: &[u8], at: usize, fixed: usize, each: usize) -> Result<usize, Scan> {
    let number = bytes.get(at).ok_or(Scan::Partial(at + 1))?;
    Ok(fixed + each * usize::from(*number))
}
