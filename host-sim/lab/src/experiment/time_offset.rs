//! The time offset between fixes and samples of a user's recording: a stated one, one estimated
//! from the data, and the comparison of both.

use crate::experiment::doubts::Warning;
use host_io::recordings::offset::estimate;
use host_io::recordings::record::Record;

/// The data contradict an offset that differs by more than this many standard deviations.
const SIGMAS: f64 = 3.0;
/// Error of the method beside its standard deviation, s (measured on the recorded drives of one
/// box, whose offset is 0).
const METHOD_S: f64 = 0.02;

/// Moves the fixes of `record` by the offset of the data if `wanted`, or if the recording asks for
/// it. Returns a sentence for the report, and a warning where the data contradict a stated offset.
/// `stated_by`: the field or option that states it.
pub fn settle(
    record: &mut Record,
    wanted: bool,
    stated_by: &str,
) -> (Option<String>, Option<Warning>) {
    let stated = record.told_offset_s.unwrap_or(0.0);
    let wanted = wanted || record.estimates_offset;
    let found = match estimate(record) {
        Ok(found) => found,
        Err(why) if wanted => {
            let note = format!(
                "The time offset of the fixes cannot be estimated: {}. They stay at {stated} s.",
                why.why()
            );
            return (Some(note), None);
        }
        Err(_) => return (None, None),
    };
    let (offset, sigma) = (stated + found.offset_s, found.sigma_s);
    if wanted {
        record.move_fixes(found.offset_s);
        record.told_offset_s = Some(offset);
        let note = format!(
            "The time offset of the fixes is estimated: {offset:.3} s are added to their times, \
             standard deviation {sigma:.3} s."
        );
        return (Some(note), None);
    }
    let doubtful = found.offset_s.abs() > SIGMAS * sigma.hypot(METHOD_S);
    let warning = doubtful.then(|| Warning {
        file: record.file.clone(),
        field: stated_by.into(),
        problem: format!(
            "is {stated} s, and samples and fixes match best at {offset:.3} s (standard deviation \
             {sigma:.3} s)"
        ),
        remedy: "give that offset, or have it estimated (--estimate-time-offset)".into(),
    });
    (None, warning)
}
