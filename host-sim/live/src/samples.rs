//! Decodes the bytes of the sensor's or the navigation line into samples in SI.

use firmware::sample::{Quantity, RawSample, Unit};
use firmware::wire::framer::Kind;
use firmware::wire::{Checked, Detector, Framer, ImuFormat, Settings};

/// Number of bytes that a framer takes at once.
const PIECE: usize = 64;
/// Rate above which an integrated value counts as wrapped, rad/s and m/s2.
const WRAPPED: [f64; 2] = [100.0, 1000.0];

/// One sample: rates of the axes x, y, z, rad/s, then specific forces, m/s2.
pub type Sample = [f64; 6];

/// Identifies a sample among its neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Key {
    /// The sensor's counter.
    Counter(u16),
    /// The time in the frame, s.
    Time(f64),
    /// Neither: only the order of the samples.
    Order,
}

/// A decoded sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecodedSample {
    /// Identifies it among its neighbours.
    pub key: Key,
    /// Its values.
    pub sample: Sample,
}

/// Finds the samples in a line's bytes.
pub struct Decoder {
    settings: Settings,
    finder: Finder,
    /// The last sample of integrated values.
    last: Option<[f64; 6]>,
}

enum Finder {
    Detects(Box<Detector>),
    Frames(Box<Framer>),
}

impl Decoder {
    /// A decoder of frames of this format; without one the format is detected.
    #[must_use]
    pub fn new(settings: Settings, format: Option<ImuFormat>) -> Self {
        let finder = match format {
            Some(format) => Finder::Frames(Box::new(Framer::new(format.configured(&settings)))),
            None => {
                let mut detector = Box::new(Detector::new());
                detector.restart(&settings);
                Finder::Detects(detector)
            }
        };
        Self {
            settings,
            finder,
            last: None,
        }
    }

    /// Passes the samples that end in these bytes to `take`.
    pub fn push(&mut self, bytes: &[u8], mut take: impl FnMut(DecodedSample)) {
        for piece in bytes.chunks(PIECE) {
            match &mut self.finder {
                Finder::Detects(detector) => {
                    if let Some(format) = detector.push(piece, |_, _| {}) {
                        self.finder = Finder::Frames(Box::new(Framer::new(format)));
                    }
                }
                Finder::Frames(framer) => {
                    framer.push(piece);
                    while let Some(event) = framer.next_event() {
                        if event.kind() == Kind::Frame
                            && let Some(frame) = event.frame()
                            && let Some(sample) = sample(&frame, &self.settings, &mut self.last)
                        {
                            take(sample);
                        }
                    }
                }
            }
        }
    }
}

/// The sample of a frame; `None` when its units are not known, or it is the first integrated one.
fn sample(
    frame: &Checked,
    settings: &Settings,
    last: &mut Option<[f64; 6]>,
) -> Option<DecodedSample> {
    let stream = frame.source().stream(settings, frame.content())?;
    let reading = frame.read().ok()?;
    let values: [f64; 6] = match reading.sample {
        RawSample::Counts { gyro, accel } => six(gyro, accel),
        RawSample::Floats { gyro, accel } => six(gyro, accel),
    };
    let units = [stream.units.gyro, stream.units.accel];
    let before = last.replace(values);
    let mut si = [0.0; 6];
    for (axis, value) in si.iter_mut().enumerate() {
        let Unit { quantity, lsb } = units[axis / 3];
        *value = lsb
            * match quantity {
                Quantity::Rate | Quantity::Average => values[axis],
                Quantity::Increment => values[axis] * stream.rate,
                Quantity::Integrated => (values[axis] - before?[axis]) * stream.rate,
            };
        if quantity == Quantity::Integrated && value.abs() > WRAPPED[axis / 3] {
            return None;
        }
    }
    let key = match (reading.counter, reading.time) {
        (Some(counter), _) => Key::Counter(counter),
        (None, Some(time)) => Key::Time(time),
        (None, None) => Key::Order,
    };
    Some(DecodedSample { key, sample: si })
}

fn six<T: Into<f64> + Copy>([a, b, c]: [T; 3], [x, y, z]: [T; 3]) -> [f64; 6] {
    [a, b, c, x, y, z].map(Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::configuration::Configuration;
    use host_device::hil::{Input, drive};

    /// A simulated drive at rest: the sum of the samples is gravity, and the detector and a given
    /// format find the same.
    #[test]
    fn the_samples_of_a_drive_at_rest_are_gravity() {
        let drive = drive(ImuFormat::Stim300, 2).expect("a drive");
        let mut settings = Configuration::default().wire_settings();
        // 250 Hz, as simulated
        settings.stim300.config = settings.stim300.config.with_sample_rate_code(1);
        let bytes: Vec<u8> = (drive.records.iter())
            .filter(|record| record.input == Input::Sensor)
            .flat_map(|record| record.bytes.clone())
            .collect();
        let found = |format| {
            let mut all = Vec::new();
            Decoder::new(settings, format).push(&bytes, |sample| all.push(sample));
            all
        };
        let (detected, known) = (found(None), found(Some(ImuFormat::Stim300)));
        assert!(known.len() > 200 && detected.len() > known.len() - 20);
        assert_eq!(known.last(), detected.last());
        let mean = |axis: usize| {
            let all = known.iter().map(|found| found.sample[axis]);
            all.sum::<f64>() / known.len() as f64
        };
        assert!((mean(5) + 9.81).abs() < 0.02, "{}", mean(5));
        assert!((0..3).all(|axis| mean(axis).abs() < 1e-3), "{}", mean(0));
    }

    #[test]
    fn damage_costs_no_other_sample() {
        let drive = drive(ImuFormat::Stim300, 1).expect("a drive");
        let settings = Configuration::default().wire_settings();
        let mut bytes: Vec<u8> = Vec::new();
        let sensor = drive.records.iter().filter(|of| of.input == Input::Sensor);
        for record in sensor {
            bytes.extend(&record.bytes);
        }
        let count = |bytes: &[u8]| {
            let mut count = 0;
            Decoder::new(settings, Some(ImuFormat::Stim300)).push(bytes, |_| count += 1);
            count
        };
        let whole = count(&bytes);
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x10;
        assert_eq!(count(&bytes), whole - 1);
    }
}
