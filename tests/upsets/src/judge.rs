//! Compares the output of the device after an upset with its input.

use crate::device::{DeviceOutput, Scenario};
use firmware::configuration::Configuration;
use firmware::sample::RawSample;
use firmware::wire::{Checked, ImuFormat};

/// How a trial ended, from harmless to harmful.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// Every byte as without the upset.
    Same,
    /// Corrections differed within their limit. In the last second they were as without the upset.
    Recovered,
    /// Corrections differ within their limit until the end.
    Bounded,
    /// The device noticed, and passes samples as they are.
    Raw,
    /// Frames were lost or cut, none was wrong, and in the last second all left.
    Lost,
    /// The output stopped: the watchdog would restart the device.
    Silent,
    /// The process ended: on the target a fault of the processor, which restarts the device.
    Fault,
    /// It never ended: the watchdog would restart the device.
    Hang,
    /// A check failed that only a test build has.
    Check,
    /// Good frames whose values are off by more than the limit.
    Beyond,
    /// Good frames in which something other than values was changed, or frames that were not
    /// received.
    Forged,
}

impl Verdict {
    /// All verdicts.
    pub const ALL: [Verdict; 11] = [
        Verdict::Same,
        Verdict::Recovered,
        Verdict::Bounded,
        Verdict::Raw,
        Verdict::Lost,
        Verdict::Silent,
        Verdict::Fault,
        Verdict::Hang,
        Verdict::Check,
        Verdict::Beyond,
        Verdict::Forged,
    ];

    /// As one letter.
    #[must_use]
    pub fn letter(self) -> char {
        char::from(b'a' + self as u8)
    }

    /// The inverse of [`Verdict::letter`].
    #[must_use]
    pub fn of(letter: char) -> Option<Verdict> {
        Verdict::ALL.into_iter().find(|v| v.letter() == letter)
    }
}

/// Judges trials.
pub struct Judge {
    format: ImuFormat,
    /// Largest correction of a triad's value, counts, with one for rounding.
    bound: [f64; 2],
    without: DeviceOutput,
    /// Frames of the last second.
    second: usize,
}

impl Judge {
    /// A judge by the device's configuration and by the output without an upset. `None`: no such
    /// stream.
    #[must_use]
    pub fn new(
        scenario: Scenario,
        configuration: &Configuration,
        without: DeviceOutput,
    ) -> Option<Judge> {
        let format = ImuFormat::Stim300;
        let stream =
            firmware::wire::Source::Stream(format).stream(&configuration.wire_settings(), 0x90)?;
        let period = 1.0 / stream.rate;
        let counts =
            |limit: f32, count: Option<f64>| Some(f64::from(limit) * period / count? + 1.0);
        let limit = configuration.correction.limit;
        let bound = [
            counts(limit.gyro, stream.units.gyro.increment(period))?,
            counts(limit.accel, stream.units.accel.increment(period))?,
        ];
        Some(Judge {
            format,
            bound: if scenario == Scenario::Bypass {
                [0.0; 2]
            } else {
                bound
            },
            without,
            second: stream.rate as usize,
        })
    }

    /// Judges a trial.
    pub fn judge<'a>(&self, came: impl Iterator<Item = &'a [u8]>, left: &DeviceOutput) -> Verdict {
        let mut worst = Verdict::Same;
        let frames = left.after.len();
        let mut raw = 0;
        for (number, (came, sent)) in came.zip(&left.after).enumerate() {
            let late = number + self.second >= frames;
            let verdict = self.frame(came, sent);
            raw += usize::from(late && sent == came);
            let without = &self.without.after[number];
            worst = worst.max(match verdict {
                Verdict::Same if sent == without => Verdict::Same,
                Verdict::Same if late => Verdict::Bounded,
                Verdict::Same => Verdict::Recovered,
                Verdict::Lost if late => Verdict::Silent,
                other => other,
            });
        }
        let noticed = left.faults != self.without.faults || left.mended != self.without.mended;
        if worst == Verdict::Bounded && noticed && raw >= self.second {
            return Verdict::Raw;
        }
        worst
    }

    /// `Same` for a good frame within the bound.
    fn frame(&self, came: &[u8], sent: &[u8]) -> Verdict {
        if sent.is_empty() {
            return Verdict::Lost;
        }
        let (Some((before, fixed)), Some((after, same))) = (self.read(came), self.read(sent))
        else {
            // bytes that are no frame: no client takes them for one
            return if sent.len() <= 2 * came.len() {
                Verdict::Lost
            } else {
                Verdict::Forged
            };
        };
        if fixed != same {
            return Verdict::Forged;
        }
        let within = before
            .iter()
            .zip(&after)
            .zip(self.bound)
            .all(|((before, after), bound)| {
                let off = |(a, b): (&f64, &f64)| (a - b).abs() <= bound;
                before.iter().zip(after).all(off)
            });
        if within {
            Verdict::Same
        } else {
            Verdict::Beyond
        }
    }

    /// Values of exactly one good frame, and its other bytes.
    fn read(&self, bytes: &[u8]) -> Option<([[f64; 3]; 2], Vec<u8>)> {
        let mut copy = bytes.to_vec();
        let reading = Checked::new(self.format, &mut copy).ok()?.read().ok()?;
        let RawSample::Counts { gyro, accel } = reading.sample else {
            return None;
        };
        let mut rest = bytes.to_vec();
        // identifier, three values of three bytes, status, the same again, and the checksum
        for at in (1..10).chain(11..20).chain(bytes.len() - 4..bytes.len()) {
            rest[at] = 0;
        }
        Some(([gyro, accel].map(|triad| triad.map(f64::from)), rest))
    }
}
