//! Joins the messages of one epoch into one fix.
//!
//! Most receivers spread what they know over several messages. Messages of the same time of
//! validity belong to one epoch; a message without a time belongs to the epoch before it. An epoch
//! is handed over as soon as it has every kind of message that the last one had, so nothing is
//! waited for that does not come. Where a kind is missing, a silence of the line or the next epoch
//! ends it.

use crate::fix::{Fix, Heading, NOT_MEASURED, OBSERVATIONS, Position};
use crate::units::DEGREE;

/// A message that is not newer than the newest epoch, but older by at most this, belongs to it or
/// to one that is over, ms. With more, the receiver's time has gone back.
const LATE_MS: u32 = 1000;
/// A late message of an older epoch comes this soon after the newest epoch began, microseconds.
/// Later, the receiver's time has gone back as well: the receiver has restarted.
const LATE_US: u64 = 2_000_000;
const DAY_MS: u32 = 86_400_000;
const WEEK_MS: u32 = 7 * DAY_MS;

/// The kind of a message that no epoch waits for.
pub const OPTIONAL: u8 = 16;

/// Arrival of a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Arrival {
    /// Board's clock, microseconds.
    pub us: u64,
    /// Number of the last sample before it.
    pub sample: u32,
}

/// The kind of a message, and when its values were valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Head {
    /// 0 to 15, different within a format; [`OPTIONAL`]: no epoch waits for it.
    pub kind: u8,
    /// When.
    pub time: Time,
}

/// The time that a message states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Time {
    /// ms of the GPS week.
    Week(u32),
    /// ms of the day.
    Day(u32),
    /// None: that of the message before it.
    Same,
}

/// Standard deviations of position (m) and velocity (m/s), in the order of [`OBSERVATIONS`].
pub type Sigmas = [f32; OBSERVATIONS];

/// Values that the messages of an epoch have given so far. A message writes what it measures and
/// leaves the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    /// Position.
    pub position: Position,
    /// Velocity north, east, down, m/s.
    pub velocity: [f64; 3],
    /// Addition to each standard deviation because of the digits of the message, or because of
    /// its age; [`NOT_MEASURED`] for a value that has not come.
    pub own: Sigmas,
    /// Standard deviations that the receiver states; [`NOT_MEASURED`] where it does not.
    pub stated: Sigmas,
    /// Standard deviations that are assumed until the receiver states others.
    pub assumed: Sigmas,
    /// Two-antenna heading.
    pub heading: Option<Heading>,
    /// Standard deviation of the heading by another message, rad.
    pub heading_sigma: Option<f32>,
    /// Day of the week, 0 for Sunday, by a message with a date.
    pub day: Option<u8>,
    /// The receiver does not vouch for the position and velocity of this epoch, whatever else its
    /// messages hold.
    pub refused: bool,
    /// The message that knows most of the position has come; others leave it as it is.
    pub position_is_decided: bool,
}

impl Values {
    /// No value is given.
    pub const NONE: Values = Values {
        position: Position {
            latitude: 0.0,
            longitude: 0.0,
            height: 0.0,
        },
        velocity: [0.0; 3],
        own: [NOT_MEASURED; OBSERVATIONS],
        stated: [NOT_MEASURED; OBSERVATIONS],
        assumed: [NOT_MEASURED; OBSERVATIONS],
        heading: None,
        heading_sigma: None,
        day: None,
        refused: false,
        position_is_decided: false,
    };

    /// Which values of [`OBSERVATIONS`] are given, a bit each.
    pub fn given(&self) -> u8 {
        let own = self.own.iter().enumerate();
        let given = own.filter(|(_, own)| own.is_finite() && !self.refused);
        given.fold(0, |given, (at, _)| given | 1 << at)
    }

    /// Whether the position, or the velocity from entry 3 on, is given.
    pub fn has(&self, first: usize) -> bool {
        self.own.get(first).is_some_and(|own| own.is_finite())
    }

    /// The message that knows most of the position has come. What others wrote is void, also where
    /// it says that there is no position.
    #[inline(never)]
    pub fn decide_position(&mut self) {
        if !self.position_is_decided {
            self.position_is_decided = true;
            Values::set(&mut self.own, 0, [NOT_MEASURED; 3]);
            Values::set(&mut self.assumed, 0, [NOT_MEASURED; 3]);
        }
    }

    /// Sets the standard deviations stated, from `first` on, by three variances. One that is
    /// unknown or wild is not measured.
    #[inline(never)]
    pub fn variances(&mut self, first: usize, variances: [f32; 3], least: f32) {
        let stated = self.stated.iter_mut().skip(first);
        for (sigma, variance) in stated.zip(variances) {
            *sigma = match (0.0..1e12).contains(&variance) {
                true => libm::sqrtf(variance).max(least),
                false => NOT_MEASURED,
            };
        }
    }

    /// Sets the velocity by speed (m/s), course (degrees clockwise from north, 0 to 360), and speed
    /// upwards. Sine and cosine are good to 3e-7, 9 um/s at 30 m/s.
    #[inline(never)]
    pub fn over_ground(&mut self, speed: f32, course: f32, up: f32) {
        // to the nearest of north, east, south and west, and from there by the Taylor series
        let quarter = (course / 90.0 + 0.5) as u32;
        let x = (course - 90.0 * quarter as f32) * DEGREE as f32;
        let xx = x * x;
        let sin = x * (1.0 - xx / 6.0 * (1.0 - xx / 20.0 * (1.0 - xx / 42.0 * (1.0 - xx / 72.0))));
        let cos = 1.0 - xx / 2.0 * (1.0 - xx / 12.0 * (1.0 - xx / 30.0 * (1.0 - xx / 56.0)));
        let (north, east) = match quarter % 4 {
            0 => (cos, sin),
            1 => (-sin, cos),
            2 => (-cos, -sin),
            _ => (sin, -cos),
        };
        self.velocity = [speed * north, speed * east, -up].map(f64::from);
    }

    /// Writes a position or velocity's three entries of the standard deviations, from `first` on.
    #[inline(never)]
    pub fn set(sigmas: &mut Sigmas, first: usize, new: [f32; 3]) {
        for (sigma, new) in sigmas.iter_mut().skip(first).zip(new) {
            *sigma = new;
        }
    }
}

/// An epoch that is complete.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// The fix; `None` when the receiver does not vouch for any value.
    pub fix: Option<Fix>,
    /// Arrival of the first byte of its first message.
    pub arrival: Arrival,
    /// The time of the week is known, and not that of the day alone.
    pub dated: bool,
}

/// Joins messages to epochs.
#[derive(Debug)]
pub struct Joiner {
    /// The newest epoch: its time, `None` until there is one; when it arrived, and its values.
    time: Option<Time>,
    arrival: Arrival,
    values: Values,
    /// Kinds of messages that it has, a bit each, and that the one before it had.
    kinds: u16,
    usual: u16,
    /// Whether it has been handed over.
    handed_over: bool,
    /// The line was silent since, so a message without a time is not of it.
    over: bool,
    /// Day of the week, of receivers that give the time of the day: by their last date, and by the
    /// midnights since.
    day: u8,
    dated: bool,
    /// An epoch that was handed over and not taken yet.
    ready: bool,
    solution: Solution,
}

impl Joiner {
    /// A new one, which expects these kinds of messages at first, a bit each.
    pub const fn new(usual: u16) -> Joiner {
        Joiner {
            time: None,
            arrival: Arrival { us: 0, sample: 0 },
            values: Values::NONE,
            kinds: 0,
            usual,
            handed_over: true,
            over: false,
            day: 0,
            dated: false,
            ready: false,
            solution: Solution {
                fix: None,
                arrival: Arrival { us: 0, sample: 0 },
                dated: false,
            },
        }
    }

    /// The memory for the values of a message whose first byte came at `arrival`; `None` when it
    /// belongs to an epoch that is over. A message that begins a new epoch ends the one before it.
    /// [`Joiner::take`] is to be asked before the next message.
    #[inline(never)]
    pub fn place(&mut self, head: Head, arrival: Arrival) -> Option<&mut Values> {
        let soon = arrival.us.saturating_sub(self.arrival.us) < LATE_US;
        match (head.time, self.time) {
            (Time::Same, None) => return None,
            (Time::Same, _) if self.over => return None,
            (Time::Same, _) => {}
            (new, Some(old)) if soon && new == old => {}
            (new, Some(old)) if soon && is_late(new, old) => return None,
            (new, old) => {
                self.hand_over();
                self.date(); // it may have come after that
                if old.is_some() {
                    self.usual = self.kinds;
                }
                if is_midnight(old, new) {
                    self.day = (self.day + 1) % 7;
                }
                (self.time, self.arrival) = (Some(new), arrival);
                (self.kinds, self.handed_over, self.over) = (0, false, false);
                self.values = Values::NONE;
            }
        }
        self.kinds |= 1_u16.checked_shl(head.kind.into()).unwrap_or_default();
        Some(&mut self.values)
    }

    /// Whether there is an epoch to take: one that was ended, or that has all that the last one
    /// had.
    pub fn is_ready(&mut self) -> bool {
        if !self.ready && self.kinds & self.usual == self.usual {
            self.hand_over();
        }
        self.ready
    }

    /// Whether an epoch waits for messages.
    pub fn waits(&self) -> bool {
        !self.handed_over
    }

    /// The line is silent: nothing more comes of the epoch.
    pub fn silent(&mut self) {
        self.over = true;
        self.hand_over();
    }

    /// The epoch that was handed over, once.
    pub fn take(&mut self) -> Option<&Solution> {
        core::mem::take(&mut self.ready).then_some(&self.solution)
    }

    /// Time of the newest epoch, ms of the GPS week; of the day while there was no date.
    fn time_ms(&self) -> u32 {
        match self.time {
            Some(Time::Week(ms)) => ms,
            Some(Time::Day(ms)) => (u32::from(self.day) * DAY_MS + ms) % WEEK_MS,
            Some(Time::Same) | None => 0,
        }
    }

    /// Time of the newest epoch, ms of the GPS week, once it is known, also by a date that came
    /// behind the fix.
    pub fn time_of_week(&mut self) -> Option<u32> {
        self.date();
        let known = self.dated || matches!(self.time, Some(Time::Week(_)));
        known.then(|| self.time_ms())
    }

    /// A date from elsewhere: day of the week at a time of the day, ms. The newest epoch is within
    /// half a day of it.
    pub fn date_is(&mut self, day: u8, at_ms: u32) {
        let (half, at) = (DAY_MS / 2, at_ms);
        let days = match self.time {
            Some(Time::Day(ms)) if ms > at.saturating_add(half) => 6, // the day before
            Some(Time::Day(ms)) if at > ms.saturating_add(half) => 1,
            _ => 0,
        };
        (self.day, self.dated) = ((day + days) % 7, true);
    }

    /// Takes the date that the epoch has.
    fn date(&mut self) {
        if let Some(day) = self.values.day {
            (self.day, self.dated) = (day, true);
        }
    }

    /// Makes the fix, if there is a position or a velocity.
    #[inline(never)]
    fn hand_over(&mut self) {
        if core::mem::replace(&mut self.handed_over, true) {
            return;
        }
        self.date();
        let Values {
            position,
            velocity,
            heading,
            ..
        } = self.values;
        let mut fix = Fix {
            position,
            velocity,
            heading,
            time_ms: self.time_ms(),
            arrived_us: self.arrival.us,
            ..Fix::EMPTY
        };
        let Values {
            own,
            stated,
            assumed,
            ..
        } = &self.values;
        let measured = together(own, stated, assumed, &mut fix.sigmas);
        if let (Some(heading), Some(sigma)) = (&mut fix.heading, self.values.heading_sigma) {
            heading.sigma = sigma;
        }
        self.solution = Solution {
            fix: (measured && !self.values.refused).then_some(fix),
            arrival: self.arrival,
            dated: self.dated || !matches!(self.time, Some(Time::Day(_))),
        };
        self.ready = true;
    }
}

/// The standard deviations of the values. Where nothing is added, their bits stay as they are. True
/// if anything is measured.
#[inline(never)]
fn together(own: &[f32], stated: &[f32], assumed: &[f32], sigmas: &mut [f32]) -> bool {
    let mut measured = false;
    let known = stated.iter().zip(assumed);
    for ((sigma, own), (stated, assumed)) in sigmas.iter_mut().zip(own).zip(known) {
        *sigma = one_together(*own, *stated, *assumed);
        measured |= sigma.is_finite();
    }
    measured
}

#[inline(never)]
fn one_together(own: f32, stated: f32, assumed: f32) -> f32 {
    let known = if stated.is_finite() { stated } else { assumed };
    if own == 0.0 {
        return known;
    }
    libm::sqrtf(known * known + own * own)
}

/// The time is before that of the newest epoch, and by so little that it has not gone back.
fn is_late(new: Time, newest: Time) -> bool {
    let (new, newest, turn) = match (new, newest) {
        (Time::Week(new), Time::Week(newest)) => (new, newest, WEEK_MS),
        (Time::Day(new), Time::Day(newest)) => (new, newest, DAY_MS),
        _ => return false,
    };
    (1..=LATE_MS).contains(&(newest.wrapping_add(turn).wrapping_sub(new) % turn))
}

/// The time of the day has gone back by more than half a day.
fn is_midnight(old: Option<Time>, new: Time) -> bool {
    match (old, new) {
        (Some(Time::Day(old)), Time::Day(new)) => old > new.saturating_add(DAY_MS / 2),
        _ => false,
    }
}
