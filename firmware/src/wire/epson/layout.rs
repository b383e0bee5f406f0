//! Content and layout of a burst.

use core::fmt;
use serde::{Deserialize, Serialize};

/// A field of a burst, in the order of the burst.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// New-data flags and the error bit.
    Flags,
    /// Temperature.
    Temperature,
    /// Rates x, y, z.
    Gyro,
    /// Accelerations x, y, z.
    Accel,
    /// Angle increments x, y, z.
    DeltaAngle,
    /// Velocity increments x, y, z.
    DeltaVelocity,
    /// Quaternion.
    Quaternion,
    /// Attitude.
    Attitude,
    /// Levels of the general-purpose pins.
    Gpio,
    /// Counter.
    Count,
    /// Checksum.
    Checksum,
}

impl Field {
    /// All fields.
    pub const ALL: [Field; 11] = [
        Field::Flags,
        Field::Temperature,
        Field::Gyro,
        Field::Accel,
        Field::DeltaAngle,
        Field::DeltaVelocity,
        Field::Quaternion,
        Field::Attitude,
        Field::Gpio,
        Field::Count,
        Field::Checksum,
    ];

    /// Bit of the field in BURST_CTRL1; for numbers that may have 32 bits, also in BURST_CTRL2.
    const fn bit(self) -> u16 {
        match self {
            Field::Flags => 1 << 15,
            Field::Temperature => 1 << 14,
            Field::Gyro => 1 << 13,
            Field::Accel => 1 << 12,
            Field::DeltaAngle => 1 << 11,
            Field::DeltaVelocity => 1 << 10,
            Field::Quaternion => 1 << 9,
            Field::Attitude => 1 << 8,
            Field::Gpio => 1 << 2,
            Field::Count => 1 << 1,
            Field::Checksum => 1 << 0,
        }
    }

    /// Numbers in it.
    pub(super) const fn numbers(self) -> usize {
        match self {
            Field::Gyro
            | Field::Accel
            | Field::DeltaAngle
            | Field::DeltaVelocity
            | Field::Attitude => 3,
            Field::Quaternion => 4,
            _ => 1,
        }
    }
}

/// Bits of BURST_CTRL2 that mean something.
const WIDE: u16 = 0x7F00;

/// Why a sensor cannot be used as it is configured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// The bursts have no checksum.
    Checksum,
    /// The bursts lack gyros or accelerometers.
    Values,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Refused::Checksum => "BURST_CTRL1 without checksum: set bit 0 in the sensor and here",
            Refused::Values => {
                "BURST_CTRL1 without gyros (bit 13 or 11) or accelerometers (bit 12 or 10)"
            }
        })
    }
}

/// Content and layout of a burst. Positions are bytes from the start mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "[u16; 2]", into = "[u16; 2]")]
pub struct Layout {
    /// BURST_CTRL1 and BURST_CTRL2.
    registers: [u16; 2],
    bytes: u8,
    /// 0: not there, as for `count`.
    flags: u8,
    gyro: u8,
    accel: u8,
    count: u8,
}

impl Layout {
    /// Flags, temperature, gyros and accelerometers, counter and checksum, with numbers of 32 bits:
    /// what `esensorlib` configures with all options.
    pub const USUAL: Layout = match Layout::new(0xF003, 0x7000) {
        Ok(layout) => layout,
        Err(_) => panic!("it has a checksum and all values"),
    };

    /// The layout by the registers of the sensor.
    ///
    /// # Errors
    /// The reason why the bursts cannot be used.
    pub const fn new(burst_ctrl1: u16, burst_ctrl2: u16) -> Result<Layout, Refused> {
        if burst_ctrl1 & Field::Checksum.bit() == 0 {
            return Err(Refused::Checksum);
        }
        let mut layout = Layout {
            registers: [burst_ctrl1, burst_ctrl2 & WIDE],
            bytes: 1,
            flags: 0,
            gyro: 0,
            accel: 0,
            count: 0,
        };
        let mut n = 0;
        while n < Field::ALL.len() {
            let field = Field::ALL[n];
            n += 1;
            if burst_ctrl1 & field.bit() == 0 {
                continue;
            }
            let at = layout.bytes;
            match field {
                Field::Flags => layout.flags = at,
                // the increments, which come later, take the place of the rates
                Field::Gyro | Field::DeltaAngle => layout.gyro = at,
                Field::Accel | Field::DeltaVelocity => layout.accel = at,
                Field::Count => layout.count = at,
                _ => {}
            }
            let width = if layout.is_wide(field) { 4 } else { 2 };
            layout.bytes += width * field.numbers() as u8; // 93 at most
        }
        layout.bytes += 1; // the end mark
        if layout.gyro == 0 || layout.accel == 0 {
            return Err(Refused::Values);
        }
        Ok(layout)
    }

    /// BURST_CTRL1 and BURST_CTRL2.
    pub const fn registers(self) -> [u16; 2] {
        self.registers
    }

    /// Whether bursts have this field.
    pub const fn has(self, field: Field) -> bool {
        self.registers[0] & field.bit() != 0
    }

    /// Whether its numbers have 32 bits.
    pub(super) const fn is_wide(self, field: Field) -> bool {
        self.registers[1] & field.bit() != 0
    }

    /// Bytes of a burst.
    pub const fn bytes(self) -> usize {
        self.bytes as usize
    }

    /// Position of FLAG.
    pub(super) fn flags(self) -> Option<usize> {
        (self.flags != 0).then_some(self.flags.into())
    }

    /// Position of COUNT.
    pub(super) fn count(self) -> Option<usize> {
        (self.count != 0).then_some(self.count.into())
    }

    /// The field of the gyro values that are corrected.
    pub(super) const fn gyro_field(self) -> Field {
        if self.has(Field::DeltaAngle) {
            Field::DeltaAngle
        } else {
            Field::Gyro
        }
    }

    /// The field of the accelerometer values that are corrected.
    pub(super) const fn accel_field(self) -> Field {
        if self.has(Field::DeltaVelocity) {
            Field::DeltaVelocity
        } else {
            Field::Accel
        }
    }

    /// Position of the gyro values, and whether they have 32 bits.
    pub(super) fn gyro(self) -> (usize, bool) {
        (self.gyro.into(), self.is_wide(self.gyro_field()))
    }

    /// Offset of the accelerometer values, and whether they have 32 bits.
    pub(super) fn accel(self) -> (usize, bool) {
        (self.accel.into(), self.is_wide(self.accel_field()))
    }
}

impl TryFrom<[u16; 2]> for Layout {
    type Error = Refused;

    fn try_from([burst_ctrl1, burst_ctrl2]: [u16; 2]) -> Result<Layout, Refused> {
        Layout::new(burst_ctrl1, burst_ctrl2)
    }
}

impl From<Layout> for [u16; 2] {
    fn from(layout: Layout) -> [u16; 2] {
        layout.registers
    }
}
