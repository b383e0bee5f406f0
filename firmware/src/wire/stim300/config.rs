//! STIM300 special datagrams, above all the configuration datagram, which tells the units of the
//! measurements.
//!
//! Source: datasheet TS1524 rev 31, tables 5-13, 5-15 to 5-18 and 5-22. Part number, serial number,
//! bias trim and extended error are identified by length and CRC and passed on unread.

use super::super::field::{put, take};
use super::super::{Error, power_of_two};
use super::{Contents, Extra, crc_is_right, seal};
use crate::sample::{Quantity, Unit, Units};
use crate::units::{DEGREE, G};
use serde::{Deserialize, Serialize};

/// Part number, 20 bytes; the identifier with CR LF is this + 2.
pub const PART_NUMBER_ID: u8 = 0xB1;
/// Serial number, 20 bytes; with CR LF + 2.
pub const SERIAL_NUMBER_ID: u8 = 0xB5;
/// Configuration, 26 bytes; with CR LF + 1.
pub const CONFIGURATION_ID: u8 = 0xBC;
/// Extended error information, 21 bytes; with CR LF + 1.
pub const EXTENDED_ERROR_ID: u8 = 0xBE;
/// Bias trim offset, 40 bytes; with CR LF + 1.
pub const BIAS_TRIM_ID: u8 = 0xD1;

/// Bytes of a special datagram without CR LF.
pub fn special_len(id: u8) -> Option<usize> {
    match id {
        0xB1 | 0xB3 | 0xB5 | 0xB7 => Some(20),
        0xBC | 0xBD => Some(LEN),
        0xBE | 0xBF => Some(21),
        0xD1 | 0xD2 => Some(40),
        _ => None,
    }
}

/// Bytes of a configuration datagram without CR LF.
pub const LEN: usize = 26;

/// Field positions.
mod at {
    /// Sample rate, content, CR LF.
    pub const DATAGRAM: usize = 3;
    pub const LINK: usize = 4;
    pub const GYRO_UNIT: usize = 5;
    pub const ACCEL_UNIT: usize = 8;
    /// Bit 3: the extra value is PPS, not the auxiliary input.
    pub const PPS_INPUT: usize = 14;
    pub const ACCEL_RANGE: usize = 17;
}

/// Accelerometer range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Range {
    /// 5 g
    G5,
    /// 10 g
    G10,
    /// 30 g
    G30,
    /// 80 g
    G80,
}

impl Range {
    /// Equation 3: counts per g are 2 to this power. Velocity increments have 2^3 more per m/s
    /// (equation 4).
    fn exponent(self) -> i32 {
        match self {
            Range::G5 => 20,
            Range::G10 => 19,
            Range::G30 => 18,
            Range::G80 => 16,
        }
    }
}

/// Output units as the lower three bits of the unit code. Bit 3 says "delayed by 4 ms" and changes
/// no scale.
fn quantity(code: u8) -> Result<Quantity, Error> {
    match code & 7 {
        0 => Ok(Quantity::Rate),
        1 => Ok(Quantity::Increment),
        2 => Ok(Quantity::Average),
        3 | 4 => Ok(Quantity::Integrated),
        _ => Err(Error::Field),
    }
}

/// The configuration. All bits are kept, known or not, so that a configuration read and sent again
/// is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Config {
    bytes: [u8; LEN],
}

impl Config {
    /// A configuration as the golden frame has it: rates and accelerations, 1000 Hz, increments, 10
    /// g, 262 Hz filters, 921600 bit/s, no parity, one stop bit, no CR LF.
    pub const DEFAULT: Config = Config {
        bytes: [
            CONFIGURATION_ID,
            b'A',
            31,
            0x62,
            0x20,
            0x71,
            0x44,
            0x40,
            0x71,
            0x44,
            0x40,
            0x70,
            0x44,
            0x40,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
            0x56,
            0x01,
            0x60,
            0x9C,
        ],
    };

    /// From a configuration datagram, without CR LF.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Header`] or [`Error::Checksum`].
    pub fn parse(frame: &[u8]) -> Result<Config, Error> {
        let bytes: [u8; LEN] = frame.try_into().map_err(|_| Error::Length)?;
        if !matches!(bytes[0], 0xBC | 0xBD) {
            return Err(Error::Header);
        }
        if !crc_is_right(&bytes) {
            return Err(Error::Checksum);
        }
        Ok(Config { bytes })
    }

    /// The datagram, without CR LF.
    pub fn emit(&self) -> [u8; LEN] {
        self.bytes
    }

    /// Output rate in Hz; `None` with an external trigger.
    ///
    /// # Errors
    /// [`Error::Field`] for a code the datasheet does not have.
    pub fn sample_rate(&self) -> Result<Option<u16>, Error> {
        match self.bytes[at::DATAGRAM] >> 5 {
            0 => Ok(Some(125)),
            1 => Ok(Some(250)),
            2 => Ok(Some(500)),
            3 => Ok(Some(1000)),
            4 => Ok(Some(2000)),
            5 => Ok(None),
            _ => Err(Error::Field),
        }
    }

    /// Internal samples (2000 Hz) from one datagram to the next, by which its counter advances.
    pub fn counter_step(&self) -> Option<u16> {
        self.sample_rate().ok().flatten().map(|rate| 2000 / rate)
    }

    /// What the measurement datagrams hold.
    pub fn contents(&self) -> Contents {
        let bits = self.bytes[at::DATAGRAM];
        Contents {
            accel: bits & 0x02 != 0,
            incl: bits & 0x04 != 0,
            temperature: bits & 0x08 != 0,
            extra: match (bits & 0x10 != 0, self.bytes[at::PPS_INPUT] & 0x08 != 0) {
                (false, _) => Extra::None,
                (true, true) => Extra::Pps,
                (true, false) => Extra::Aux,
            },
        }
    }

    /// Whether CR LF ends each datagram.
    pub fn crlf(&self) -> bool {
        self.bytes[at::DATAGRAM] & 1 != 0
    }

    /// Bit/s; `None` for a user-defined rate, which the datagram does not tell.
    ///
    /// # Errors
    /// [`Error::Field`] for a code the datasheet does not have.
    pub fn bit_rate(&self) -> Result<Option<u32>, Error> {
        match self.bytes[at::LINK] >> 4 {
            0 => Ok(Some(374_400)),
            1 => Ok(Some(460_800)),
            2 => Ok(Some(921_600)),
            3 => Ok(Some(1_843_200)),
            15 => Ok(None),
            _ => Err(Error::Field),
        }
    }

    /// Accelerometer ranges of x, y, z.
    ///
    /// # Errors
    /// [`Error::Field`] for a code the datasheet does not have.
    pub fn ranges(&self) -> Result<[Range; 3], Error> {
        let [xy, z] = take(&self.bytes, at::ACCEL_RANGE);
        let range = |code| match code {
            0 => Ok(Range::G10),
            3 => Ok(Range::G5),
            4 => Ok(Range::G30),
            6 => Ok(Range::G80),
            _ => Err(Error::Field),
        };
        Ok([range(xy >> 4)?, range(xy & 15)?, range(z >> 4)?])
    }

    /// The units of the measurements (equations 1 to 4).
    ///
    /// # Errors
    /// [`Error::Field`] for unknown codes or for accelerometers of unequal range, which have no
    /// common unit.
    pub fn units(&self) -> Result<Units, Error> {
        let [range, y, z] = self.ranges()?;
        if y != range || z != range {
            return Err(Error::Field);
        }
        let gyro = quantity(self.bytes[at::GYRO_UNIT])?;
        let accel = quantity(self.bytes[at::ACCEL_UNIT])?;
        let gyro_exponent = match gyro {
            Quantity::Rate | Quantity::Average => 14,
            Quantity::Increment | Quantity::Integrated => 21,
        };
        let accel_lsb = match accel {
            Quantity::Rate | Quantity::Average => G * power_of_two(-range.exponent()),
            Quantity::Increment | Quantity::Integrated => power_of_two(-range.exponent() - 3),
        };
        // code 3 integrates g, code 4 m/s^2
        let in_g = self.bytes[at::ACCEL_UNIT] & 7 == 3;
        Ok(Units {
            gyro: Unit {
                quantity: gyro,
                lsb: DEGREE * power_of_two(-gyro_exponent),
            },
            accel: Unit {
                quantity: accel,
                lsb: if in_g { accel_lsb * G } else { accel_lsb },
            },
        })
    }

    /// The same with another content, for a compensator that sends other datagrams than it
    /// receives.
    #[must_use]
    pub fn with_contents(mut self, contents: Contents) -> Config {
        let bits = &mut self.bytes[at::DATAGRAM];
        *bits = *bits & !0x1E
            | u8::from(contents.extra != Extra::None) << 4
            | u8::from(contents.temperature) << 3
            | u8::from(contents.incl) << 2
            | u8::from(contents.accel) << 1;
        let pps = u8::from(contents.extra == Extra::Pps) << 3;
        self.bytes[at::PPS_INPUT] = self.bytes[at::PPS_INPUT] & !0x08 | pps;
        self.sealed()
    }

    /// The same with another sample rate code: 0 to 4 for 125, 250, 500, 1000, 2000 Hz, 5 for the
    /// external trigger.
    #[must_use]
    pub fn with_sample_rate_code(mut self, code: u8) -> Config {
        let bits = &mut self.bytes[at::DATAGRAM];
        *bits = *bits & 0x1F | code << 5;
        self.sealed()
    }

    /// The same with or without CR LF, identifier included.
    #[must_use]
    pub fn with_crlf(mut self, crlf: bool) -> Config {
        self.bytes[0] = CONFIGURATION_ID | u8::from(crlf);
        self.bytes[at::DATAGRAM] = self.bytes[at::DATAGRAM] & !1 | u8::from(crlf);
        self.sealed()
    }

    /// The same with other unit codes: gyro 0 to 3 and accelerometer 0 to 4 (rate, increment,
    /// average, integrated, integrated in m/s), + 8 delayed.
    #[must_use]
    pub fn with_unit_codes(mut self, gyro: u8, accel: u8) -> Config {
        for (at, code) in [(at::GYRO_UNIT, gyro), (at::ACCEL_UNIT, accel)] {
            let [axes] = take(&self.bytes, at);
            put(&mut self.bytes, at, [axes & 0xF0 | code & 0x0F]);
        }
        self.sealed()
    }

    /// The same with all accelerometers of another range.
    #[must_use]
    pub fn with_accel_range(mut self, range: Range) -> Config {
        let code = match range {
            Range::G10 => 0,
            Range::G5 => 3,
            Range::G30 => 4,
            Range::G80 => 6,
        };
        let [_, z] = take(&self.bytes, at::ACCEL_RANGE);
        put(
            &mut self.bytes,
            at::ACCEL_RANGE,
            [code << 4 | code, code << 4 | z & 0x0F],
        );
        self.sealed()
    }

    /// The same with another bit rate; one without a code of its own is a user-defined one.
    #[must_use]
    pub fn with_bit_rate(mut self, bit_rate: u32) -> Config {
        let code = match bit_rate {
            374_400 => 0,
            460_800 => 1,
            921_600 => 2,
            1_843_200 => 3,
            _ => 15,
        };
        let bits = &mut self.bytes[at::LINK];
        *bits = *bits & 0x0F | code << 4;
        self.sealed()
    }

    fn sealed(mut self) -> Config {
        seal(&mut self.bytes);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Scan;
    use crate::wire::field::hex;
    use crate::wire::stim300::scan;

    /// The configuration for the golden measurement frame, as a third-party client accepts it.
    const GOLDEN: [u8; LEN] = hex("bc411f622071444071444070444000000000000000005601609c");

    #[test]
    fn golden_configuration() {
        assert_eq!(scan(&GOLDEN), Scan::Other(LEN));
        let config = Config::parse(&GOLDEN).unwrap();
        assert_eq!(config, Config::DEFAULT);
        assert_eq!(config.emit(), GOLDEN);
        assert_eq!(config.sample_rate(), Ok(Some(1000)));
        assert_eq!(config.counter_step(), Some(2));
        assert_eq!(config.bit_rate(), Ok(Some(921_600)));
        assert_eq!(config.contents().id(), 0x91);
        assert!(!config.crlf());
        assert_eq!(config.ranges(), Ok([Range::G10; 3]));
        let units = config.units().unwrap();
        assert_eq!(units.gyro.quantity, Quantity::Increment);
        assert_eq!(units.gyro.lsb, DEGREE / 2_097_152.0);
        assert_eq!(units.accel.lsb, 1.0 / 4_194_304.0);
        assert_eq!(units.accel.increment(0.001), Some(units.accel.lsb));
    }

    #[test]
    fn a_damaged_configuration_is_refused() {
        for bit in 0..8 * LEN {
            let mut bytes = GOLDEN;
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Config::parse(&bytes).is_err(), "bit {bit}");
        }
        assert_eq!(Config::parse(&GOLDEN[1..]), Err(Error::Length));
    }

    #[test]
    fn every_content_survives_the_datagram() {
        for id in (0..=255).filter(|&id| Contents::from_id(id).is_some()) {
            let contents = Contents::from_id(id).unwrap();
            let sent = Config::DEFAULT
                .with_contents(contents)
                .with_crlf(true)
                .emit();
            let config = Config::parse(&sent).unwrap();
            assert_eq!((config.contents().id(), config.crlf()), (id, true));
            assert_eq!(sent[0], 0xBD);
            assert_eq!(
                config
                    .with_contents(Config::DEFAULT.contents())
                    .with_crlf(false),
                Config::DEFAULT
            );
        }
        let steps = [16, 8, 4, 2, 1].map(Some);
        for (code, step) in (0..).zip(steps.into_iter().chain([None, None])) {
            let config = Config::DEFAULT.with_sample_rate_code(code);
            assert_eq!(config.counter_step(), step);
        }
    }

    #[test]
    fn ranges_and_bit_rates_read_back() {
        for range in [Range::G5, Range::G10, Range::G30, Range::G80] {
            let config = Config::DEFAULT.with_accel_range(range);
            assert_eq!(config.ranges(), Ok([range; 3]));
            assert_eq!(Config::parse(&config.emit()), Ok(config));
        }
        for rate in [374_400, 460_800, 921_600, 1_843_200] {
            let config = Config::DEFAULT.with_bit_rate(rate);
            assert_eq!(config.bit_rate(), Ok(Some(rate)));
            assert_eq!(config.with_bit_rate(921_600), Config::DEFAULT);
        }
        assert_eq!(Config::DEFAULT.with_bit_rate(1).bit_rate(), Ok(None));
    }

    /// Equations 1 to 4 and tables 7-2, 7-3: full scale is 2^23 counts.
    #[test]
    fn units_follow_the_codes() {
        let full = 8_388_608.0;
        let full_scale = |gyro, accel| {
            let units = Config::DEFAULT
                .with_unit_codes(gyro, accel)
                .units()
                .unwrap();
            (units.gyro.lsb * full / DEGREE, units.accel.lsb * full)
        };
        assert_eq!(full_scale(0, 0), (512.0, 16.0 * G));
        assert_eq!(full_scale(1, 1), (4.0, 2.0));
        assert_eq!(full_scale(10, 10), (512.0, 16.0 * G)); // delayed averages
        assert_eq!(full_scale(3, 3), (4.0, 2.0 * G)); // +-4 deg, +-2 g s
        assert_eq!(full_scale(3, 4), (4.0, 2.0)); // +-2 m/s
        let rates = Config::DEFAULT.with_unit_codes(0, 3).units().unwrap();
        assert_eq!(rates.gyro.increment(0.001), Some(rates.gyro.lsb * 0.001));
        assert_eq!(rates.accel.increment(0.001), None);
        let unknown = Config::DEFAULT.with_unit_codes(5, 0);
        assert_eq!(unknown.units(), Err(Error::Field));
    }

    #[test]
    fn special_datagrams_pass_unread() {
        for (id, len) in [(0xB1, 20), (0xB7, 20), (0xBF, 21), (0xD2, 40)] {
            let mut bytes = [0x5A; 40];
            bytes[0] = id;
            seal(&mut bytes[..len]);
            assert_eq!(special_len(id), Some(len));
            assert_eq!(scan(&bytes[..len]), Scan::Other(len));
            assert_eq!(scan(&bytes[..len - 1]), Scan::Partial(len));
            bytes[1] ^= 4;
            assert_eq!(scan(&bytes[..len]), Scan::BadChecksum);
        }
    }
}
