//! Analog Devices ADIS burst replies, as bytes; [`spi`] fetches them.
//!
//! Source: the Linux drivers adis16475 and adis16480 and `ArduPilot`'s ADIS1647x driver, read, not
//! copied. No recorded burst is public, so the checksums were verified by an independent
//! implementation only. A burst consists of 16-bit words, most significant byte first. Where a
//! number has two words, `lo` comes before `hi`:
//!
//! ```text
//! 1646x, 1647x, 1650x: 20 bytes, or 32 with BURST32
//!   DIAG_STAT | gyro xyz | acc xyz | TEMP | DATA_CNTR | byte sum
//!   DIAG_STAT | gyro xyz lo hi | acc xyz lo hi | TEMP | DATA_CNTR | byte sum
//! 1649x: 40 bytes
//!   A5A5 once or twice | SYS_E_FLAG | TEMP | gyro lo hi | acc lo hi | DATA_CNT | CRC lo hi
//! ```
//!
//! The byte sum of the first family is weak: exchanged bytes pass it.

mod find;
mod frame;
mod model;
pub mod spi;
pub mod uart;

pub use find::{DetectedSensor, Rate, begin, find};
pub use frame::Frame;
pub use model::Model;
pub use spi::Form;

use super::Error;
use super::checksum::{crc32_zlib_swapped, sum_bytes};
use super::field::{head, put, take};
use super::sequence::{Rule, Sequence, Stream};
use crate::sample::{Axes, Quantity, Units};
use serde::{Deserialize, Serialize};

/// Bytes of a 16-bit burst reply (1646x, 1647x, 1650x).
pub const BURST16_LEN: usize = 20;
/// Bytes of a 32-bit burst reply (1650x and newer 1647x with BURST32 set).
pub const BURST32_LEN: usize = 32;
/// Bytes of a 1649x burst reply, with up to three words before the data.
pub const BURST_1649X_LEN: usize = 40;

/// The word that precedes a 1649x burst's data.
const BURST_ID: u16 = 0xA5A5;

/// Settings that the bursts of an ADIS do not contain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Form of its bursts.
    pub form: Form,
    /// Units of a count: [`Model::units`].
    pub units: Units,
    /// The bursts leave in frames of their own ([`uart`]), not bare.
    pub framed: bool,
}

impl Settings {
    /// Whether the bursts hold increments (BURST_SEL).
    pub fn has_increments(&self) -> bool {
        self.units.gyro.quantity == Quantity::Increment
    }

    /// Bytes of a burst as it leaves.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let frame = if self.framed { uart::AROUND } else { 0 };
        self.form.bytes() + frame
    }

    /// A burst as the device sends it: bare, or in a frame in `buffer`. `time_us`: when it was
    /// fetched.
    ///
    /// # Errors
    /// [`Error::Length`] when a burst for a frame is not of the configured form.
    pub fn leaving<'b>(
        &self,
        reply: &'b mut [u8],
        time_us: u32,
        buffer: &'b mut [u8; uart::LONGEST],
    ) -> Result<&'b mut [u8], Error> {
        if !self.framed {
            return Ok(reply);
        }
        let flags = if self.has_increments() {
            uart::INCREMENTS
        } else {
            0
        };
        uart::wrap(self.form, flags, time_us, reply, buffer)
    }
}

/// Units, rate and gap rule of bursts whose counts mean this. DATA_CNTR has 16 bits and counts
/// samples.
pub(super) fn counting(units: Units, rate: f64) -> Stream {
    Stream {
        units,
        rate,
        sequence: Sequence::Counter(Rule::new(0x1_0000, 1)),
    }
}

/// One burst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Burst {
    /// DIAG_STAT or SYS_E_FLAG; see [`Burst::valid_1647x`].
    pub diagnosis: u16,
    /// Gyro x, y, z: rates, or angle increments with BURST_SEL.
    pub gyro: [i32; 3],
    /// Accelerometer x, y, z: accelerations, or velocity increments with BURST_SEL.
    pub accel: [i32; 3],
    /// 0.1 degrees Celsius (1646x, 1647x, 1650x).
    pub temperature: i16,
    /// +1 a sample; see [`super::sequence::Rule`].
    pub counter: u16,
}

/// DIAG_STAT bits of the 1646x, 1647x and 1650x that make the inertial data invalid: standby (4),
/// sensor failure (5), memory failure (6). Overrun, flash, SPI and clock bits concern earlier data
/// or the timing.
const NOT_VALID_1647X: u16 = 0x0070;

impl Burst {
    /// The axes that DIAG_STAT of a 1646x, 1647x or 1650x calls good: all or none.
    pub fn valid_1647x(&self) -> Axes {
        if self.diagnosis & NOT_VALID_1647X == 0 {
            Axes::ALL
        } else {
            Axes::NONE
        }
    }

    /// Reads a 16-bit burst reply.
    ///
    /// # Errors
    /// [`Error::Checksum`]
    pub fn parse16(reply: &[u8; BURST16_LEN]) -> Result<Burst, Error> {
        check_sum(reply)?;
        let word = |n: usize| i32::from(i16::from_be_bytes(take(reply, 2 * n)));
        Ok(Burst {
            diagnosis: u16::from_be_bytes(take(reply, 0)),
            gyro: [word(1), word(2), word(3)],
            accel: [word(4), word(5), word(6)],
            temperature: i16::from_be_bytes(take(reply, 14)),
            counter: u16::from_be_bytes(take(reply, 16)),
        })
    }

    /// Reads a 32-bit burst reply.
    ///
    /// # Errors
    /// [`Error::Checksum`]
    pub fn parse32(reply: &[u8; BURST32_LEN]) -> Result<Burst, Error> {
        check_sum(reply)?;
        Ok(Burst {
            diagnosis: u16::from_be_bytes(take(reply, 0)),
            gyro: low_high(reply, 2),
            accel: low_high(reply, 14),
            temperature: i16::from_be_bytes(take(reply, 26)),
            counter: u16::from_be_bytes(take(reply, 28)),
        })
    }

    /// Reads a 1649x burst reply. How many BURST_ID words precede the data depends on the clock:
    /// two above 3.6 MHz, one below 3 MHz. The data begin where, within the first four words,
    /// BURST_ID is followed by something else. Diagnosis flags that read 0xA5A5 themselves are
    /// refused; they would set reserved bits.
    ///
    /// # Errors
    /// [`Error::Header`] without BURST_ID, [`Error::Checksum`].
    pub fn parse_1649x(reply: &[u8; BURST_1649X_LEN]) -> Result<Burst, Error> {
        let word = |n: usize| u16::from_be_bytes(take(reply, 2 * n));
        let start = (1..4)
            .find(|&n| word(n - 1) == BURST_ID && word(n) != BURST_ID)
            .ok_or(Error::Header)?;
        let data: [u8; 34] = take(reply, 2 * start);
        let [low, high] = [take(&data, 30), take(&data, 32)].map(u16::from_be_bytes);
        if crc32_zlib_swapped(head(&data, 30)) != u32::from(high) << 16 | u32::from(low) {
            return Err(Error::Checksum);
        }
        Ok(Burst {
            diagnosis: u16::from_be_bytes(take(&data, 0)),
            temperature: i16::from_be_bytes(take(&data, 2)),
            gyro: low_high(&data, 4),
            accel: low_high(&data, 16),
            counter: u16::from_be_bytes(take(&data, 28)),
        })
    }

    /// The reply that a 1646x, 1647x or 1650x would send. Values keep their low 16 bits.
    pub fn emit16(&self) -> [u8; BURST16_LEN] {
        let mut reply = [0; BURST16_LEN];
        for (n, word) in self.gyro.into_iter().chain(self.accel).enumerate() {
            put(&mut reply, 2 + 2 * n, (word as u16).to_be_bytes());
        }
        self.emit_rest(&mut reply, 14);
        reply
    }

    /// The reply that a 1650x in 32-bit mode would send.
    pub fn emit32(&self) -> [u8; BURST32_LEN] {
        let mut reply = [0; BURST32_LEN];
        put_low_high(&mut reply, 2, self.gyro);
        put_low_high(&mut reply, 14, self.accel);
        self.emit_rest(&mut reply, 26);
        reply
    }

    fn emit_rest(&self, reply: &mut [u8], at: usize) {
        put(reply, 0, self.diagnosis.to_be_bytes());
        put(reply, at, self.temperature.to_be_bytes());
        put(reply, at + 2, self.counter.to_be_bytes());
        let sum = sum_bytes(head(reply, at + 4));
        put(reply, at + 4, sum.to_be_bytes());
    }

    /// The reply that a 1649x would send, with one or two BURST_ID words.
    pub fn emit_1649x(&self, fast_clock: bool) -> [u8; BURST_1649X_LEN] {
        let mut data = [0; 34];
        put(&mut data, 0, self.diagnosis.to_be_bytes());
        put(&mut data, 2, self.temperature.to_be_bytes());
        put_low_high(&mut data, 4, self.gyro);
        put_low_high(&mut data, 16, self.accel);
        put(&mut data, 28, self.counter.to_be_bytes());
        let crc = crc32_zlib_swapped(head(&data, 30));
        put(&mut data, 30, (crc as u16).to_be_bytes());
        put(&mut data, 32, ((crc >> 16) as u16).to_be_bytes());
        let mut reply = [0; BURST_1649X_LEN];
        put(&mut reply, 0, BURST_ID.to_be_bytes());
        put(&mut reply, 2, BURST_ID.to_be_bytes());
        put(&mut reply, if fast_clock { 4 } else { 2 }, data);
        reply
    }
}

fn check_sum(reply: &[u8]) -> Result<(), Error> {
    let at = reply.len().saturating_sub(2);
    if sum_bytes(head(reply, at)) == u16::from_be_bytes(take(reply, at)) {
        Ok(())
    } else {
        Err(Error::Checksum)
    }
}

/// Three numbers of two words each, low word first.
fn low_high(bytes: &[u8], at: usize) -> [i32; 3] {
    core::array::from_fn(|axis| {
        let [a, b, c, d] = take(bytes, at + 4 * axis);
        i32::from_be_bytes([c, d, a, b])
    })
}

fn put_low_high(bytes: &mut [u8], at: usize, words: [i32; 3]) {
    for (axis, word) in words.into_iter().enumerate() {
        let [a, b, c, d] = word.to_be_bytes();
        put(bytes, at + 4 * axis, [c, d, a, b]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::hex;
    use super::*;

    const BURST16: [u8; 20] = hex("00000001fffe00030064ff38032000fa000704c0");
    const BURST32: [u8; 32] =
        hex("0000000000010000fffe00010003000000640000ff380000032000fa000704c1");
    /// CRC 55ED36B2; one BURST_ID.
    const BURST_1649X: [u8; 36] =
        hex("a5a50000012303e80000f830ffff0bb80000000000040000fff800000190002a36b255ed");

    #[test]
    fn narrow_burst() {
        let burst = Burst::parse16(&BURST16).unwrap();
        assert_eq!((burst.gyro, burst.accel), ([1, -2, 3], [100, -200, 800]));
        assert_eq!((burst.temperature, burst.counter), (250, 7));
        assert_eq!(burst.valid_1647x(), Axes::ALL);
        assert_eq!(burst.emit16(), BURST16);
        let failed = Burst {
            diagnosis: 0x0020,
            ..burst
        };
        assert_eq!(failed.valid_1647x(), Axes::NONE);
    }

    #[test]
    fn wide_burst() {
        let burst = Burst::parse32(&BURST32).unwrap();
        assert_eq!(burst.gyro, [0x0001_0000, -0x0002_0000, 0x0003_0001]);
        assert_eq!(burst.accel, [0x0064_0000, -0x00C8_0000, 0x0320_0000]);
        assert_eq!((burst.temperature, burst.counter), (250, 7));
        assert_eq!(burst.emit32(), BURST32);
    }

    /// The reply with `lead` in front of the golden burst's BURST_ID.
    fn reply_1649x(lead: &[u8]) -> [u8; BURST_1649X_LEN] {
        let mut reply = [0; BURST_1649X_LEN];
        reply[..lead.len()].copy_from_slice(lead);
        reply[lead.len()..][..BURST_1649X.len()].copy_from_slice(&BURST_1649X);
        reply
    }

    #[test]
    fn burst_id_is_found_wherever_the_clock_puts_it() {
        let burst = Burst::parse_1649x(&reply_1649x(&[])).unwrap();
        assert_eq!((burst.gyro, burst.counter), ([1000, -2000, 3000], 42));
        assert_eq!(burst.accel, [0x0004_0000, -0x0008_0000, 0x0190_0000]);
        assert_eq!((burst.diagnosis, burst.temperature), (0, 0x0123));
        for lead in [&[0xA5, 0xA5][..], &[0, 0], &[0, 0, 0xA5, 0xA5]] {
            assert_eq!(Burst::parse_1649x(&reply_1649x(lead)), Ok(burst));
        }
        assert_eq!(burst.emit_1649x(false), reply_1649x(&[]));
        assert_eq!(burst.emit_1649x(true), reply_1649x(&[0xA5, 0xA5]));
        assert_eq!(Burst::parse_1649x(&[0xA5; 40]), Err(Error::Header));
        assert_eq!(Burst::parse_1649x(&[0; 40]), Err(Error::Header));
    }

    #[test]
    fn every_single_wrong_bit_is_found() {
        let reply = reply_1649x(&[]);
        for bit in 0..8 * BURST32_LEN {
            let (at, flip) = (bit / 8, 1 << (bit % 8));
            let (mut wide, mut wider) = (BURST32, reply);
            wide[at] ^= flip;
            wider[2 + at] ^= flip; // data and CRC, not BURST_ID
            assert_eq!(Burst::parse32(&wide), Err(Error::Checksum));
            assert!(Burst::parse_1649x(&wider).is_err());
            if let (Some(byte), mut narrow) = (BURST16.get(at), BURST16) {
                narrow[at] = byte ^ flip;
                assert_eq!(Burst::parse16(&narrow), Err(Error::Checksum));
            }
        }
    }

    /// Damage that a sum of bytes cannot detect.
    #[test]
    fn exchanged_bytes_pass_the_sum() {
        let mut reply = BURST16;
        reply.swap(3, 7); // gyro x and z
        assert_eq!(Burst::parse16(&reply).unwrap().gyro, [3, -2, 1]);
    }
}
