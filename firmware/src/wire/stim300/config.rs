//! STIM300 special datagrams, above all the configuration datagram, which states the units of the
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

/// The configuration. It stores all bits, known or not, so that a configuration read and sent again
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

    /// Content of the measurement datagrams.
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

    /// Bit/s; `None` for a user-defined rate, which the datagram does not contain.
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

    /// This configuration with another content, for a compensator that sends other datagrams than
    /// it receives.
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

    /// This configuration with another sample rate code: 0 to 4 for 125, 250, 500, 1000, 2000 Hz, 5
    /// for the external trigger.
    #[must_use]
    pub fn with_sample_rate_code(mut self, code: u8) -> Config {
        let bits = &mut self.bytes[at::DATAGRAM];
        *bits = *bits & 0x1F | code << 5;
        self.sealed()
    }

    /// This configuration with or without CR LF, identifier included.
    #[must_use]
    pub fn with_crlf(mut self, crlf: bool) -> Config {
        self.bytes[0] = CONFIGURATION_ID | u8::from(crlf);
        self.bytes[at::DATAGRAM] = self.bytes[at::DATAGRAM] & !1 | u8::from(crlf);
        self.sealed()
    }

    /// This configuration with other unit codes: gyro 0 to 3 and accelerometer 0 to 4 (rate,
    /// increment, average, integrated, integrated in m/s), + 8 delayed.
    #[must_use]
    pub fn with_unit_codes(mut self, gyro: u8, accel: u8) -> Config {
        for (at, code) in [(at::GYRO_UNIT, gyro), (at::ACCEL_UNIT, accel)] {
            let [axes] = take(&self.bytes, at);
            put(&mut self.bytes, at, [axes & 0xF0 | code & 0x0F]);
        }
        self.sealed()
    }

    /// This configuration with all accelerometers of another range.
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

    /// This configuration with another bit rate; one without a code of its own is a user-defined
    /// one.
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
mod tests;
