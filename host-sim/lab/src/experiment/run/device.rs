//! The device in the paper's experiment: networks that were proven in earlier drives of the same
//! unit with fixes correct a drive without fixes.

use super::Sessions;
use crate::learning::fix_learner::{Learnt, Stored, learn_on};
use crate::learning::teacher::Assumptions;
use crate::learning::window::{compensator, corrected_increments};
use firmware::learn::bank::{Gates, NAMES, ZERO_CORRECTION};
use firmware::model::Nets;
use host_core::inertial::free_inertial::{FreeInertial, aligned_free_inertial};
use host_core::inertial::session::Session;
use rayon::prelude::*;
use std::iter;

/// Numbers of earlier drives after which the device is judged, and its names then. In each earlier
/// drive it learns from fixes. The judged drive has no fixes, and the stored networks correct from
/// power-on.
const DRIVES: [(u32, &str); 2] = [(1, "device-1"), (4, "device-4")];

/// The greatest of [`DRIVES`].
pub(super) fn most_drives() -> u32 {
    DRIVES.iter().map(|(drives, _)| *drives).max().unwrap_or(1)
}

/// The device after some of the drives.
pub(super) struct After {
    /// Its name among the schemes.
    pub scheme: &'static str,
    /// Its navigation of the judged drive.
    pub free: FreeInertial,
    /// Which candidate corrects, and since when it was in force.
    pub in_force: String,
}

/// The device after each number of [`DRIVES`] of earlier drives, of which `first` is the first.
/// Without learnt networks, because a standstill gives no attitude or nothing is proven, it
/// corrects nothing.
pub(super) fn after_drives(
    sessions: &Sessions<'_>,
    first: &Session,
    judged: &Session,
    assumptions: &Assumptions,
) -> Vec<After> {
    let spec = &sessions.scenario.learn;
    let more: Vec<Session> = (sessions.more.par_iter())
        .map(|seeds| sessions.drive(spec, *seeds).0)
        .collect();
    let (mut stored, mut by, mut out) = (Stored::default(), None, Vec::new());
    for (number, drive) in (1..).zip(iter::once(first).chain(&more)) {
        let (gates, until) = (Gates::default(), drive.epochs());
        let learnt = learn_on(&stored, drive, assumptions, gates, None, until);
        if let Some((next, origin)) =
            learnt.and_then(|of| Some((of.next.clone()?, origin(&of, number))))
        {
            (stored, by) = (next, Some(origin));
        }
        let named = DRIVES.iter().find(|(drives, _)| *drives == number);
        let Nets { gyro, accel } = stored.nets.unwrap_or(Nets::NONE);
        if let Some((_, scheme)) = named {
            let compensator = compensator(judged, &[gyro, accel], assumptions);
            let corrected = corrected_increments(judged, &compensator, 0..judged.epochs());
            out.extend(aligned_free_inertial(judged, &corrected).map(|free| After {
                scheme,
                free,
                in_force: in_force(scheme, number, by.as_deref()),
            }));
        }
    }
    out
}

/// Describes the networks that a drive has stored for the next power-on.
fn origin(learnt: &Learnt, drive: u32) -> String {
    let since = learnt
        .diary
        .since()
        .filter(|_| learnt.running != ZERO_CORRECTION);
    match since {
        Some(since) => format!(
            "what drive {drive} stored; there the candidate \"{}\" had proved itself and was in \
             force from {since} s after power-on",
            NAMES[learnt.running]
        ),
        None => format!("what drive {drive} stored"),
    }
}

fn in_force(scheme: &str, drives: u32, by: Option<&str>) -> String {
    let earlier = if drives == 1 {
        "1 earlier drive"
    } else {
        &format!("{drives} earlier drives")
    };
    match by {
        None => format!(
            "The row `{scheme}` is the device after {earlier}. Nothing had proved itself there, so \
             it corrects nothing."
        ),
        Some(by) => format!(
            "The row `{scheme}` is the device after {earlier}. From power-on it corrects with {by}."
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_candidate_in_force_is_named_or_that_there_is_none() {
        assert!(
            in_force("device-1", 1, None).contains("after 1 earlier drive. Nothing had proved")
        );
        let text = in_force("device-4", 4, Some("what drive 3 stored"));
        assert!(
            text.contains("after 4 earlier drives. From power-on it corrects with what drive 3")
        );
    }

    /// A name cannot be mistaken for a number of metres, as in "device, 4 828 m".
    #[test]
    fn a_name_has_no_blank_and_no_comma() {
        for (_, name) in DRIVES {
            assert!(
                name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-'),
                "{name}"
            );
        }
    }
}
