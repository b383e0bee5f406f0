//! Which ADIS answers at an SPI device, if any, and its set-up.

use super::Model;
use super::spi::{Adis, Form, register};
use crate::sample::Units;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;

/// BURST32 of MSC_CTRL, and BURST_SEL, which would replace rates by increments.
const BURST32: u16 = 1 << 9;
const BURST_SEL: u16 = 1 << 8;
/// After so long a register write has taken effect, microseconds: far more than the stall time.
const SETTLE_US: u32 = 1000;

/// The sensor that answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectedSensor {
    /// Model of the sensor.
    pub model: Model,
    /// Units of its values.
    pub units: Units,
    /// Bursts a second after [`begin`], Hz.
    pub rate: f64,
}

impl DetectedSensor {
    /// This sensor at the configured rate, if that is for sensors of its form, else at the usual
    /// one.
    #[must_use]
    #[inline(never)] // seldom, by two callers
    pub fn at(self, configured: Option<Rate>) -> DetectedSensor {
        let form = self.model.form();
        let configured = configured.filter(|configured| configured.form == form);
        let Rate { hz, .. } = configured.unwrap_or(Rate::usual(form));
        DetectedSensor { rate: hz, ..self }
    }
}

/// Rate of the bursts of sensors with this form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// The form.
    pub form: Form,
    /// Bursts a second, Hz: [`Rate::fastest`] divided by a whole number.
    pub hz: f64,
}

impl Rate {
    /// Largest difference between configured and actual rate, as a share.
    pub const OFF: f64 = 0.02;

    /// Usual rate of a sensor without a configured one, about 1000 Hz.
    #[must_use]
    pub fn usual(form: Form) -> Rate {
        Rate::divided(form, if form == Form::Adis1649x { 4 } else { 2 })
    }

    /// The rate nearest to this one, Hz. `None`: it is more than [`Rate::OFF`] away, or less than 1
    /// Hz.
    #[must_use]
    pub fn near(form: Form, hz: f64) -> Option<Rate> {
        let rate = Rate::divided(form, divider(form, hz));
        let near = (rate.hz - hz).abs() <= Rate::OFF * rate.hz;
        (near && rate.hz >= 1.0).then_some(rate)
    }

    /// Rate without decimation, Hz (Linux adis16475 and adis16480: 2000 and 4250, divided by 1 up
    /// to 2000 and 4250).
    #[must_use]
    pub fn fastest(form: Form) -> f64 {
        match form {
            Form::Narrow | Form::Wide => 2000.0,
            Form::Adis1649x => 4250.0,
        }
    }

    fn divided(form: Form, by: u16) -> Rate {
        let hz = Rate::fastest(form) / f64::from(by);
        Rate { form, hz }
    }
}

/// The whole number that gives nearly this rate, Hz; at least 1.
#[inline(never)]
fn divider(form: Form, hz: f64) -> u16 {
    ((Rate::fastest(form) / hz + 0.5) as u16).max(1) // `as` saturates
}

/// Detects the model that answers, to be set to the configured rate ([`DetectedSensor::at`]).
/// Without a sensor this takes some 0.5 ms at 0.7 MHz. A line that nothing drives always reads one
/// value, which is no product number.
///
/// # Errors
/// Errors of the SPI bus.
#[inline(never)] // once at start
pub fn find<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
    configured: Option<Rate>,
) -> Result<Option<DetectedSensor>, S::Error> {
    let mut adis = Adis::new(spi, Form::Narrow);
    let product = adis.read_register(delay, register::PRODUCT_ID)?;
    let range = adis.read_register(delay, register::RANGE)?;
    let mut model = Model::from_registers(product, range);
    if model.is_none() {
        adis.write_byte(delay, register::PAGE, 0)?;
        let product = adis.read_register(delay, register::PRODUCT_ID_1649X)?;
        adis.write_byte(delay, register::PAGE, 3)?;
        let range = adis.read_register(delay, register::RANGE_1649X)?;
        adis.write_byte(delay, register::PAGE, 0)?;
        model = Model::from_registers(product, range);
        // the answer must be of the family of this request
        model = model.filter(|model| model.form() == Form::Adis1649x);
    } else {
        model = model.filter(|model| model.form() != Form::Adis1649x);
    }
    Ok(model.and_then(|model| {
        let found = DetectedSensor {
            model,
            units: model.units(model.form() != Form::Narrow)?,
            rate: 0.0,
        };
        Some(found.at(configured))
    }))
}

/// Sets the rate and the form of burst, and reads both back: false if the sensor does not keep
/// them.
///
/// # Errors
/// The bus's.
#[inline(never)]
pub fn begin<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
    found: &DetectedSensor,
) -> Result<bool, S::Error> {
    let form = found.model.form();
    let mut adis = Adis::new(spi, form);
    let decimation = divider(form, found.rate) - 1; // samples averaged to one, less 1
    match form {
        Form::Narrow => keeps(&mut adis, delay, register::DEC_RATE, decimation),
        Form::Wide => {
            let rate = keeps(&mut adis, delay, register::DEC_RATE, decimation)?;
            let options = adis.read_register(delay, register::MSC_CTRL)?;
            let options = (options | BURST32) & !BURST_SEL;
            Ok(keeps(&mut adis, delay, register::MSC_CTRL, options)? && rate)
        }
        Form::Adis1649x => {
            adis.write_byte(delay, register::PAGE, 3)?;
            let rate = register::DEC_RATE_1649X;
            let kept = keeps(&mut adis, delay, rate, decimation)?;
            adis.write_byte(delay, register::PAGE, 0)?;
            Ok(kept)
        }
    }
}

/// Writes a register and reads it back.
fn keeps<S: SpiDevice>(
    adis: &mut Adis<&mut S>,
    delay: &mut impl DelayNs,
    address: u8,
    value: u16,
) -> Result<bool, S::Error> {
    adis.write_register(delay, address, value)?;
    delay.delay_us(SETTLE_US);
    Ok(adis.read_register(delay, address)? == value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use embedded_hal_mock::eh1::spi::{Mock, Transaction};
    use std::vec;
    use std::vec::Vec;

    fn write(bytes: [u8; 2]) -> Vec<Transaction<u8>> {
        vec![
            Transaction::transaction_start(),
            Transaction::write_vec(bytes.to_vec()),
            Transaction::transaction_end(),
        ]
    }

    fn read(address: u8, value: u16) -> Vec<Transaction<u8>> {
        let mut all = write([address, 0]);
        all.extend([
            Transaction::transaction_start(),
            Transaction::read_vec(value.to_be_bytes().to_vec()),
            Transaction::transaction_end(),
        ]);
        all
    }

    fn found(expected: &[Vec<Transaction<u8>>]) -> Option<DetectedSensor> {
        let mut spi = Mock::new(&expected.concat());
        let found = find(&mut spi, &mut NoopDelay::new(), None).expect("the bus works");
        spi.done();
        found
    }

    /// Set to this rate, Hz; 0: to the usual one.
    fn begun(model: Model, hz: f64, expected: &[Vec<Transaction<u8>>]) -> bool {
        let form = model.form();
        let found = DetectedSensor {
            model,
            units: model.units(form != Form::Narrow).expect("a range"),
            rate: 0.0,
        };
        let found = found.at(Rate::near(form, hz));
        let mut spi = Mock::new(&expected.concat());
        let kept = begin(&mut spi, &mut NoopDelay::new(), &found).expect("the bus works");
        spi.done();
        kept
    }

    #[test]
    fn a_1647x_is_found_at_once() {
        let found = found(&[read(0x72, 16475), read(0x5E, 0x0007)]).expect("an ADIS");
        assert_eq!((found.model, found.rate), (Model::Adis16475(2), 1000.0));
        assert_eq!(Some(found.units), Model::Adis16475(2).units(false));
    }

    #[test]
    fn a_1649x_is_found_on_its_pages() {
        let pages = |first, second, product, range| {
            found(&[
                read(0x72, first),
                read(0x5E, second),
                write([0x80, 0]),
                read(0x7E, product),
                write([0x80, 3]),
                read(0x12, range),
                write([0x80, 0]),
            ])
        };
        let found = pages(0, 0, 16497, 0x000F).expect("an ADIS");
        assert_eq!((found.model, found.rate), (Model::Adis16497(3), 1062.5));
        for value in [0, 0xFFFF, 0x00FF] {
            assert_eq!(pages(value, value, value, value), None, "nobody there");
        }
        assert_eq!(pages(0, 0, 16475, 3), None, "it would have answered before");
    }

    #[test]
    fn set_up_is_read_back() {
        let rate = [write([0xE4, 1]), write([0xE5, 0])].concat();
        assert!(begun(Model::Adis16470, 0.0, &[rate.clone(), read(0x64, 1)]));
        assert!(!begun(
            Model::Adis16470,
            0.0,
            &[rate.clone(), read(0x64, 0)]
        ));
        let wide = |read_back| {
            [
                rate.clone(),
                read(0x64, 1),
                read(0x60, 0x01C1),
                write([0xE0, 0xC1]),
                write([0xE1, 0x02]),
                read(0x60, read_back),
            ]
        };
        assert!(begun(Model::Adis16507(1), 0.0, &wide(0x02C1)));
        assert!(!begun(Model::Adis16507(1), 0.0, &wide(0x00C1)));
        let paged = |low, high, read_back| {
            [
                write([0x80, 3]),
                write([0x8C, low]),
                write([0x8D, high]),
                read(0x0C, read_back),
                write([0x80, 0]),
            ]
        };
        assert!(begun(Model::Adis16490, 0.0, &paged(3, 0, 3)));
        assert!(begun(Model::Adis16490, 4250.0, &paged(0, 0, 0)));
        assert!(begun(Model::Adis16490, 10.0, &paged(0xA8, 1, 424)));
        let slow = [write([0xE4, 0xC7]), write([0xE5, 0]), read(0x64, 199)];
        assert!(begun(Model::Adis16470, 10.0, &slow));
    }

    #[test]
    fn rates_are_a_whole_number_apart() {
        use Form::{Adis1649x, Narrow, Wide};
        let near = |form, hz| Rate::near(form, hz).map(|rate| rate.hz);
        for (form, hz, is) in [
            (Wide, 2000.0, Some(2000.0)),
            (Wide, 1985.0, Some(2000.0)),
            (Narrow, 700.0, None),
            (Narrow, 666.7, Some(2000.0 / 3.0)),
            (Narrow, 1500.0, None),
            (Narrow, 2100.0, None),
            (Narrow, 1.0, Some(1.0)),
            (Narrow, 0.99, None),
            (Adis1649x, 4250.0, Some(4250.0)),
            (Adis1649x, 2000.0, None),
            (Adis1649x, 1.0, Some(1.0)),
            (Adis1649x, 0.0, None),
            (Adis1649x, -5.0, None),
            (Wide, f64::NAN, None),
            (Wide, f64::INFINITY, None),
        ] {
            assert_eq!(near(form, hz), is, "{form:?} {hz}");
        }
        assert_eq!(Rate::usual(Wide).hz, 1000.0);
        assert_eq!(Rate::usual(Adis1649x).hz, 1062.5);
    }

    /// A rate configured for sensors of another form does not apply.
    #[test]
    fn a_rate_applies_to_its_form_only() {
        let at = |configured| {
            let expected = [read(0x72, 16507), read(0x5E, 0x0003)];
            let mut spi = Mock::new(&expected.concat());
            let found = find(&mut spi, &mut NoopDelay::new(), configured).expect("the bus works");
            spi.done();
            found.expect("an ADIS").rate
        };
        assert_eq!(at(Rate::near(Form::Wide, 2000.0)), 2000.0);
        assert_eq!(at(Rate::near(Form::Narrow, 2000.0)), 1000.0);
        assert_eq!(at(None), 1000.0);
    }
}
