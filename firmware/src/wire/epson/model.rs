//! The models and what a count of theirs is worth.

use super::layout::{Field, Layout};
use super::protocol::Settings;
use crate::sample::{Quantity, Unit, Units};
use crate::units::{DEGREE, G};
use crate::wire::power_of_two;
use serde::{Deserialize, Serialize};

/// A model. The order is part of the configuration record: new ones go to the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Model {
    /// M-G320PDG0
    G320,
    /// M-G354PDH0
    G354,
    /// M-G364PDC0
    G364Pdc0,
    /// M-G364PDCA
    G364Pdca,
    /// M-G365PDC1
    G365Pdc1,
    /// M-G365PDF1
    G365Pdf1,
    /// M-G366PDG0 and M-G330PDG0
    G366,
    /// M-G370PDF1
    G370Pdf1,
    /// M-G370PDS0
    G370Pds0,
    /// M-G370PDG0
    G370Pdg0,
    /// M-G370PDT0
    G370Pdt0,
}

impl Model {
    /// All models.
    pub const ALL: [Model; 11] = [
        Model::G320,
        Model::G354,
        Model::G364Pdc0,
        Model::G364Pdca,
        Model::G365Pdc1,
        Model::G365Pdf1,
        Model::G366,
        Model::G370Pdf1,
        Model::G370Pds0,
        Model::G370Pdg0,
        Model::G370Pdt0,
    ];

    /// Name of the model in Epson's drivers.
    pub const fn name(self) -> &'static str {
        match self {
            Model::G320 => "G320PDG0",
            Model::G354 => "G354PDH0",
            Model::G364Pdc0 => "G364PDC0",
            Model::G364Pdca => "G364PDCA",
            Model::G365Pdc1 => "G365PDC1",
            Model::G365Pdf1 => "G365PDF1",
            Model::G366 => "G366PDG0",
            Model::G370Pdf1 => "G370PDF1",
            Model::G370Pds0 => "G370PDS0",
            Model::G370Pdg0 => "G370PDG0",
            Model::G370Pdt0 => "G370PDT0",
        }
    }

    /// A count of 16 bits, in deg/s and mg, and the time that a count of the increments stands for
    /// at range 0, s. `None`: no increments. There `esensorlib` gives the G320, G354 and G364 a
    /// scale and `ess_imu_driver` none, so they are not believed.
    fn scale(self) -> (f64, f64, Option<f64>) {
        const SLOW: Option<f64> = Some(1.0 / 1000.0);
        const FAST: Option<f64> = Some(1.0 / 2000.0);
        match self {
            Model::G320 => (1.0 / 125.0, 1.0 / 5.0, None),
            Model::G354 => (1.0 / 62.5, 1.0 / 5.0, None),
            Model::G364Pdc0 => (0.0075, 1.0 / 8.0, None),
            Model::G364Pdca => (0.00375, 1.0 / 8.0, None),
            Model::G365Pdc1 => (1.0 / 66.0, 1.0 / 6.25, FAST),
            Model::G365Pdf1 => (1.0 / 66.0, 1.0 / 2.5, FAST),
            Model::G366 | Model::G370Pdg0 => (1.0 / 66.0, 1.0 / 4.0, FAST),
            Model::G370Pdf1 => (1.0 / 66.0, 1.0 / 2.5, SLOW),
            Model::G370Pds0 => (1.0 / 150.0, 1.0 / 2.5, SLOW),
            Model::G370Pdt0 => (1.0 / 150.0, 1.0 / 4.0, FAST),
        }
    }

    /// Whether it has a larger accelerometer range (A_RANGE_CTRL).
    pub const fn has_two_ranges(self) -> bool {
        matches!(self, Model::G366 | Model::G370Pdg0 | Model::G370Pdt0)
    }
}

/// Units of the values that are corrected; `None` for a range or an output that the model does not
/// have.
pub(super) fn units(settings: &Settings) -> Option<Units> {
    let Settings { layout, model, .. } = *settings;
    let (dps, mg, step) = model.scale();
    let double = match settings.high_range {
        true if !model.has_two_ranges() => return None,
        true => 2.0,
        false => 1.0,
    };
    let unit = |field, rate: f64, range: u8| {
        let narrow = if layout.is_wide(field) {
            power_of_two(-16)
        } else {
            1.0
        };
        let is_increment = matches!(field, Field::DeltaAngle | Field::DeltaVelocity);
        let (quantity, scale) = if !is_increment {
            (Quantity::Rate, 1.0)
        } else if range < 16 {
            (Quantity::Increment, step? * power_of_two(range.into()))
        } else {
            return None;
        };
        Some(Unit {
            quantity,
            lsb: rate * scale * narrow,
        })
    };
    Some(Units {
        gyro: unit(layout.gyro_field(), dps * DEGREE, settings.angle_range)?,
        accel: unit(
            layout.accel_field(),
            double * mg * 1e-3 * G,
            settings.velocity_range,
        )?,
    })
}

impl Layout {
    /// Whether the corrected values are increments: angle, velocity.
    pub const fn increments(self) -> [bool; 2] {
        [self.has(Field::DeltaAngle), self.has(Field::DeltaVelocity)]
    }
}
