//! One session of a unit, from power-on to the end of its recording, with every fix.

use host_core::error::Error;
use host_core::inertial::gnss::Fix;
use host_core::inertial::session::{EPOCH_S, Session};
use host_core::inertial::sins::{Increment, NavState};
use host_io::recordings::record::{Record, TimedFix};
use host_io::recordings::{InitialAttitude, Prepared};
use nalgebra::{UnitQuaternion, Vector3};
use std::ops::Range;

/// Fewest steps of a navigator in a second. Coning and sculling are computed at every sample.
const STEPS_HZ: usize = 20;
/// Shortest session that is used, s.
const LEAST_S: usize = 15;

/// A session with all its fixes.
#[derive(Debug, Clone)]
pub struct Timeline {
    /// Its name in tables.
    pub name: String,
    /// The samples, in whole seconds.
    pub session: Session,
    /// The samples in steps of the navigators.
    pub increments: Vec<Increment>,
    /// Duration of a step, s.
    pub step_s: f64,
    /// Each fix with the step after which it is used; its age is the time since its validity.
    pub fixes: Vec<(usize, Fix)>,
    /// The same with the time of validity after the beginning, s.
    timed: Vec<(f64, Fix)>,
    /// Attitude at the beginning, if the recording gives it.
    pub attitude: Option<UnitQuaternion<f64>>,
    /// Time of the beginning on the IMU's clock, s.
    pub begin_s: f64,
    /// Notes for the reader, in sentences.
    pub notes: Vec<String>,
}

impl Timeline {
    /// The longest part of a recording without a gap.
    ///
    /// # Errors
    /// As [`Record::prepare`]; the recording is too short.
    pub fn of(name: &str, record: &Record) -> Result<Self, Error> {
        let Prepared {
            mut session,
            attitude,
            mut begin,
            missing,
            mut notes,
        } = record.prepare()?;
        let part = longest(session.epochs(), &missing);
        let given = match attitude {
            Some(InitialAttitude::Known(_)) if part.start == 0 => Some(session.reference[0].q_bn),
            _ => None,
        };
        if part.len() < session.epochs() {
            notes.push(format!(
                "Of its parts the longest is used, {} to {} s.",
                part.start, part.end
            ));
            session = session.cut(&part);
            begin += part.start as f64 * EPOCH_S;
        }
        if session.epochs() < LEAST_S {
            return Err(Error::Scenario {
                file: record.file.clone(),
                line: None,
                key: "samples".into(),
                problem: format!(
                    "cover {} s without a gap, and at least {LEAST_S} s are needed",
                    session.epochs()
                ),
                remedy: "give a longer session".into(),
            });
        }
        let measured = record.fixes.iter();
        let measured = measured.filter(|fix| fix.has_position() || fix.has(3..5));
        let timed = measured.map(|fix| (fix.time - begin, untimed(fix)));
        Ok(Self {
            name: name.to_owned(),
            attitude: given,
            begin_s: begin,
            notes,
            ..Self::new(session, timed.collect())
        })
    }

    /// Some seconds of a session without an outage, with the fixes of its epochs.
    #[must_use]
    pub fn of_part(session: &Session, part: &Range<usize>) -> Self {
        let session = session.cut(part);
        let fix = |(k, fix): (usize, &Option<Fix>)| {
            let fix = (*fix)?;
            let now = Fix { age_s: 0.0, ..fix };
            Some((k as f64 * EPOCH_S - fix.age_s, now))
        };
        let timed = session.fixes.iter().enumerate().filter_map(fix).collect();
        Self::new(session, timed)
    }

    /// With fixes at their times of validity, s after the beginning.
    fn new(mut session: Session, timed: Vec<(f64, Fix)>) -> Self {
        let n = session.samples_per_epoch();
        let divisors = (1..=(n / STEPS_HZ).max(1)).rev();
        session.gather = divisors
            .into_iter()
            .find(|g| n.is_multiple_of(*g))
            .unwrap_or(1);
        let mut timeline = Self {
            name: String::new(),
            increments: session.increments(),
            step_s: session.step_s(),
            fixes: Vec::new(),
            timed,
            attitude: None,
            begin_s: 0.0,
            notes: Vec::new(),
            session,
        };
        timeline.move_fixes(0.0);
        timeline
    }

    /// Adds a time offset, s, to the times of the fixes, and sets the lever arm of the antenna,
    /// forward and right, m.
    pub fn between(&mut self, [offset, x, y]: &[f64; 3]) {
        (self.session.lever_arm.x, self.session.lever_arm.y) = (*x, *y);
        self.move_fixes(*offset);
    }

    fn move_fixes(&mut self, seconds: f64) {
        for (time, _) in &mut self.timed {
            *time += seconds;
        }
        let steps = self.increments.len();
        let placed = |(time, fix): &(f64, Fix)| {
            let step = (time / self.step_s).round();
            let age_s = step * self.step_s - time;
            let within = (0.0..=steps as f64).contains(&step);
            within.then_some((step as usize, Fix { age_s, ..*fix }))
        };
        self.fixes = self.timed.iter().filter_map(placed).collect();
    }

    /// Duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.increments.len() as f64 * self.step_s
    }

    /// The step that ends at this time, s.
    #[must_use]
    pub fn step_at(&self, time_s: f64) -> usize {
        ((time_s / self.step_s).round().max(0.0) as usize).min(self.increments.len())
    }

    /// The step of the last fix until a time, s.
    #[must_use]
    pub fn last_fix(&self, time_s: f64) -> Option<usize> {
        let until = self.step_at(time_s);
        let before = self.fixes.iter().map(|(step, _)| *step);
        before.filter(|step| (1..=until).contains(step)).max()
    }

    /// A fix as a receiver at the IMU would have given it now, after `step` steps, where the
    /// navigator is at `nav`.
    #[must_use]
    pub fn at_imu(&self, step: usize, fix: &Fix, nav: &NavState) -> Fix {
        let arm = &self.session.lever_arm;
        let near = step.saturating_sub(1)..(step + 1).min(self.increments.len());
        let time = near.len() as f64 * self.step_s;
        let turned: Vector3<f64> = self.increments[near].iter().map(|w| w.dtheta).sum();
        let moved = nav.velocity * fix.age_s - nav.q_bn * arm;
        Fix {
            position: fix.position.displaced(&moved),
            velocity: fix.velocity - nav.q_bn * (turned / time).cross(arm),
            age_s: 0.0,
            ..*fix
        }
    }
}

fn untimed(fix: &TimedFix) -> Fix {
    Fix::new(fix.position(), fix.velocity.into(), fix.sigmas)
}

/// The longest part between missing epochs.
fn longest(epochs: usize, missing: &[Range<usize>]) -> Range<usize> {
    let end = epochs..epochs;
    let mut from = 0;
    let mut best = 0..0;
    for gap in missing.iter().chain([&end]) {
        if gap.start.saturating_sub(from) > best.len() {
            best = from..gap.start;
        }
        from = gap.end;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_part_is_used() {
        assert_eq!(longest(100, &[]), 0..100);
        assert_eq!(longest(100, &[20..22, 90..100]), 22..90);
        assert_eq!(longest(10, std::slice::from_ref(&(0..10))), 0..0);
    }
}
