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
pub struct Found {
    /// Its model.
    pub model: Model,
    /// Units of its values.
    pub units: Units,
    /// Bursts a second after [`begin`], Hz.
    pub rate: f64,
}

/// Finds the model that answers. Without a sensor this takes some 0.5 ms at 0.7 MHz. A line that
/// nothing drives always reads one value, which is no product number.
///
/// # Errors
/// The bus's.
#[inline(never)] // once at start
pub fn find<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
) -> Result<Option<Found>, S::Error> {
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
        let form = model.form();
        Some(Found {
            model,
            units: model.units(form != Form::Narrow)?,
            rate: match form {
                Form::Narrow | Form::Wide => 2000.0 / f64::from(1 + DECIMATION),
                Form::Adis1649x => 4250.0 / f64::from(1 + DECIMATION_1649X),
            },
        })
    }))
}

/// Samples averaged to one, less 1: 1000 bursts a second of 2000.
const DECIMATION: u16 = 1;
/// 1062.5 of 4250.
const DECIMATION_1649X: u16 = 3;

/// Sets the rate and the form of burst, and reads both back: false if the sensor does not keep
/// them.
///
/// # Errors
/// The bus's.
#[inline(never)]
pub fn begin<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
    model: Model,
) -> Result<bool, S::Error> {
    let mut adis = Adis::new(spi, model.form());
    match model.form() {
        Form::Narrow => keeps(&mut adis, delay, register::DEC_RATE, DECIMATION),
        Form::Wide => {
            let rate = keeps(&mut adis, delay, register::DEC_RATE, DECIMATION)?;
            let options = adis.read_register(delay, register::MSC_CTRL)?;
            let options = (options | BURST32) & !BURST_SEL;
            Ok(keeps(&mut adis, delay, register::MSC_CTRL, options)? && rate)
        }
        Form::Adis1649x => {
            adis.write_byte(delay, register::PAGE, 3)?;
            let rate = register::DEC_RATE_1649X;
            let kept = keeps(&mut adis, delay, rate, DECIMATION_1649X)?;
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

    fn found(expected: &[Vec<Transaction<u8>>]) -> Option<Found> {
        let mut spi = Mock::new(&expected.concat());
        let found = find(&mut spi, &mut NoopDelay::new()).expect("the bus works");
        spi.done();
        found
    }

    fn begun(model: Model, expected: &[Vec<Transaction<u8>>]) -> bool {
        let mut spi = Mock::new(&expected.concat());
        let kept = begin(&mut spi, &mut NoopDelay::new(), model).expect("the bus works");
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
        assert!(begun(Model::Adis16470, &[rate.clone(), read(0x64, 1)]));
        assert!(!begun(Model::Adis16470, &[rate.clone(), read(0x64, 0)]));
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
        assert!(begun(Model::Adis16507(1), &wide(0x02C1)));
        assert!(!begun(Model::Adis16507(1), &wide(0x00C1)));
        assert!(begun(
            Model::Adis16490,
            &[
                write([0x80, 3]),
                write([0x8C, 3]),
                write([0x8D, 0]),
                read(0x0C, 3),
                write([0x80, 0]),
            ]
        ));
    }
}
