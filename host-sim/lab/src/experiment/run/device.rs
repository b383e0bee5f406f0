//! The device in the paper's experiment: what it has proven and stored in earlier drives of the
//! same unit with fixes corrects a drive without fixes.

use super::Sessions;
use host_core::error::Error;
use host_core::inertial::free_inertial::{FreeInertial, aligned_free_inertial};
use host_core::inertial::session::Session;
use host_estimation::learning::device::{Course, Device, course, since};
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
    /// What corrects and since when, or what it waits for.
    pub in_force: String,
    /// What it did in the last of them.
    pub course: Course,
}

/// The device after each number of [`DRIVES`] of earlier drives, of which `first` is the first. In
/// each the navigation computer reports its alignment over the standstill; the judged drive has no
/// fixes. None where the standstill of the judged drive gives no attitude.
///
/// # Errors
/// A unit that no device accepts; a long drive needs a temporary file, which cannot be written.
pub(super) fn after_drives(
    sessions: &Sessions<'_>,
    first: &Session,
    judged: &Session,
) -> Result<Vec<After>, Error> {
    let spec = &sessions.scenario.learn;
    let more: Vec<Session> = (sessions.more.par_iter())
        .map(|seeds| sessions.drive(spec, *seeds).0)
        .collect();
    let mut device = Device::of_unit(sessions.scenario.unit())?;
    let mut out = Vec::new();
    for (number, drive) in (1..).zip(iter::once(first).chain(&more)) {
        let before = device.stored().0;
        let learnt = device.drive_session(drive, drive.epochs());
        let course = course(&learnt, &device, &before);
        let Some((_, scheme)) = DRIVES.iter().find(|(drives, _)| *drives == number) else {
            continue;
        };
        let coast = device.clone().drive_session(judged, 0);
        coast.corrected.check()?;
        let corrected = judged.navigable(coast.corrected.each());
        out.extend(aligned_free_inertial(judged, &corrected).map(|free| After {
            scheme,
            free,
            in_force: in_force(scheme, number, &course.says, &since(&coast)),
            course,
        }));
    }
    Ok(out)
}

/// Describes a row: what the last earlier drive ended with, and what is in force in the judged one.
fn in_force(scheme: &str, drives: u32, learnt: &str, now: &str) -> String {
    let earlier = if drives == 1 {
        "1 earlier drive. In it the device".to_owned()
    } else {
        format!("{drives} earlier drives. In the last of them the device")
    };
    format!(
        "The row `{scheme}` is the device, the firmware's own application, after {earlier} \
         {learnt}. In the judged drive it {now}."
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_learnt_and_what_is_in_force_is_told() {
        let text = in_force("device-1", 1, "has proved nothing", "corrects nothing");
        assert!(text.contains("after 1 earlier drive. In it the device has proved nothing."));
        assert!(text.ends_with("In the judged drive it corrects nothing."));
        let text = in_force("device-4", 4, "has stored it", "corrects from power-on");
        assert!(
            text.contains("In the last of them the device has stored it."),
            "{text}"
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
