//! The time offset between fixes and samples of a user's recording: a stated one, one estimated
//! from the data, and the comparison of both.

use crate::analysis::doubts::TimeDoubt;
use crate::analysis::offset::estimate;
use host_io::recordings::clocks;
use host_io::recordings::record::Record;

/// The data contradict an offset that differs by more than this many standard deviations.
const SIGMAS: f64 = 4.0;
/// Error of the method beside its standard deviation, s (measured on the recorded drives of one
/// box, whose offset is 0).
const METHOD_S: f64 = 0.02;
/// The same by positions alone, whose differences are means over seconds, s (0.29 s were seen in a
/// simulated flight).
const BY_POSITIONS_S: f64 = 0.1;
/// Number of measured velocities from which on they show the offset.
const VELOCITIES: usize = 20;

/// Moves the fixes of `record` by the offset of the data if `wanted`, or if the recording asks for
/// it. Returns a sentence for the report if it was to be estimated.
pub fn settle(record: &mut Record, wanted: bool) -> Option<String> {
    if !wanted && !record.estimates_offset {
        return None;
    }
    let stated = record.given_offset_s.unwrap_or(0.0);
    let found = match estimate(record) {
        Ok(found) => found,
        Err(why) => {
            return Some(format!(
                "The time offset of the fixes cannot be estimated: {}. They stay at {stated} s.",
                why.why()
            ));
        }
    };
    let offset = stated + found.offset_s;
    record.move_fixes(found.offset_s);
    record.given_offset_s = Some(offset);
    let named = clocks::named(offset).map_or(String::new(), |name| format!(" ({name})"));
    Some(format!(
        "The time offset of the fixes is estimated: {offset:.3} s{named} are added to their times, \
         standard deviation {:.3} s.",
        found.sigma_s
    ))
}

/// The stated offset of a recording, if the data contradict it.
#[must_use]
pub fn contradicted(record: &Record) -> Option<TimeDoubt> {
    let stated_s = record.given_offset_s.unwrap_or(0.0);
    let found = estimate(record).ok()?;
    let with_velocity = record.fixes.iter().filter(|fix| fix.has(3..5)).count();
    let method_s = if with_velocity < VELOCITIES {
        BY_POSITIONS_S
    } else {
        METHOD_S
    };
    let doubtful = found.offset_s.abs() > SIGMAS * found.sigma_s.hypot(method_s);
    doubtful.then_some(TimeDoubt {
        stated_s,
        best_s: stated_s + found.offset_s,
        sigma_s: found.sigma_s,
    })
}
