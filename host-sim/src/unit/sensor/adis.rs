//! The table of an ADIS at the board's SPI.

use crate::unit::finding::Finding;
use firmware::wire::adis::{Form, Model, Settings};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Samples a second of an ADIS as delivered, Hz (family 1647x and 1650x; 1649x: 4250).
pub(super) const RATE_HZ: f64 = 2000.0;

/// What the bursts of an ADIS do not tell.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adis {
    /// Model with the digit of its gyro range, such as ADIS16495-2, or ADIS16470. Required. Source:
    /// the label.
    #[schemars(regex(pattern = "^ADIS16[0-9]{3}(-[123])?$"))]
    pub model: String,
}

impl Adis {
    /// The device's settings.
    pub(super) fn settings(&self) -> Result<Settings, Finding> {
        let wrong = || {
            Finding::wrong(
                "sensor.adis.model",
                format!("is '{}', whose scales are not known", self.model),
                "give ADIS16465, 16467, 16475, 16477, 16495, 16497, 16505 or 16507 with -1, -2 or \
                 -3, as in \"ADIS16495-2\", or ADIS16470, ADIS16490 or ADIS16500",
            )
        };
        let (product, digit) = match self.model.split_once('-') {
            Some((product, digit)) => (product, digit.parse::<u8>().ok()),
            None => (self.model.as_str(), None),
        };
        let number = product.strip_prefix("ADIS").and_then(|n| n.parse().ok());
        // bits 2 and 3 of the register RANG_MDL
        let range = match digit {
            None | Some(1) => 0b0011,
            Some(2) => 0b0111,
            Some(3) => 0b1111,
            Some(_) => return Err(wrong()),
        };
        let model = number.and_then(|number| Model::from_registers(number, range));
        let model = model.ok_or_else(wrong)?;
        let has_ranges = !matches!(
            model,
            Model::Adis16470 | Model::Adis16490 | Model::Adis16500
        );
        if has_ranges != digit.is_some() || self.model.matches('-').count() > 1 {
            return Err(wrong());
        }
        let form = model.form();
        let units = model.units(form != Form::Narrow).ok_or_else(wrong)?;
        Ok(Settings { form, units })
    }
}
