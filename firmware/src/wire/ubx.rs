//! u-blox UBX-NAV-PVT: the position and velocity fixes that the weights are learnt from; with them
//! NAV-COV, NAV-RELPOSNED and older or more precise messages ([`more`]).
//!
//! Source: the u-blox interface description as `pyubx2` and gpsd implement it. `pyubx2` 1.4.0 made
//! the golden message. Little-endian:
//!
//! ```text
//! B5 62 | class | id | payload length u16 | payload | Fletcher-8 a, b over class to payload
//! ```
//!
//! Crates for UBX exist. It is written here because only eleven messages of fixed length are
//! needed, the framer does the framing, and the receiver simulator needs a message that can be
//! written. All other messages are ignored.

pub mod more;

use super::checksum::fletcher8;
use super::field::{Mark, mark, put, take};
use super::receiver::epoch::{Head, Time, Values};
use super::{Error, Scan, exactly};
use crate::fix::{Fix, NOT_MEASURED, OBSERVATIONS, Position};
use crate::units::DEGREE;

/// Bytes of a NAV-PVT message.
pub const PVT_LEN: usize = 6 + PAYLOAD + 2;
const PAYLOAD: usize = 92;
/// Bytes of the payload of a u-blox 7, which lacks the fields from the vehicle's heading on.
const OLDER: usize = 84;
/// Sync characters, class, id, payload length.
const PVT_HEADER: [u8; 6] = [0xB5, 0x62, 0x01, 0x07, PAYLOAD as u8, 0];

/// Least standard deviations of position (m) and velocity (m/s): the message's own rounding.
const LEAST_SIGMA: [f32; 2] = [0.005, 0.002];

/// The kinds that every receiver sends in the first epoch: NAV-PVT.
pub const USUAL: u16 = 1;

/// Scans for a message at the beginning of `bytes`. NAV-PVT and those of [`more`] are frames.
#[inline(never)]
pub fn scan(bytes: &[u8]) -> Scan {
    match mark(bytes, &[0xB5, 0x62]) {
        Mark::No => return Scan::Garbage,
        Mark::Whole if bytes.len() >= 6 => {}
        Mark::Whole => return Scan::Partial(6),
        Mark::Part => return Scan::Partial(2),
    }
    let payload = usize::from(u16::from_le_bytes(take(bytes, 4)));
    let is_pvt = take(bytes, 2) == [0x01, 0x07];
    if is_pvt && ![PAYLOAD, OLDER].contains(&payload) {
        return Scan::BadChecksum; // known at once: do not wait for a length that cannot be
    }
    let len = payload + 8;
    match bytes.get(..len) {
        None => Scan::Partial(len),
        Some(frame) if !sum_is_right(frame) => Scan::BadChecksum,
        Some(_) if is_pvt || more::is_read(take(bytes, 2), payload) => Scan::Frame(len),
        Some(_) => Scan::Other(len),
    }
}

/// Class to payload, and the two bytes after it.
fn sum_is_right(frame: &[u8]) -> bool {
    let at = frame.len().saturating_sub(2);
    fletcher8(frame.get(2..at).unwrap_or_default()) == take(frame, at)
}

/// Kind and time of a message that a framer has checked; `None` if it is not read.
pub(super) fn head(frame: &[u8]) -> Option<Head> {
    if is_pvt(frame) {
        let time = u32::from_le_bytes(take(frame, PVT_HEADER.len()));
        return Some(Head {
            kind: 0,
            time: Time::Week(time),
        });
    }
    more::head(frame)
}

fn is_pvt(frame: &[u8]) -> bool {
    take(frame, 2) == [0x01, 0x07]
}

/// Writes the values of such a message.
#[inline(never)]
pub(super) fn read(frame: &[u8], values: &mut Values) {
    let Some(pvt) = Pvt::over(frame) else {
        return more::read(frame, values);
    };
    if pvt.is_good() {
        let fix = pvt.to_fix(0);
        (values.position, values.velocity) = (fix.position, fix.velocity);
        (values.own, values.assumed) = ([0.0; OBSERVATIONS], fix.sigmas);
    } else {
        values.refused = true;
    }
}

/// A navigation solution. Units are the message's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pvt {
    /// GPS time of week, ms.
    pub time_of_week: u32,
    /// UTC.
    pub year: u16,
    /// Month, day, hour, minute, second (UTC).
    pub month_to_second: [u8; 5],
    /// Bit 0 date, 1 time, 2 fully resolved, 3 magnetic declination.
    pub valid: u8,
    /// Time accuracy estimate, ns.
    pub time_accuracy: u32,
    /// Fraction of the second, ns, -10^9 to 10^9.
    pub nanosecond: i32,
    /// 0 none, 1 dead reckoning, 2 two-dimensional, 3 three-dimensional, 4 with dead reckoning, 5
    /// time only.
    pub fix: u8,
    /// Bit 0: fix within the receiver's limits; 1: differential; 6-7: carrier phase.
    pub flags: u8,
    /// Confirmations of date and time.
    pub flags2: u8,
    /// Satellites used.
    pub satellites: u8,
    /// 1e-7 degree.
    pub longitude: i32,
    /// 1e-7 degree.
    pub latitude: i32,
    /// Above the ellipsoid, mm.
    pub height: i32,
    /// Above mean sea level, mm.
    pub height_sea: i32,
    /// Horizontal accuracy estimate, mm.
    pub horizontal_accuracy: u32,
    /// Vertical accuracy estimate, mm.
    pub vertical_accuracy: u32,
    /// North, east, down, mm/s.
    pub velocity: [i32; 3],
    /// mm/s
    pub ground_speed: i32,
    /// Heading of motion, 1e-5 degree.
    pub heading: i32,
    /// Speed accuracy estimate, mm/s.
    pub speed_accuracy: u32,
    /// Heading accuracy estimate, 1e-5 degree.
    pub heading_accuracy: u32,
    /// Position dilution of precision, 0.01.
    pub pdop: u16,
    /// flags3 and reserved bytes, as they came.
    pub flags3: [u8; 6],
    /// Heading of the vehicle, 1e-5 degree.
    pub vehicle_heading: i32,
    /// Magnetic declination, 0.01 degree.
    pub declination: i16,
    /// Accuracy of the declination, 0.01 degree.
    pub declination_accuracy: u16,
}

impl Pvt {
    /// Read a NAV-PVT message.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Header`] or [`Error::Checksum`].
    pub fn parse(frame: &[u8]) -> Result<Pvt, Error> {
        exactly(frame, scan)?;
        Pvt::over(frame).ok_or(Error::Header)
    }

    /// Reads a message that a framer has checked; `None` if it is another one.
    pub(super) fn over(frame: &[u8]) -> Option<Pvt> {
        if !is_pvt(frame) {
            return None;
        }
        // a field that it does not have reads zero
        let end = frame.len().saturating_sub(2);
        let payload = frame.get(PVT_HEADER.len()..end).unwrap_or_default();
        let [fix, flags, flags2, satellites] = take(payload, 20);
        let [valid] = take(payload, 11);
        let signed = |at| i32::from_le_bytes(take(payload, at));
        let unsigned = |at| u32::from_le_bytes(take(payload, at));
        let short = |at| u16::from_le_bytes(take(payload, at));
        Some(Pvt {
            time_of_week: unsigned(0),
            year: short(4),
            month_to_second: take(payload, 6),
            valid,
            time_accuracy: unsigned(12),
            nanosecond: signed(16),
            fix,
            flags,
            flags2,
            satellites,
            longitude: signed(24),
            latitude: signed(28),
            height: signed(32),
            height_sea: signed(36),
            horizontal_accuracy: unsigned(40),
            vertical_accuracy: unsigned(44),
            velocity: [signed(48), signed(52), signed(56)],
            ground_speed: signed(60),
            heading: signed(64),
            speed_accuracy: unsigned(68),
            heading_accuracy: unsigned(72),
            pdop: short(76),
            flags3: take(payload, 78),
            vehicle_heading: signed(84),
            declination: i16::from_le_bytes(take(payload, 88)),
            declination_accuracy: short(90),
        })
    }

    /// The whole message.
    pub fn emit(&self) -> [u8; PVT_LEN] {
        let mut frame = [0; PVT_LEN];
        put(&mut frame, 0, PVT_HEADER);
        let at = |offset| PVT_HEADER.len() + offset;
        put(&mut frame, at(0), self.time_of_week.to_le_bytes());
        put(&mut frame, at(4), self.year.to_le_bytes());
        put(&mut frame, at(6), self.month_to_second);
        put(&mut frame, at(11), [self.valid]);
        put(&mut frame, at(12), self.time_accuracy.to_le_bytes());
        put(&mut frame, at(16), self.nanosecond.to_le_bytes());
        let fix = [self.fix, self.flags, self.flags2, self.satellites];
        put(&mut frame, at(20), fix);
        put(&mut frame, at(24), self.longitude.to_le_bytes());
        put(&mut frame, at(28), self.latitude.to_le_bytes());
        put(&mut frame, at(32), self.height.to_le_bytes());
        put(&mut frame, at(36), self.height_sea.to_le_bytes());
        put(&mut frame, at(40), self.horizontal_accuracy.to_le_bytes());
        put(&mut frame, at(44), self.vertical_accuracy.to_le_bytes());
        for (axis, velocity) in self.velocity.into_iter().enumerate() {
            put(&mut frame, at(48 + 4 * axis), velocity.to_le_bytes());
        }
        put(&mut frame, at(60), self.ground_speed.to_le_bytes());
        put(&mut frame, at(64), self.heading.to_le_bytes());
        put(&mut frame, at(68), self.speed_accuracy.to_le_bytes());
        put(&mut frame, at(72), self.heading_accuracy.to_le_bytes());
        put(&mut frame, at(76), self.pdop.to_le_bytes());
        put(&mut frame, at(78), self.flags3);
        put(&mut frame, at(84), self.vehicle_heading.to_le_bytes());
        put(&mut frame, at(88), self.declination.to_le_bytes());
        put(&mut frame, at(90), self.declination_accuracy.to_le_bytes());
        let sum = fletcher8(frame.get(2..PVT_LEN - 2).unwrap_or_default());
        put(&mut frame, PVT_LEN - 2, sum);
        frame
    }

    /// The solution as a fix that arrived at this time.
    ///
    /// The receiver's horizontal accuracy is that of two axes and its speed accuracy that of three.
    pub fn to_fix(&self, arrived_us: u64) -> Fix {
        Fix {
            position: Position {
                latitude: f64::from(self.latitude) * (1e-7 * DEGREE),
                longitude: f64::from(self.longitude) * (1e-7 * DEGREE),
                height: f64::from(self.height) * 1e-3,
            },
            velocity: self.velocity.map(|v| f64::from(v) * 1e-3),
            sigmas: self.sigmas(),
            time_ms: self.time_of_week,
            arrived_us,
            ..Fix::EMPTY
        }
    }

    /// Standard deviations along an axis. An accuracy of zero means that the receiver gives none.
    fn sigmas(&self) -> [f32; OBSERVATIONS] {
        let sigma = |mm: u32, share: f32, least: f32| match mm {
            0 => NOT_MEASURED,
            mm => (mm as f32 * 1e-3 * share).max(least),
        };
        let [least_m, least_mps] = LEAST_SIGMA;
        let root_2 = core::f32::consts::FRAC_1_SQRT_2;
        let [h, v] = match self.flags3[0] & 1 {
            0 => [
                sigma(self.horizontal_accuracy, root_2, least_m),
                sigma(self.vertical_accuracy, 1.0, least_m),
            ],
            _ => [NOT_MEASURED; 2], // invalidLlh; reserved and 0 in older versions
        };
        let s = sigma(self.speed_accuracy, 0.577_350_3, least_mps);
        [h, h, v, s, s, s]
    }

    /// Whether the receiver vouches for a three-dimensional fix (flag gnssFixOK, fix type 3 or 4).
    pub fn is_good(&self) -> bool {
        self.flags & 1 != 0 && matches!(self.fix, 3 | 4)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::field::hex;
    use super::*;

    /// An example with a start mark in its data.
    pub(in crate::wire) fn example(n: u8) -> std::vec::Vec<u8> {
        let pvt = Pvt {
            time_of_week: u32::from(n),
            longitude: 0x0162_B562,
            ..Default::default()
        };
        pvt.emit().to_vec()
    }

    pub(in crate::wire) fn remade(frame: &[u8]) -> Result<std::vec::Vec<u8>, Error> {
        Pvt::parse(frame).map(|pvt| pvt.emit().to_vec())
    }

    const GOLDEN: [u8; PVT_LEN] = hex(
        "b56201075c0015cd5b07ea070b150a11240719000000c01dfeff03030011797528fbb15d731f40e201006800ffff52030000b00400002efbffff2e160000a5ffffffb31600006e0b9c003c000000f049020085000a0000000000712ffcff83ff32008c38",
    );

    #[test]
    fn golden_message_reads_and_is_made_again() {
        assert_eq!(scan(&GOLDEN), Scan::Frame(PVT_LEN));
        let pvt = Pvt::parse(&GOLDEN).unwrap();
        assert_eq!(pvt.time_of_week, 123_456_789);
        assert_eq!(
            (pvt.year, pvt.month_to_second),
            (2026, [11, 21, 10, 17, 36])
        );
        assert_eq!((pvt.latitude, pvt.longitude), (527_654_321, -81_234_567));
        assert_eq!((pvt.height, pvt.height_sea), (123_456, -65_432));
        assert_eq!(
            (pvt.horizontal_accuracy, pvt.vertical_accuracy),
            (850, 1200)
        );
        assert_eq!(pvt.velocity, [-1234, 5678, -91]);
        assert_eq!((pvt.ground_speed, pvt.heading), (5811, 10_226_542));
        assert_eq!(
            (pvt.speed_accuracy, pvt.pdop, pvt.satellites),
            (60, 133, 17)
        );
        assert_eq!((pvt.declination, pvt.declination_accuracy), (-125, 50));
        assert!(pvt.is_good());
        assert_eq!(pvt.emit(), GOLDEN);
    }

    #[test]
    fn a_fix_is_in_si_units_and_its_sigmas_are_those_of_an_axis() {
        let pvt = Pvt::parse(&GOLDEN).unwrap();
        let fix = pvt.to_fix(42);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * b.abs();
        assert!(close(fix.position.latitude, 52.765_432_1_f64.to_radians()));
        assert!(close(fix.position.longitude, -8.123_456_7_f64.to_radians()));
        assert!(close(fix.position.height, 123.456));
        assert_eq!(fix.velocity, [-1.234, 5.678, -0.091]);
        let want = [0.601_04, 0.601_04, 1.2, 0.034_641, 0.034_641, 0.034_641];
        for (sigma, want) in fix.sigmas.into_iter().zip(want) {
            assert!((f64::from(sigma) - want).abs() < 1e-5, "{sigma} {want}");
        }
        assert_eq!((fix.time_ms, fix.arrived_us), (123_456_789, 42));
        let invalid = Pvt {
            flags3: [1, 0, 0, 0, 0, 0],
            ..pvt
        };
        let sigmas = invalid.to_fix(0).sigmas;
        assert_eq!(sigmas[..3], [NOT_MEASURED; 3]);
        assert_eq!(sigmas[3..], fix.sigmas[3..]);
        let least = Pvt {
            vertical_accuracy: 1,
            speed_accuracy: 1,
            ..pvt
        };
        let sigmas = least.to_fix(0).sigmas;
        assert_eq!([sigmas[2], sigmas[5]], [0.005, 0.002]);
        let unknown = Pvt {
            speed_accuracy: 0,
            ..pvt
        };
        let position_only = unknown.to_fix(0);
        assert!(position_only.has(0..3) && !position_only.has(3..6) && !position_only.has(2..4));
    }

    #[test]
    fn others_pass_and_damage_does_not() {
        // UBX-ACK-ACK of a CFG-MSG
        let ack = hex::<10>("b5620501020006010f38");
        assert_eq!(scan(&ack), Scan::Other(10));
        assert_eq!(Pvt::parse(&ack), Err(Error::Header));
        assert_eq!(scan(&GOLDEN[..5]), Scan::Partial(6));
        let mut bytes = GOLDEN;
        bytes[4] = 91;
        assert_eq!(scan(&bytes[..6]), Scan::BadChecksum);
        for bit in 16..8 * PVT_LEN {
            bytes = GOLDEN;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Pvt::parse(&bytes).is_err(), "bit {bit}");
        }
    }
}
