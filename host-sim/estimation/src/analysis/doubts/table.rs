//! Each mistake is fitted to the recording; the one that explains most contradictions is reported,
//! and of several that explain the same the first. What it leaves is explained in the same way,
//! with that change.

use super::change::Change;
use super::evidence::Evidence;
use super::measure::{Kind, Measure, all};
use super::mistakes::{Candidate, TABLE, gyros};
use super::{Doubt, Says, TimeDoubt};
use firmware::plausibility::Expected;

/// Most mistakes that are reported of one recording.
const MOST: usize = 4;

/// The contradictions of a recording, each with the mistake that explains it if there is one.
/// `clock`: the offset of the clocks that the data contradict; `again` finds it anew after a
/// change.
pub(super) fn doubts(
    evidence: &Evidence,
    expected: &Expected,
    says: &Says,
    clock: Option<TimeDoubt>,
    again: &dyn Fn(&Change) -> Option<TimeDoubt>,
) -> Vec<Doubt> {
    let mut change = Change::NONE;
    let mut clock = clock;
    let mut now = measured(evidence, expected, &change, clock.as_ref());
    let mut out = Vec::new();
    while now.iter().any(Measure::contradicts) && out.len() < MOST {
        let fitted = TABLE
            .iter()
            .flat_map(|mistake| mistake(says, clock.as_ref()))
            .filter(|candidate| is_on_earth(evidence, &candidate.change.after(&change)));
        let tried = fitted.map(|candidate| {
            let next = candidate.change.after(&change);
            let clock = clock
                .as_ref()
                .filter(|_| candidate.change.fix_time[1] == 0.0);
            let mut after = measured(evidence, expected, &next, clock);
            // what explains something may also be why the clocks seem to differ
            if clock.is_some() && gain(&now, &after).0 > 0 {
                after = measured(evidence, expected, &next, again(&next).as_ref());
            }
            (candidate, next, after)
        });
        // the first of the best ones
        let best = tried.reduce(
            |best, other| match gain(&now, &other.2) > gain(&now, &best.2) {
                true => other,
                false => best,
            },
        );
        let Some((candidate, next, mut after)) = best.filter(|(.., after)| gain(&now, after).0 > 0)
        else {
            break;
        };
        if candidate.change.is_of_clock() {
            clock = None;
        } else {
            clock = again(&next);
            after = measured(evidence, expected, &next, clock.as_ref());
        }
        out.push(reported(candidate, &now, &after));
        (change, now) = (next, after);
    }
    out.extend(
        now.iter()
            .filter(|m| m.contradicts())
            .map(|m| plain(m, says)),
    );
    out
}

/// Whether the positions are still some.
fn is_on_earth(evidence: &Evidence, change: &Change) -> bool {
    let fixes = evidence.fixes.iter().take(1).map(|fix| change.fix(fix));
    { fixes }.all(|fix| fix.lat_deg.abs() < 90.0 && fix.lon_deg.abs() <= 360.0)
}

/// All comparisons under a change.
fn measured(
    evidence: &Evidence,
    expected: &Expected,
    change: &Change,
    clock: Option<&TimeDoubt>,
) -> Vec<Measure> {
    let mut measures = match *change == Change::NONE {
        true => all(evidence, expected),
        false => all(&evidence.with(change), expected),
    };
    measures.extend(clock.map(|clock| Measure {
        kind: Kind::Time,
        left: 0.0,
        size: 2.0,
        problem: clock.problem(),
        state: String::new(),
    }));
    measures
}

/// By how much a change is better: contradictions less, then their sizes, and what is left, less,
/// in tenths. What can
/// no longer be compared is not explained.
fn gain(before: &[Measure], after: &[Measure]) -> (i32, i64) {
    let explained = before.iter().filter(|m| is_explained(m, after)).count() as i32;
    let is_new = |m: &&Measure| {
        let was = before.iter().find(|other| other.kind == m.kind);
        m.contradicts() && !was.is_some_and(Measure::contradicts)
    };
    let new = after.iter().filter(is_new).count() as i32;
    let less = before.iter().filter_map(|m| {
        let now = of(m.kind, after)?;
        Some(m.size - now.size + m.left - now.left)
    });
    (explained - new, (10.0 * less.sum::<f64>()) as i64)
}

/// Whether a contradiction is none any more.
fn is_explained(measure: &Measure, after: &[Measure]) -> bool {
    let fits = |kind: Kind| of(kind, after).is_some_and(|m| !m.contradicts());
    measure.contradicts()
        && match measure.kind {
            // the clocks are only compared where they contradict each other
            Kind::Time => of(Kind::Time, after).is_none(),
            // gyros whose unit the course shows are not compared with the Earth
            Kind::Earth => fits(Kind::Earth) || fits(Kind::Turns),
            // what is right agrees well, and noise only adds a little
            Kind::Moves => of(Kind::Moves, after).is_some_and(|m| m.size < 0.5),
            // gyros that hardly turn have no signs
            Kind::Signs => {
                of(Kind::Signs, after).is_some_and(|m| !m.contradicts() && m.left < measure.left)
            }
            kind => fits(kind),
        }
}

fn of(kind: Kind, all: &[Measure]) -> Option<&Measure> {
    all.iter().find(|measure| measure.kind == kind)
}

/// A mistake with what it explains, and how the recording is without it.
fn reported(candidate: Candidate, before: &[Measure], after: &[Measure]) -> Doubt {
    let Candidate {
        field,
        remedy,
        change,
    } = candidate;
    let is_clock = change.is_of_clock();
    let explained = before.iter().filter(|m| is_explained(m, after));
    // what the clocks seemed to be is only of interest where they are the mistake
    let reported = explained
        .clone()
        .filter(|m| m.kind != Kind::Time || is_clock);
    let problems: Vec<&str> = reported.map(|m| m.problem.as_str()).collect();
    let states = explained.filter_map(|m| {
        let now = of(m.kind, after)?;
        (!now.state.is_empty()).then_some(now.state.as_str())
    });
    let states: Vec<&str> = states.collect();
    let remedy = match states[..] {
        [] => remedy,
        _ => format!("{remedy}; then {}", states.join(", and ")),
    };
    (field, problems.join(", and "), remedy)
}

/// A contradiction that no mistake explains.
fn plain(measure: &Measure, says: &Says) -> Doubt {
    let (field, remedy) = match measure.kind {
        Kind::Position => (
            &says.fixes.position,
            "give latitude and longitude in their unit",
        ),
        Kind::Moves => (
            &says.fixes.velocity,
            "check columns, order and units of positions and velocities, and the fixes themselves",
        ),
        Kind::Climbs if measure.problem.contains("at all fixes") => (
            &says.fixes.height,
            "leave the height out: a logger without one writes zeros; or check its column",
        ),
        Kind::Climbs => (
            &says.fixes.height,
            "check the columns and units of the height and of the vertical velocity",
        ),
        Kind::Time => (
            &says.fixes.time,
            "give that offset, or have it estimated (--estimate-time-offset)",
        ),
        Kind::Turns if measure.problem.starts_with("turns") => {
            let remedy = format!("check the signs, as in {}", says.axes.1);
            return (says.axes.0.clone(), measure.problem.clone(), remedy);
        }
        Kind::Turns => (&says.gyro, ""),
        Kind::Ahead => {
            let remedy = "check the columns of the accelerometers and the axes";
            return (says.axes.0.clone(), measure.problem.clone(), remedy.into());
        }
        Kind::Signs => {
            let remedy = "check the signs and the axes of the gyros";
            return (gyros(says), measure.problem.clone(), remedy.into());
        }
        Kind::Gravity if measure.problem.contains("where gravity is missing") => (
            &says.accel,
            "give the specific force as the sensors measure it, with gravity; it seems to have \
             been taken off (\"linear acceleration\")",
        ),
        Kind::Gravity => (&says.accel, ""),
        Kind::Earth => (&says.gyro, "check the unit, and the bias of the datasheet"),
        Kind::Down => {
            let remedy = format!(
                "give the axis that points down as the third one, as in {}",
                says.axes.1
            );
            return (says.axes.0.clone(), measure.problem.clone(), remedy);
        }
    };
    let remedy = match remedy.is_empty() {
        false => remedy.to_owned(),
        true => field.unfit(),
    };
    (field.name.clone(), measure.problem.clone(), remedy)
}
