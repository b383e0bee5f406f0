//! The simulated sensor: the frames of every stream format, or bursts of an ADIS at the SPI.

use crate::random::Random;
use firmware::configuration::Sensor as ConfiguredSensor;
use firmware::sample::RawSample;
use firmware::wire::adis::{self, Burst, DetectedSensor, Form, Model, Rate};
use firmware::wire::framer::LONGEST;
use firmware::wire::sequence::{Gap, Last};
use firmware::wire::{Checked, Fields, ImuFormat, Settings, Simulated};

/// Counts of the gyros and of the accelerometers.
pub type Counts = [[i32; 3]; 2];

/// One ADIS of each form of burst.
const ADIS: [Model; 3] = [
    Model::Adis16465(1),
    Model::Adis16505(2),
    Model::Adis16495(1),
];

/// What carries the samples.
#[derive(Debug, Clone, Copy)]
pub enum Port {
    /// Frames of this format on the sensor's line.
    Line(ImuFormat),
    /// Bursts that the board fetches.
    Spi(DetectedSensor),
}

impl Port {
    /// Whether these bytes are a good frame or burst.
    pub fn is_frame(self, bytes: &mut [u8]) -> bool {
        match self {
            Port::Line(format) => Checked::new(format, bytes).is_ok(),
            Port::Spi(adis) => adis.model.form().check(bytes).is_ok(),
        }
    }
}

/// A sensor to simulate.
#[derive(Debug, Clone, Copy)]
pub struct Sensor {
    /// What carries its samples.
    pub port: Port,
    /// The device's settings for it.
    pub settings: Settings,
    /// How its frames are made; `None` for bursts.
    simulated: Option<Simulated>,
    /// Advance of its counter from sample to sample.
    step: u32,
    /// Increment of a count: rad, m/s.
    count: [f64; 2],
}

impl Sensor {
    /// The sensors with this rate, Hz, on the sensor's line.
    pub fn on_line(rate: u32) -> impl Iterator<Item = Sensor> {
        ImuFormat::ALL.into_iter().flat_map(move |format| {
            let sensors = format.simulated().iter().filter(|s| s.has_accel);
            sensors.filter_map(move |simulated| Sensor::fitting(format, *simulated, rate))
        })
    }

    /// The sensors with this rate, Hz, at the SPI.
    pub fn at_spi(rate: u32) -> impl Iterator<Item = Sensor> {
        let adis = ADIS.into_iter();
        adis.filter_map(move |model| Sensor::adis(model, rate))
    }

    /// Any sensor with this rate, Hz: one in three is at the SPI. `None`: there is none.
    pub fn draw(rate: u32, random: &mut Random) -> Option<Sensor> {
        let at_spi = Sensor::at_spi(rate).count() as u32;
        if at_spi > 0 && random.below(3) == 0 {
            return Sensor::at_spi(rate).nth(random.below(at_spi) as usize);
        }
        let on_line = Sensor::on_line(rate).count() as u32;
        Sensor::on_line(rate).nth(random.below(on_line) as usize)
    }

    /// `None` for a rate that this ADIS does not have.
    fn adis(model: Model, rate: u32) -> Option<Sensor> {
        let (form, rate) = (model.form(), f64::from(rate));
        if Rate::near(form, rate)?.hz != rate {
            return None;
        }
        let units = model.units(form != Form::Narrow)?;
        let settings = Settings {
            rate,
            adis: Some(adis::Settings {
                form,
                units,
                framed: false,
            }),
            ..Settings::DEFAULT
        };
        let port = Port::Spi(DetectedSensor { model, units, rate });
        Some(Sensor {
            port,
            settings,
            simulated: None,
            step: 1,
            count: [units.gyro.lsb / rate, units.accel.lsb / rate],
        })
    }

    fn fitting(format: ImuFormat, simulated: Simulated, rate: u32) -> Option<Sensor> {
        let mut settings = simulated.settings();
        settings.rate = rate.into();
        let format = format.configured(&settings);
        [1, 2, 4, 8].into_iter().find_map(|step| {
            let mut sensor = Sensor {
                port: Port::Line(format),
                settings,
                simulated: Some(simulated),
                step,
                count: [0.0; 2],
            };
            sensor.count = sensor.worth(format, rate.into())?;
            Some(sensor)
        })
    }

    /// Increment of a count for a device with these settings; `None` where the device finds another
    /// rate, or missing frames.
    fn worth(&self, format: ImuFormat, rate: f64) -> Option<[f64; 2]> {
        const PROBE: i32 = 1 << 10;
        let (mut last, mut sample, mut units) = (Last::default(), None, None);
        for number in 0..3 {
            let mut buffer = [0; LONGEST];
            let len = self.emit(number, 1.0 / rate, [[PROBE; 3]; 2], 25.0, &mut buffer);
            let frame = Checked::new(format, buffer.get_mut(..len)?).ok()?;
            let stream = frame.source().stream(&self.settings, frame.content())?;
            let reading = frame.read().ok()?;
            if stream.rate != rate || stream.gap(&mut last, &reading) != Gap::None {
                return None;
            }
            sample = Some(reading.sample);
            units = Some(stream.units);
        }
        let [gyro, accel] = match sample? {
            RawSample::Counts { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
            RawSample::Floats { gyro, accel } => [gyro[0], accel[0]].map(f64::from),
        };
        let (probe, period, units) = (f64::from(PROBE), 1.0 / rate, units?);
        let rad = units.gyro.increment(period)? * gyro / probe;
        let mps = units.accel.increment(period)? * accel / probe;
        (rad > 0.0 && mps > 0.0).then_some([rad, mps])
    }

    /// The device's configuration of it; `None` without one of either.
    #[must_use]
    pub fn configured(&self) -> Option<ConfiguredSensor> {
        Some(match self.port {
            Port::Line(format) => ConfiguredSensor::Stream(format.settings(&self.settings)),
            Port::Spi(_) => ConfiguredSensor::Spi(self.settings.adis?),
        })
    }

    /// Writes a frame or a burst and returns its length.
    pub fn emit(
        &self,
        index: u32,
        period: f64,
        counts: Counts,
        celsius: f64,
        into: &mut [u8],
    ) -> usize {
        let [gyro, accel] = counts;
        let time = f64::from(index.wrapping_add(1)) * period;
        let index = index.wrapping_mul(self.step);
        let Some(simulated) = &self.simulated else {
            let burst = Burst {
                gyro,
                accel,
                temperature: (10.0 * celsius) as i16,
                counter: index as u16,
                ..Burst::default()
            };
            return self.burst(&burst, into);
        };
        let fields = Fields {
            index,
            time,
            gyro,
            accel,
            rest: self.rest(celsius).unwrap_or(simulated.rest),
        };
        (simulated.emit)(&fields, into).unwrap_or(0)
    }

    fn burst(&self, burst: &Burst, into: &mut [u8]) -> usize {
        let mut put = |reply: &[u8]| {
            let slot = into.get_mut(..reply.len());
            slot.map_or(0, |slot| {
                slot.copy_from_slice(reply);
                reply.len()
            })
        };
        match self.settings.adis.map(|adis| adis.form) {
            Some(Form::Narrow) => put(&burst.emit16()),
            Some(Form::Wide) => put(&burst.emit32()),
            Some(Form::Adis1649x) => put(&burst.emit_1649x(burst.counter.is_multiple_of(2))),
            None => 0,
        }
    }

    /// [`Fields::rest`] of a format that has the temperature there.
    fn rest(&self, celsius: f64) -> Option<u32> {
        let whole = |scale: f64| (scale * celsius) as i32 as u32;
        match self.port {
            Port::Line(ImuFormat::SbgEcom) => Some(whole(256.0)),
            Port::Line(ImuFormat::AdisUart) => Some(whole(10.0)),
            Port::Line(ImuFormat::Hg4930) => Some(whole(1.0)),
            Port::Line(ImuFormat::Mavlink(_)) => Some((celsius as f32).to_bits()),
            _ => None,
        }
    }

    /// Increment of a count: rad, m/s.
    #[must_use]
    pub fn count(&self) -> [f64; 2] {
        self.count
    }

    /// The largest count of its fields.
    #[must_use]
    pub fn largest(&self) -> i32 {
        let narrow = self.settings.adis.map(|adis| adis.form == Form::Narrow);
        let bits = match (&self.simulated, narrow) {
            (Some(simulated), _) => simulated.bits.clamp(2, 32),
            (None, Some(true)) => 16,
            (None, _) => 32,
        };
        ((1i64 << (bits - 1)) - 1) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every sensor says how warm it is, but those whose thermometer the device does not read, and
    /// three formats whose
    /// simulated frames have a temperature of their own.
    #[test]
    fn sensors_state_their_temperature() {
        let (mut stated, mut bursts) = (0, 0);
        for rate in [100, 200, 250, 500, 1000] {
            for sensor in Sensor::on_line(rate).chain(Sensor::at_spi(rate)) {
                let mut buffer = [0; LONGEST];
                let period = 1.0 / f64::from(rate);
                let len = sensor.emit(7, period, [[9; 3]; 2], 31.5, &mut buffer);
                let bytes = &mut buffer[..len];
                let frame = match (sensor.port, &sensor.settings.adis) {
                    (Port::Spi(_), Some(adis)) => Checked::burst(adis, bytes),
                    (Port::Spi(_), None) => unreachable!("an ADIS has settings"),
                    (Port::Line(format), _) => Checked::new(format, bytes),
                };
                let reading = frame.expect("a frame").read().expect("a sample");
                bursts += u32::from(matches!(sensor.port, Port::Spi(_)));
                let fixed = matches!(
                    sensor.port,
                    Port::Line(ImuFormat::VectorNav(_) | ImuFormat::Stim300 | ImuFormat::Xsens)
                );
                if let (Some(celsius), false) = (reading.temperature, fixed) {
                    stated += 1;
                    assert!(
                        celsius.iter().all(|c| (c - 31.5).abs() <= 0.5),
                        "{sensor:?}"
                    );
                }
            }
        }
        assert!(stated > 10 && bursts == 11, "{stated}, {bursts}");
    }
}
