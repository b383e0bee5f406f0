//! The table of an ADIS at the board's SPI, and of one whose bursts come in frames over a UART.

use super::{Section, Sensor};
use crate::finding::Finding;
use firmware::wire::adis::{Form, Model, Rate, Settings};
use firmware::wire::{self, ImuFormat};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings that the bursts of an ADIS do not contain.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adis {
    /// Model with the digit of its gyro range, such as ADIS16495-2, or ADIS16470. Required. Source:
    /// the label.
    #[schemars(regex(pattern = "^ADIS16[0-9]{3}(-[123])?$"))]
    pub model: String,
    /// The bursts are sent in frames with a start mark and a CRC (ICD section 2), which a reader of
    /// a serial line can find. Default: false, as the sensor sends them. Source: what the
    /// navigation computer reads.
    #[serde(default)]
    pub framed: bool,
}

/// Settings that the frames of format `adis-uart` do not contain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AdisUart {
    /// Model with the digit of its gyro range. Default: ADIS16505-2. Source: the label.
    #[schemars(regex(pattern = "^ADIS16[0-9]{3}(-[123])?$"))]
    pub model: String,
}

impl Default for AdisUart {
    fn default() -> Self {
        Self {
            model: "ADIS16505-2".to_owned(),
        }
    }
}

impl Section for AdisUart {
    fn of(settings: &wire::Settings) -> Self {
        let wanted = settings.adis_uart.model;
        let same = |name: &String| model("", name).is_ok_and(|model| model == wanted);
        let name = names().find(same);
        name.map_or_else(Self::default, |model| Self { model })
    }

    fn apply(&self, _: &Sensor, to: &mut wire::Settings) -> Result<(), Finding> {
        to.adis_uart.model = model("sensor.adis_uart.model", &self.model)?;
        Ok(())
    }

    fn frame_len(&self, _: ImuFormat) -> usize {
        let model = model("sensor.adis_uart.model", &self.model);
        model.map_or(0, |model| 12 + model.form().bytes())
    }
}

impl Adis {
    /// The model of a device's settings, if there is one.
    pub(crate) fn of(settings: &Settings) -> Option<Self> {
        let framed = settings.framed;
        names()
            .map(|model| Self { model, framed })
            .find(|adis| adis.settings().as_ref() == Ok(settings))
    }

    /// Bursts a second to which a board sets the sensor if the file gives none, Hz.
    pub(super) fn rate_hz(&self) -> f64 {
        let form = self.settings().map_or(Form::Wide, |settings| settings.form);
        Rate::usual(form).hz
    }

    /// The finding if the sensor cannot be set to this rate, Hz.
    pub(crate) fn refused(&self, rate_hz: f64) -> Option<Finding> {
        let form = self.settings().ok()?.form;
        if Rate::near(form, rate_hz).is_some() {
            return None;
        }
        let fastest = Rate::fastest(form);
        let divided = |by: f64| (100.0 * fastest / by.max(1.0)).round() / 100.0;
        let by = fastest / rate_hz;
        let remedy = match by < 1.0 {
            true => format!("give {fastest} or less"),
            false => format!("give {} or {}", divided(by.ceil()), divided(by.floor())),
        };
        let model = &self.model;
        let problem = format!(
            "is {rate_hz}, which an {model} does not have: its rates are {fastest} Hz divided by a \
             whole number"
        );
        Some(Finding::wrong("sensor.rate_hz", problem, remedy))
    }

    /// The device's settings.
    pub(super) fn settings(&self) -> Result<Settings, Finding> {
        let model = model("sensor.adis.model", &self.model)?;
        let form = model.form();
        let units = model.units(form != Form::Narrow);
        let units = units.ok_or_else(|| unknown("sensor.adis.model", &self.model))?;
        Ok(Settings {
            form,
            units,
            framed: self.framed,
        })
    }
}

/// Names that a model may have.
fn names() -> impl Iterator<Item = String> {
    let products = [
        "16465", "16467", "16475", "16477", "16495", "16497", "16505", "16507", "16470", "16490",
        "16500",
    ];
    let digits = ["", "-1", "-2", "-3"];
    (0..products.len() * digits.len())
        .map(move |n| format!("ADIS{}{}", products[n / 4], digits[n % 4]))
}

fn unknown(key: &str, text: &str) -> Finding {
    Finding::wrong(
        key,
        format!("is '{text}', whose scales are not known"),
        "give ADIS16465, 16467, 16475, 16477, 16495, 16497, 16505 or 16507 with -1, -2 or -3, as \
         in \"ADIS16495-2\", or ADIS16470, ADIS16490 or ADIS16500",
    )
}

/// A model by its name.
fn model(key: &str, text: &str) -> Result<Model, Finding> {
    let wrong = || unknown(key, text);
    let (product, digit) = match text.split_once('-') {
        Some((product, digit)) => (product, digit.parse::<u8>().ok()),
        None => (text, None),
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
    if has_ranges != digit.is_some() || text.matches('-').count() > 1 {
        return Err(wrong());
    }
    Ok(model)
}
