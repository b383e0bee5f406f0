//! The device in a replay: it learns on the learning part, and goes through the judged part without
//! fixes.

use super::{Settings, Split, learnt};
use firmware::configuration::Activation;
use firmware::model::Nets;
use firmware::sample::Counts;
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_core::list::{IN_MEMORY, List};
use host_estimation::learning::device::{Course, Diary, Drive, course, since};

/// What the device did.
pub(in crate::experiment) struct Judged {
    /// Its samples: of the learning part and the judged one where that follows, else of the judged
    /// part alone.
    pub corrected: List<Counts>,
    /// Whether any of them is not as it came.
    pub changed: bool,
    /// The correction in force in each second of them, rad/s and m/s2.
    pub correction: Vec<[[f32; 3]; 2]>,
    /// What it did in the learning part.
    pub course: Course,
    /// The course of its learning.
    pub diary: Diary,
    /// As [`Bench::considered`](crate::experiment::outcome::Bench::considered).
    pub considered: Vec<[f64; 6]>,
    /// The networks that act from the next power-on.
    pub nets: Nets,
    /// Describes its row.
    pub note: String,
}

/// The device of a unit through both parts. What it stores acts from the next power-on: so it is
/// switched off at the end of the learning part, and on again with its store for the judged one.
/// With a live activation it goes on without a power-off where the judged part follows.
pub(in crate::experiment) fn judged(
    session: &Session,
    split: &Split,
    settings: &Settings,
) -> Result<Judged, Error> {
    let mut device = settings.device.clone();
    let before = device.stored().0;
    let activation = device.configuration().correction.activation;
    let lesson = session.cut(&split.learn);
    let considered = learnt::considered(&lesson, settings);
    let follows = split.follows();
    let unused = session.wheels.is_some() && device.configuration().wheels.is_none();
    let unused = if unused {
        " The speed of the wheels is not used: the unit file has no table [wheels]."
    } else {
        ""
    };
    if follows && activation != Activation::NextPowerOn {
        let run = session.cut(&(split.learn.start..split.judge.end));
        let drive = device.drive_session(&run, split.learn.len());
        let course = course(&drive, &device, &before);
        let note = format!(
            "Without a power-off before the judged part it {}.{unused}",
            course.says
        );
        return of_drives(
            &[&drive],
            &drive,
            (course, device.stored().0, note),
            considered,
        );
    }
    let learnt = device.drive_session(&lesson, split.learn.len());
    let course = course(&learnt, &device, &before);
    let nets = device.stored().0;
    let judged = device.drive_session(&session.cut(&split.judge), 0);
    let note = format!(
        "In the learning part it {}. Switched on again for the judged part, it {}.{unused}",
        course.says,
        since(&judged)
    );
    let both = [&learnt, &judged];
    let drives = if follows { &both[..] } else { &both[1..] };
    of_drives(drives, &learnt, (course, nets, note), considered)
}

fn of_drives(
    drives: &[&Drive],
    learnt: &Drive,
    (course, nets, note): (Course, Nets, String),
    considered: Vec<[f64; 6]>,
) -> Result<Judged, Error> {
    drives.iter().try_for_each(|of| of.corrected.check())?;
    let corrected = drives.iter().flat_map(|of| of.corrected.each());
    let corrected = List::collected(corrected, IN_MEMORY);
    corrected.check()?;
    Ok(Judged {
        corrected,
        changed: drives.iter().any(|of| of.changed),
        correction: drives.iter().flat_map(|of| of.correction.clone()).collect(),
        diary: learnt.diary.clone(),
        considered,
        course,
        nets,
        note: format!("The row `device` is the firmware's own application. {note}"),
    })
}
