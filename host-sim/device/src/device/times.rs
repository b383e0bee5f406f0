//! The receiver's time of the samples, by a device.

use super::link::Link;
use firmware::wire::command::{self, Request, Response, Sync};
use host_core::error::Error;
use serde::Serialize;
use std::fmt::Write;

/// The receiver's time of the samples. Without synchronisation all else is `None` or 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Times {
    /// none, locked or holdover.
    pub sync: &'static str,
    /// Time since the last pulse in holdover, s.
    pub holdover_s: u32,
    /// How much the board's clock is fast, parts per million.
    pub board_ppm: Option<f64>,
    /// Scatter of the pulses by the board's clock, microseconds.
    pub pulse_jitter_us: f32,
    /// Scatter of the samples' arrivals, microseconds.
    pub sample_jitter_us: f32,
    /// The sample whose time is given.
    pub sample: Option<Sample>,
}

/// A sample and its time. Sample n came `(n - number) interval_us` later.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Its number.
    pub number: u32,
    /// The receiver's time at which it came, s of the week.
    pub time_s: f64,
    /// Standard deviation of that time, microseconds.
    pub error_us: f32,
    /// Interval of the samples by the receiver's clock, microseconds.
    pub interval_us: f64,
}

impl From<&command::Times> for Times {
    fn from(times: &command::Times) -> Self {
        let sync = match times.sync {
            Sync::None => "none",
            Sync::Locked => "locked",
            Sync::Holdover => "holdover",
        };
        let [pulse_jitter_us, sample_jitter_us] = times.jitter_us;
        let known = times.sync != Sync::None;
        Self {
            sync,
            holdover_s: times.holdover_s,
            board_ppm: known.then(|| f64::from(times.board_ppb) * 1e-3),
            pulse_jitter_us,
            sample_jitter_us,
            sample: (times.interval_ns > 0.0).then(|| Sample {
                number: times.sample,
                time_s: times.sample_us as f64 * 1e-6,
                error_us: times.error_us,
                interval_us: f64::from(times.interval_ns) * 1e-3,
            }),
        }
    }
}

impl Times {
    /// In words, without an end of line.
    #[must_use]
    pub fn says(&self) -> String {
        let mut text = match self.board_ppm {
            None => return "none: needs a time pulse, fixes, and some seconds".into(),
            Some(ppm) => format!("{}; board's clock {ppm:+.2} ppm", self.sync),
        };
        if self.sync == "holdover" {
            let _ = write!(text, ", without a pulse for {} s", self.holdover_s);
        }
        let _ = write!(text, ", pulses scatter by {:.1} us", self.pulse_jitter_us);
        if let Some(sample) = &self.sample {
            let _ = write!(
                text,
                "; samples every {:.3} us, scatter {:.0} us; sample {} came at {:.6} s of the week \
                 +- {:.0} us",
                sample.interval_us,
                self.sample_jitter_us,
                sample.number,
                sample.time_s,
                sample.error_us
            );
        }
        text
    }
}

impl Link {
    /// The receiver's time of the samples.
    ///
    /// # Errors
    /// As [`Link::ask`].
    pub fn times(&mut self) -> Result<Times, Error> {
        self.ask(&Request::GetTimes, |answer| match answer {
            Response::Times(times) => Some(Times::from(times)),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_is_said() {
        let mut times = command::Times::default();
        let says = |times: &command::Times| Times::from(times).says();
        assert!(says(&times).starts_with("none: needs a time pulse"));
        (times.sync, times.board_ppb) = (Sync::Locked, -12_340);
        assert_eq!(
            says(&times),
            "locked; board's clock -12.34 ppm, pulses scatter by 0.0 us"
        );
        (times.sync, times.holdover_s) = (Sync::Holdover, 7);
        (times.sample, times.sample_us, times.interval_ns) = (9, 1_500_000, 5e6);
        let text = says(&times);
        assert!(
            text.contains("holdover; ") && text.contains("for 7 s"),
            "{text}"
        );
        assert!(text.contains("every 5000.000 us"), "{text}");
        assert!(text.contains("sample 9 came at 1.500000 s"), "{text}");
    }
}
