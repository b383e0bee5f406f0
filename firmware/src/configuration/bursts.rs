//! How often an ADIS at the board's SPI is read.

use super::{Configuration, Parity, Sensor, SerialLines};
use crate::control::Field;
use crate::wire::adis::Rate;

impl Configuration {
    /// The configured rate of an ADIS at the SPI; `None`: the sensor is another one.
    ///
    /// # Errors
    /// [`Field::Rate`] if no such sensor has a rate near to the configured one,
    /// [`Field::SensorBaud`] if its bursts are more than the navigation line can carry.
    #[inline(never)] // seldom, by two callers
    pub fn bursts(&self) -> Result<Option<Rate>, Field> {
        let Some(Sensor::Spi(adis)) = &self.sensor else {
            return Ok(None);
        };
        let rate = Rate::near(adis.form, self.rate).ok_or(Field::Rate)?;
        let bits = self.lines.bits_of_a_byte() * adis.bytes() as u32;
        let fit = f64::from(bits) * rate.hz <= f64::from(self.lines.sensor_baud);
        fit.then_some(Some(rate)).ok_or(Field::SensorBaud)
    }
}

impl SerialLines {
    /// Bits of a byte on the sensor's and the navigation computer's line.
    #[must_use]
    pub fn bits_of_a_byte(&self) -> u32 {
        10 + u32::from(self.parity != Parity::None) + u32::from(self.two_stop_bits)
    }
}
