//! An ADIS that the board has found at its SPI, against what the device was told.

use super::App;
use crate::configuration::Sensor;
use crate::wire::adis::{Found, Rate, Settings};
use crate::wire::command::fault;

impl App<'_> {
    /// The board has found an ADIS and set it up. From now on it takes the place of the sensor's
    /// line ([`App::burst`]).
    ///
    /// If the device was told of another sensor, other units (fault UNITS) or another rate (fault
    /// RATE), then nothing is corrected: either is wrong, and the device cannot know which.
    pub fn found(&mut self, found: &Found) {
        self.spi.found = Some(*found);
        self.use_found();
        self.flow.forget();
        self.machine = self.machine.restarted();
    }

    /// The sensor is an ADIS at the SPI: one that was found, or that the device is told of. It has
    /// no format to be found, and bytes on the sensor's line are nobody's.
    #[inline(always)]
    pub(super) fn is_at_spi(&self) -> bool {
        self.flow.config.sensor.adis.is_some()
    }

    /// The rate to which the board sets an ADIS that it finds; `None`: the usual one, because no
    /// other is told, or one that the sensor or the navigation line does not have (fault RATE).
    #[must_use]
    pub fn burst_rate(&self) -> Option<Rate> {
        let configuration = self.flow.config.configuration.as_ref()?;
        configuration.bursts().ok().flatten()
    }

    /// Whether the board must find its ADIS anew and set it, since another rate is told from now
    /// on. It is said once.
    pub fn finds_anew(&mut self) -> bool {
        core::mem::take(&mut self.spi.set_up)
    }

    /// Takes what was found into use.
    pub(super) fn use_found(&mut self) {
        let Some(found) = self.spi.found else {
            return;
        };
        let mut settings = Settings {
            form: found.model.form(),
            units: found.units,
            framed: false,
        };
        let config = &mut self.flow.config;
        let configuration = config.configuration.as_ref();
        let bits =
            match configuration.map(|configuration| (configuration.sensor, configuration.rate)) {
                None | Some((None, _)) => 0,
                Some((Some(Sensor::Stream(_)), _)) => fault::UNITS,
                Some((Some(Sensor::Spi(configuration)), rate)) => {
                    settings.framed = configuration.framed;
                    let near = (rate - found.rate).abs() <= Rate::OFF * found.rate;
                    let units = if configuration == settings {
                        0
                    } else {
                        fault::UNITS
                    };
                    let rate = if near { 0 } else { fault::RATE };
                    units | rate
                }
            };
        config.sensor.adis = Some(settings);
        config.sensor.rate = found.rate;
        self.flow.health.other_sensor = bits;
        self.spi.set_up = found.at(self.burst_rate()).rate != found.rate;
    }
}
