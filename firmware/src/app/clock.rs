//! Times of the samples by the receiver's clock.
//!
//! Two lines are fitted: the board's time of the pulses over the receiver's seconds, and the
//! board's time at which samples came over their numbers, one a second. Together they give the
//! receiver's time at which any sample came, the error of the board's clock, and the true interval
//! of the samples. Each fit is the least-squares line through all events so far (growing memory, E.
//! Brookner, "Tracking and Kalman Filtering Made Easy", 1998, table 1.10.1), and from [`MOST`]
//! events on it forgets the older ones.
//!
//! Nothing is done at the other samples, so the frame path costs nothing more.

use crate::wire::command::{Sync, Times};

/// Events that a line remembers.
const MOST: u8 = 64;
/// Events after which a line is used.
const ENOUGH: u8 = 4;
/// An event so far off the line begins it again, microseconds: pulses, and samples, whose line may
/// pass a USB adapter.
const NEAR_US: [f64; 2] = [500.0, 50_000.0];
/// Time without a pulse after which the line is continued without one, microseconds.
const HOLDS_US: u64 = 2_500_000;
/// Change of a crystal's rate while no pulse comes (assumed: 10 degC at 0.05 ppm/degC).
const DRIFT: f64 = 5e-7;
/// The relation is given up when its error may be larger than this, microseconds.
const LOST_US: f64 = 5_000.0;
/// Seconds of a GPS week.
const WEEK_S: u32 = 604_800;
const WEEK_US: u64 = 604_800_000_000;

/// The line through events at whole numbers.
#[derive(Debug, Clone, Copy, Default)]
struct Track {
    /// Number of the last event.
    number: u32,
    /// Its time by the line, microseconds of the board's clock.
    at_us: f64,
    /// Time from one number to the next, microseconds.
    interval_us: f64,
    events: u8,
    /// Mean square of what the events are off the line, and mean product with what the one before
    /// was off, microseconds squared.
    square: f32,
    product: f32,
    /// What the last event was off, microseconds.
    off_us: f32,
}

impl Track {
    /// An event; one that is not `near_us` to the line begins a new one.
    fn take(&mut self, number: u32, at_us: u64, near_us: f64) {
        let at_us = at_us as f64;
        let steps = f64::from(number.wrapping_sub(self.number));
        let begun = Track {
            number,
            at_us,
            events: 1,
            ..Track::default()
        };
        let off = at_us - self.at_us - steps * self.interval_us;
        if self.events == 0 || steps < 1.0 || self.events > 1 && off.abs() > near_us {
            *self = begun;
            return;
        }
        self.number = number;
        self.events = (self.events + 1).min(MOST);
        if self.events == 2 {
            (self.at_us, self.interval_us) = (at_us, (at_us - self.at_us) / steps);
            return;
        }
        let n = f64::from(self.events);
        let scale = n * (n + 1.0);
        self.at_us += steps * self.interval_us + off * (4.0 * n - 2.0) / scale;
        self.interval_us += off * 6.0 / (scale * steps);
        // of the line through n events so much of the noise is left in the last one
        let off = off as f32;
        let of_noise = off / (1.0 + 4.0 / f32::from(self.events));
        let judged = f32::from(self.events - 2);
        self.square += (of_noise * off - self.square) / judged;
        self.product += (of_noise * self.off_us - self.product) / judged;
        self.off_us = off;
    }

    fn is_known(&self) -> bool {
        self.events >= ENOUGH
    }

    /// Standard deviation of an event about the line, microseconds.
    fn jitter(&self) -> f32 {
        libm::sqrtf(self.square)
    }

    /// Variance of the line at the last event, microseconds squared. Events that are late together
    /// count for fewer: `(1 - r) / (1 + r)` of them with the correlation `r` from one to the next.
    /// It is squared, since `r` is found too small: the line follows what lasts.
    fn variance(&self) -> f32 {
        let correlation = (self.product / self.square.max(1e-6)).clamp(0.0, 0.97);
        let more = (1.0 + correlation) / (1.0 - correlation);
        4.0 * self.square / f32::from(self.events) * more * more
    }
}

/// Times of the samples by the receiver's clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct Clock {
    /// Pulses over the receiver's seconds.
    seconds: Track,
    /// Second of the week of the last pulse, and the board's time of it, microseconds.
    second: u32,
    pulse_us: u64,
    samples: Track,
}

impl Clock {
    /// The pulse of a second of the week came at the board's time `at_us`.
    pub fn pulse(&mut self, second: u32, at_us: u64) {
        let passed = second.wrapping_add(WEEK_S).wrapping_sub(self.second) % WEEK_S;
        let number = self.seconds.number.wrapping_add(passed);
        self.seconds.take(number, at_us, NEAR_US[0]);
        (self.second, self.pulse_us) = (second, at_us);
    }

    /// Sample `number` came at the board's time `at_us`; to be called about once a second.
    pub fn sample(&mut self, number: u32, at_us: u64) {
        if number != self.samples.number {
            self.samples.take(number, at_us, NEAR_US[1]);
        }
    }

    /// What is known at the board's time `now_us`.
    pub fn times(&self, now_us: u64) -> Times {
        let (seconds, samples) = (&self.seconds, &self.samples);
        let silent_us = now_us.saturating_sub(self.pulse_us);
        let holds = silent_us > HOLDS_US;
        let drift_us = if holds { DRIFT * silent_us as f64 } else { 0.0 };
        if !seconds.is_known() || drift_us > LOST_US {
            return Times::default();
        }
        let mut times = Times {
            sync: if holds { Sync::Holdover } else { Sync::Locked },
            holdover_s: if holds {
                (silent_us / 1_000_000) as u32
            } else {
                0
            },
            board_ppb: ((seconds.interval_us * 1e-6 - 1.0) * 1e9) as i32,
            jitter_us: [seconds.jitter(), samples.jitter()],
            ..Times::default()
        };
        if samples.is_known() {
            let since_us = (samples.at_us - seconds.at_us) / seconds.interval_us * 1e6;
            // a week more, since the sample may be of the one before or the next
            let of_weeks_us = (f64::from(self.second) + f64::from(WEEK_S)) * 1e6 + since_us;
            times.sample = samples.number;
            times.sample_us = of_weeks_us as u64 % WEEK_US;
            times.interval_ns = (samples.interval_us / seconds.interval_us * 1e9) as f32;
            times.error_us = libm::sqrtf(seconds.variance() + samples.variance()) + drift_us as f32;
        }
        times
    }
}

#[cfg(test)]
mod tests;
