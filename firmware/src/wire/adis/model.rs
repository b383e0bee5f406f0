//! The models whose scales the Linux drivers name, and how each is known at its registers.

use super::Form;
use crate::sample::{Quantity, Unit, Units};
use crate::units::{DEGREE, G};
use crate::wire::power_of_two;
use serde::{Deserialize, Serialize};

/// A model; the last digit (-1, -2, -3) is the gyro range's. The order is part of the configuration
/// record: new ones go to the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Model {
    /// ADIS16465-1, -2, -3
    Adis16465(u8),
    /// ADIS16467-1, -2, -3
    Adis16467(u8),
    /// ADIS16470
    Adis16470,
    /// ADIS16475-1, -2, -3
    Adis16475(u8),
    /// ADIS16477-1, -2, -3
    Adis16477(u8),
    /// ADIS16490
    Adis16490,
    /// ADIS16495-1, -2, -3
    Adis16495(u8),
    /// ADIS16497-1, -2, -3
    Adis16497(u8),
    /// ADIS16500
    Adis16500,
    /// ADIS16505-1, -2, -3
    Adis16505(u8),
    /// ADIS16507-1, -2, -3
    Adis16507(u8),
}

impl Model {
    /// The model by product number and RANG_MDL (its bits 2 and 3: 00, 01 and 11 are -1, -2 and
    /// -3). `None`: not one of these.
    pub fn from_registers(product: u16, range: u16) -> Option<Model> {
        let digit = match range >> 2 & 3 {
            0 => 1,
            1 => 2,
            3 => 3,
            _ => return None,
        };
        Some(match product {
            16465 => Model::Adis16465(digit),
            16467 => Model::Adis16467(digit),
            16470 => Model::Adis16470,
            16475 => Model::Adis16475(digit),
            16477 => Model::Adis16477(digit),
            16490 => Model::Adis16490,
            16495 => Model::Adis16495(digit),
            16497 => Model::Adis16497(digit),
            16500 => Model::Adis16500,
            16505 => Model::Adis16505(digit),
            16507 => Model::Adis16507(digit),
            _ => return None,
        })
    }

    /// The form of burst to fetch from it: with 32 bits a word where it can.
    pub fn form(self) -> Form {
        match self {
            Model::Adis16490 | Model::Adis16495(_) | Model::Adis16497(_) => Form::Adis1649x,
            Model::Adis16500 | Model::Adis16505(_) | Model::Adis16507(_) => Form::Wide,
            _ => Form::Narrow,
        }
    }

    /// Units of a count of a 16-bit word; a 32-bit count is 2^-16 of it. `None` for a range that
    /// does not exist.
    pub fn units(self, wide: bool) -> Option<Units> {
        let (gyro, accel) = match self {
            Model::Adis16470 => (0.1, 1.25e-3 * G),
            Model::Adis16465(range) | Model::Adis16475(range) | Model::Adis16495(range) => {
                (gyro_scale(range)?, 0.25e-3 * G)
            }
            Model::Adis16467(range) | Model::Adis16477(range) | Model::Adis16497(range) => {
                (gyro_scale(range)?, 1.25e-3 * G)
            }
            Model::Adis16490 => (0.005, 0.5e-3 * G),
            Model::Adis16500 => (0.1, 392.0 / 32_000.0),
            // Linux rounds the range to 78
            Model::Adis16505(range) => (gyro_scale(range)?, 78.4 / 32_000.0),
            Model::Adis16507(range) => (gyro_scale(range)?, 392.0 / 32_000.0),
        };
        let narrow = if wide { power_of_two(-16) } else { 1.0 };
        let unit = |lsb| Unit {
            quantity: Quantity::Rate,
            lsb: lsb * narrow,
        };
        Some(Units {
            gyro: unit(gyro * DEGREE),
            accel: unit(accel),
        })
    }
}

impl Model {
    /// Units of a count of a 16-bit word in bursts of increments (BURST_SEL); a 32-bit count is
    /// 2^-16 of it. `None` where the Linux driver knows no such bursts.
    pub fn increments(self, wide: bool) -> Option<Units> {
        let (range, velocity) = match self {
            Model::Adis16477(range) | Model::Adis16507(range) => (range, 400.0),
            Model::Adis16500 => (3, 400.0),
            Model::Adis16505(range) => (range, 100.0),
            _ => return None,
        };
        let degrees = match range {
            1 => 360.0,
            2 => 720.0,
            3 => 2160.0,
            _ => return None,
        };
        let full = power_of_two(if wide { -31 } else { -15 });
        let unit = |range: f64| Unit {
            quantity: Quantity::Increment,
            lsb: range * full,
        };
        Some(Units {
            gyro: unit(degrees * DEGREE),
            accel: unit(velocity),
        })
    }
}

/// deg/s
fn gyro_scale(range: u8) -> Option<f64> {
    match range {
        1 => Some(1.0 / 160.0),
        2 => Some(1.0 / 40.0),
        3 => Some(1.0 / 10.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales() {
        let units = Model::Adis16475(2).units(true).unwrap();
        assert_eq!(units.gyro.lsb, DEGREE / 40.0 / 65_536.0);
        assert_eq!(units.accel.lsb, 0.25e-3 * G / 65_536.0);
        assert_eq!(Model::Adis16477(4).units(false), None);
        let units = Model::Adis16470.units(false).unwrap();
        assert_eq!(
            (units.gyro.lsb, units.accel.lsb),
            (0.1 * DEGREE, 1.25e-3 * G)
        );
    }

    /// Linux: 720 degrees and 100 m/s are 2^31 counts of an ADIS16505-2.
    #[test]
    fn increments_have_scales_of_their_own() {
        let units = Model::Adis16505(2).increments(true).unwrap();
        assert_eq!(units.gyro.quantity, Quantity::Increment);
        assert_eq!(units.gyro.lsb * 2_147_483_648.0, 720.0 * DEGREE);
        assert_eq!(units.accel.lsb * 2_147_483_648.0, 100.0);
        let narrow = Model::Adis16505(2).increments(false).unwrap();
        assert_eq!(narrow.gyro.lsb, 65_536.0 * units.gyro.lsb);
        assert_eq!(Model::Adis16475(2).increments(true), None);
        assert_eq!(Model::Adis16495(2).increments(true), None);
    }

    #[test]
    fn every_model_is_known_by_its_registers() {
        let mut known = 0;
        for product in 0..=u16::MAX {
            for (range, digit) in [(0x3, 1), (0x7, 2), (0xF, 3)] {
                let Some(model) = Model::from_registers(product, range) else {
                    continue;
                };
                known += 1;
                assert!(model.units(model.form() != Form::Narrow).is_some());
                if let Model::Adis16475(which) | Model::Adis16505(which) = model {
                    assert_eq!(which, digit);
                }
            }
            assert_eq!(Model::from_registers(product, 0xB), None);
        }
        assert_eq!(known, 33);
    }
}
