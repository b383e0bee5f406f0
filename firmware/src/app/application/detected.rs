//! An ADIS that the board has detected at its SPI, compared with the configuration.

use super::App;
use crate::configuration::Sensor;
use crate::wire::adis::{DetectedSensor, Rate, Settings};
use crate::wire::command::fault;

impl App<'_> {
    /// The board has detected an ADIS and set it up. From now on it replaces the sensor's line
    /// ([`App::burst`]).
    ///
    /// If the configuration has another sensor, other units (fault UNITS) or another rate (fault
    /// RATE), then nothing is corrected: either is wrong, and the device cannot know which.
    pub fn detected(&mut self, detected: &DetectedSensor) {
        self.spi.detected = Some(*detected);
        self.use_detected();
        self.flow.forget();
        self.machine = self.machine.restarted();
    }

    /// Whether the sensor is an ADIS at the SPI: detected or configured. It has no format to be
    /// detected, and bytes on the sensor's line are ignored.
    #[inline(always)]
    pub(super) fn is_at_spi(&self) -> bool {
        self.flow.config.sensor.adis.is_some()
    }

    /// The rate to which the board sets an ADIS that it detects; `None`: the usual one, because no
    /// other is configured, or one that the sensor or the navigation line does not have (fault
    /// RATE).
    #[must_use]
    pub fn burst_rate(&self) -> Option<Rate> {
        let configuration = self.flow.config.configuration.as_ref()?;
        configuration.bursts().ok().flatten()
    }

    /// Called once a second. A sensor that restarts by itself begins with its factory settings:
    /// bursts of another form, whose checksums are wrong here, at another rate. Where that shows,
    /// the board must set it up again.
    pub(super) fn look_for_settings(&mut self) {
        let odd = self.flow.health.faults & (fault::UNKNOWN_FORMAT | fault::RATE);
        let new = odd & !core::mem::replace(&mut self.spi.odd, odd);
        self.spi.set_up |= new != 0 && self.spi.detected.is_some();
    }

    /// Whether the board must detect and set up its ADIS again, because the configured rate has
    /// changed, or because the sensor has lost its settings. True once for each change.
    pub fn must_detect_again(&mut self) -> bool {
        core::mem::take(&mut self.spi.set_up)
    }

    /// Takes what was found into use.
    pub(super) fn use_detected(&mut self) {
        let Some(detected) = self.spi.detected else {
            return;
        };
        let mut settings = Settings {
            form: detected.model.form(),
            units: detected.units,
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
                    let near = (rate - detected.rate).abs() <= Rate::OFF * detected.rate;
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
        config.sensor.rate = detected.rate;
        self.flow.health.other_sensor = bits;
        self.spi.set_up = detected.at(self.burst_rate()).rate != detected.rate;
    }
}
