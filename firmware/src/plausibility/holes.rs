//! Frames that are missing without a trace: of formats that have neither counter nor time.
//!
//! Such frames come once a period by the sensor's clock, and each arrives some time after it was
//! sent: a line, DMA and the frame path delay it by a little, or by a lot and then the next ones
//! come at once. So a frame may be late but not early, and of all frames in a window the least late
//! one shows where the sensor's clock is:
//!
//! ```text
//! e(k) = t(k) - k P          m = least e(k) of a window of 0.5 s and 32 frames or more
//! ```
//!
//! From window to window m moves by the drift between the clocks, which changes slowly and is
//! learnt, and by P for each frame that is missing. Delays come and go, a hole stays. Where delays
//! are so long and so rare that m itself is restless, only holes beyond that are found.

/// Shortest window, microseconds, and fewest frames in it. Longer than a pass of the frame path
/// delays a byte; 16 frames of 44 bytes take up every phase of bursts of 64 bytes, twice.
const WINDOW_US: u64 = 500_000;
const FRAMES: u32 = 32;
/// After a pause of so many periods, and at least so long, microseconds, the window restarts:
/// delayed frames then come at once, and all of them are late.
const PAUSE: f32 = 4.0;
const PAUSE_US: u64 = 20_000;
/// The drift is learnt from so many windows before a hole is reported.
const FIRST: usize = 8;
/// Least share of a period by which m must move more than by the drift.
const LEAST: f32 = 0.6;
/// Largest distance of a hole from a whole number of frames if their number is to be believed.
const SURE: f32 = 0.4;
/// Weight of a new window in the drift and in the unrest.
const WEIGHT: f32 = 0.1;
/// m must move by so many times its usual unrest.
const UNREST: f32 = 8.0;

/// Frames that are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hole {
    /// Number of missing frames.
    Of(u32),
    /// An unknown number.
    Unknown,
}

/// Time and number of a frame, and how late it is, microseconds, all counted from the least late
/// frame of the window before.
#[derive(Debug, Clone, Copy, Default)]
struct Least {
    time: u64,
    number: u32,
    late: f32,
}

/// Detects holes in a stream of frames.
#[derive(Debug)]
pub struct HoleWatch {
    on: bool,
    /// The least late frame of the window before; `None` at the beginning.
    anchor: Option<u64>,
    /// Frames since.
    number: u32,
    /// Start of the window in progress, microseconds, and the number of its first frame.
    began: (u64, u32),
    /// Arrival of the last frame, microseconds.
    last: u64,
    least: Option<Least>,
    /// Drift, as a ratio: the first values, how many there are, and what came of them.
    first: [f32; FIRST],
    known: usize,
    drift: f32,
    /// Mean size of the moves of m beside the drift, microseconds.
    unrest: f32,
}

impl HoleWatch {
    /// A watch, or one that is off and finds nothing.
    #[must_use]
    pub const fn new(on: bool) -> HoleWatch {
        HoleWatch {
            on,
            anchor: None,
            number: 0,
            began: (0, 0),
            last: 0,
            least: None,
            first: [0.0; FIRST],
            known: 0,
            drift: 0.0,
            unrest: 0.0,
        }
    }

    /// The stream was interrupted for a time that is known otherwise. What was learnt of the clocks
    /// stays.
    pub fn interrupt(&mut self) {
        (self.anchor, self.least, self.number) = (None, None, 0);
    }

    /// A frame has come at this time, microseconds, of `rate` a second. Gives what is missing
    /// before it.
    pub fn frame(&mut self, now: u64, rate: f32) -> Option<Hole> {
        if !self.on {
            return None;
        }
        let pause = now.saturating_sub(core::mem::replace(&mut self.last, now));
        let Some(anchor) = self.anchor else {
            (self.anchor, self.number, self.began) = (Some(now), 0, (now, 0));
            self.least = None;
            return None;
        };
        self.number = self.number.saturating_add(1);
        let period = 1e6 / rate;
        if pause > PAUSE_US && pause as f32 > PAUSE * period {
            (self.began, self.least) = ((now, self.number), None);
        }
        let time = now.saturating_sub(anchor);
        let late = time as f32 - self.number as f32 * period;
        if self.least.is_none_or(|least| late <= least.late) {
            let number = self.number;
            self.least = Some(Least { time, number, late });
        }
        let (from, first) = self.began;
        let over = now.saturating_sub(from) >= WINDOW_US && self.number - first >= FRAMES;
        if over { self.end(now, period) } else { None }
    }

    /// A window is over.
    #[inline(never)]
    fn end(&mut self, now: u64, period: f32) -> Option<Hole> {
        let least = self.least.take()?;
        self.anchor = self.anchor.map(|anchor| anchor + least.time);
        self.number = self.number.saturating_sub(least.number);
        self.began = (now, self.number);
        if least.time == 0 {
            return None;
        }
        let time = least.time as f32;
        let drift = least.late / time;
        if let Some(place) = self.first.get_mut(self.known) {
            *place = drift;
            self.known += 1;
            if self.known == FIRST {
                // the median: a hole among them does not count
                self.first.sort_unstable_by(f32::total_cmp);
                let [.., low, high, _, _, _] = self.first;
                self.drift = 0.5 * (low + high);
                // half the distance of the quartiles, as a time
                let [_, _, low, .., high, _, _] = self.first;
                self.unrest = 0.5 * (high - low) * time;
            }
            return None;
        }
        let moved = least.late - self.drift * time;
        let frames = moved / period;
        if moved.abs() < (LEAST * period).max(UNREST * self.unrest) {
            self.drift += WEIGHT * (drift - self.drift);
            self.unrest += WEIGHT * (moved.abs() - self.unrest);
            return None;
        }
        let whole = libm::roundf(frames);
        if whole < 1.0 {
            return None; // earlier than thought: the window before was late as a whole
        }
        let sure = (frames - whole).abs() <= SURE;
        Some(if sure {
            Hole::Of(whole as u32)
        } else {
            Hole::Unknown
        })
    }
}

#[cfg(test)]
mod tests;
