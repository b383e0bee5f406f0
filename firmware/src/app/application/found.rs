//! An ADIS that the board has found at its SPI, against what the device was told.

use super::App;
use crate::configuration::Sensor;
use crate::wire::adis::{Found, Settings};
use crate::wire::command::fault;

/// A rate told and a rate found may differ so far, as a share.
const RATE: f64 = 0.02;

impl App<'_> {
    /// The board has found an ADIS and set it up. From now on it takes the place of the sensor's
    /// line ([`App::burst`]).
    ///
    /// If the device was told of another sensor, other units (fault UNITS) or another rate (fault
    /// RATE), then nothing is corrected: either is wrong, and the device cannot know which.
    pub fn found(&mut self, found: &Found) {
        self.adis = Some(*found);
        self.use_found();
        self.flow.forget();
        self.machine = self.machine.restarted();
    }

    /// Takes what was found into use.
    pub(super) fn use_found(&mut self) {
        let Some(found) = &self.adis else {
            return;
        };
        let mut settings = Settings {
            form: found.model.form(),
            units: found.units,
            framed: false,
        };
        let config = &mut self.flow.config;
        let told = config.told.as_ref();
        let bits = match told.map(|told| (told.sensor, told.rate)) {
            None | Some((None, _)) => 0,
            Some((Some(Sensor::Stream(_)), _)) => fault::UNITS,
            Some((Some(Sensor::Spi(told)), rate)) => {
                settings.framed = told.framed;
                let near = (rate - found.rate).abs() <= RATE * found.rate;
                let units = if told == settings { 0 } else { fault::UNITS };
                let rate = if near { 0 } else { fault::RATE };
                units | rate
            }
        };
        config.sensor.adis = Some(settings);
        config.sensor.rate = found.rate;
        self.flow.other_sensor = bits;
    }
}
