//! The mistakes that people make with a recording, in the order in which they are tried. Each is
//! fitted to the recording; the one that explains most contradictions is told, and of several that
//! explain the same the first. What it leaves is explained in the same way, with that change.

use super::change::{Change, Order};
use super::evidence::Evidence;
use super::measure::{Kind, Measure, all};
use super::{Doubt, Field, Says, TimeDoubt};
use firmware::plausibility::Expected;
use host_io::recordings::clocks;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// Most mistakes that are told of one recording.
const MOST: usize = 4;

/// A fitted mistake.
struct Candidate {
    /// The recording without the mistake.
    change: Change,
    /// The field that states it wrongly.
    field: String,
    /// What to write instead.
    remedy: String,
}

/// A mistake: the candidates for what a recording may be like without it.
type Mistake = fn(&Says, Option<&TimeDoubt>) -> Vec<Candidate>;

/// The order of the mistakes.
const TABLE: [Mistake; 9] = [
    time_offset,
    time_unit,
    position_unit,
    velocity_order,
    velocity_unit,
    height_unit,
    axes,
    gyro_unit,
    accel_unit,
];

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
            .flat_map(|mistake| mistake(says, clock.as_ref()));
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
        out.push(told(candidate, &now, &after));
        (change, now) = (next, after);
    }
    out.extend(
        now.iter()
            .filter(|m| m.contradicts())
            .map(|m| plain(m, says)),
    );
    out
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
        size: 2.0,
        problem: clock.problem(),
        state: String::new(),
    }));
    measures
}

/// By how much a change is better: contradictions less, then their sizes less, in tenths. What can
/// no longer be compared is not explained.
fn gain(before: &[Measure], after: &[Measure]) -> (i32, i64) {
    let explained = before.iter().filter(|m| is_explained(m, after)).count() as i32;
    let is_new = |m: &&Measure| {
        let was = before.iter().find(|other| other.kind == m.kind);
        m.contradicts() && !was.is_some_and(Measure::contradicts)
    };
    let new = after.iter().filter(is_new).count() as i32;
    let less = before
        .iter()
        .filter_map(|m| Some(m.size - of(m.kind, after)?.size));
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
            kind => fits(kind),
        }
}

fn of(kind: Kind, all: &[Measure]) -> Option<&Measure> {
    all.iter().find(|measure| measure.kind == kind)
}

/// A mistake with what it explains, and how the recording is without it.
fn told(candidate: Candidate, before: &[Measure], after: &[Measure]) -> Doubt {
    let Candidate {
        field,
        remedy,
        change,
    } = candidate;
    let is_clock = change.is_of_clock();
    let explained = before.iter().filter(|m| is_explained(m, after));
    // what the clocks seemed to be is only of interest where they are the mistake
    let told = explained
        .clone()
        .filter(|m| m.kind != Kind::Time || is_clock);
    let problems: Vec<&str> = told.map(|m| m.problem.as_str()).collect();
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
        Kind::Place => (
            &says.fixes.position,
            "give latitude and longitude in their unit",
        ),
        Kind::Moves => (
            &says.fixes.velocity,
            "check columns, order and units of positions and velocities, and the fixes themselves",
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

fn time_offset(says: &Says, clock: Option<&TimeDoubt>) -> Vec<Candidate> {
    let Some(clock) = clock else {
        return Vec::new();
    };
    let why = clocks::named(clock.best_s).map_or(String::new(), |name| format!(" ({name})"));
    vec![Candidate {
        change: Change {
            fix_time: [1.0, clock.best_s - clock.stated_s],
            ..Change::NONE
        },
        field: says.fixes.time.name.clone(),
        remedy: format!(
            "give {:.2} s{why}, or have it estimated (--estimate-time-offset)",
            clock.best_s
        ),
    }]
}

/// Candidates for the unit of a field: those that it could name, or `known` where it has no choice.
fn units(field: &Field, known: &[(&str, f64)], change: impl Fn(f64) -> Change) -> Vec<Candidate> {
    let one = |name: &str, factor: f64, remedy: String| {
        let differs = (factor.ln()).abs() > 1e-6;
        differs.then(|| Candidate {
            change: change(factor),
            field: field.name.clone(),
            remedy: remedy.replace("NAME", name),
        })
    };
    let Some((_, named)) = &field.named else {
        let all = known.iter().map(|(name, factor)| {
            let remedy = "check that the file is in the units of its format; NAME would fit";
            one(name, *factor, remedy.into())
        });
        return all.flatten().collect();
    };
    let choices = field
        .units
        .iter()
        .map(|(name, unit)| (name.as_str(), unit / named));
    let others = known.iter().map(|(name, factor)| (*name, *factor));
    let mut out: Vec<Candidate> = Vec::new();
    for (k, (name, factor)) in choices.chain(others).enumerate() {
        let remedy = match k < field.units.len() {
            true => "the unit 'NAME' would fit",
            false => "convert the values, which seem to be in NAME",
        };
        let seen = out.iter().any(|c| c.change == change(factor));
        out.extend(one(name, factor, remedy.into()).filter(|_| !seen));
    }
    out
}

fn time_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    units(&says.fixes.time_unit, &[], |factor| Change {
        fix_time: [factor, 0.0],
        ..Change::NONE
    })
}

fn position_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    units(&says.fixes.position, &[("rad", 180.0 / PI)], |position| {
        Change {
            position,
            ..Change::NONE
        }
    })
}

/// The orders that are in use come first.
fn velocity_order(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let (n, e, d) = ((0, 1.0), (1, 1.0), (2, 1.0));
    let minus = |(of, sign): (usize, f64)| (of, -sign);
    let orders: [Order; 10] = [
        [e, n, minus(d)],
        [n, e, minus(d)],
        [e, n, d],
        [n, minus(e), minus(d)],
        [n, minus(e), d],
        [minus(n), minus(e), d],
        [minus(n), e, d],
        [minus(e), n, d],
        [e, minus(n), d],
        [minus(e), minus(n), d],
    ];
    let all = orders.into_iter().map(|order| Candidate {
        change: Change {
            order,
            ..Change::NONE
        },
        field: says.fixes.order.0.clone(),
        remedy: order_remedy(says.fixes.order.1, order),
    });
    all.collect()
}

/// What the columns hold if the velocity is `order` of the told one.
fn order_remedy(told: Option<Order>, order: Order) -> String {
    let told = told.unwrap_or(Change::NONE.order);
    let mut columns = ["?"; 3];
    let names = [["north", "south"], ["east", "west"], ["down", "up"]];
    for (axis, (of, sign)) in order.into_iter().enumerate() {
        let (column, told_sign) = told[of];
        columns[column] = names[axis][usize::from(sign * told_sign < 0.0)];
    }
    let known = match columns {
        ["north", "east", "down"] => "the order 'ned' would fit: ",
        ["east", "north", "up"] => "the order 'enu' would fit: ",
        ["north", "east", "up"] => "the order 'neu' would fit: ",
        _ => "change the columns: ",
    };
    format!("{known}they seem to hold {}", columns.join(", "))
}

fn velocity_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let known = [
        ("km/h", 1.0 / 3.6),
        ("knots", 1852.0 / 3600.0),
        ("ft/s", 0.3048),
        ("mm/s", 1e-3),
        ("cm/s", 1e-2),
    ];
    units(&says.fixes.velocity, &known, |speed| Change {
        speed,
        ..Change::NONE
    })
}

fn height_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let known = [("ft", 0.3048), ("mm", 1e-3), ("cm", 1e-2)];
    units(&says.fixes.height, &known, |height| Change {
        height,
        ..Change::NONE
    })
}

/// The rotations by multiples of 90 degrees, which leave the forward axis as it is where they can;
/// columns in each other's place or with the wrong sign; and gyros with the wrong sign.
fn axes(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let (field, example) = &says.axes;
    let mut out: Vec<Candidate> = [1.0, -1.0]
        .into_iter()
        .flat_map(turned)
        .map(|axes| Candidate {
            change: Change {
                axes,
                ..Change::NONE
            },
            field: field.clone(),
            remedy: axes_remedy(&axes, example),
        })
        .collect();
    out.push(Candidate {
        change: Change {
            gyro: -1.0,
            ..Change::NONE
        },
        field: field.clone(),
        remedy: format!("check the signs, as in {example}"),
    });
    out
}

/// What is forward, right and down if `axes` turns the told ones into the right ones.
fn axes_remedy(axes: &Matrix3<f64>, example: &str) -> String {
    let names = ["forward", "right", "down"];
    let now = names.iter().enumerate().map(|(row, name)| {
        let column = (0..3).find(|column| axes[(row, *column)] != 0.0);
        let column = column.unwrap_or_default();
        let against = if axes[(row, column)] < 0.0 {
            "against "
        } else {
            ""
        };
        format!(
            "{name} seems to be {against}what is called {}",
            names[column]
        )
    });
    let now: Vec<String> = now.collect();
    match axes[(2, 2)] > 0.0 {
        true => format!("turn the axes: {}", now[..2].join(", and ")),
        false => format!(
            "give the axis that points down as the third one, as in {example}: {}",
            now[2]
        ),
    }
}

/// All rotations by multiples of 90 degrees but none at all; with `hand` -1 all others that put
/// axes into each other's place.
fn turned(hand: f64) -> Vec<Matrix3<f64>> {
    let mut out = Vec::new();
    for order in [
        [0, 1, 2],
        [0, 2, 1],
        [1, 0, 2],
        [2, 1, 0],
        [1, 2, 0],
        [2, 0, 1],
    ] {
        for signs in 0..8u8 {
            let mut matrix = Matrix3::zeros();
            for (row, column) in order.into_iter().enumerate() {
                matrix[(row, column)] = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            }
            if matrix.determinant() * hand > 0.0 && matrix != Change::NONE.axes {
                out.push(matrix);
            }
        }
    }
    out
}

fn gyro_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    units(
        &says.gyro,
        &[("deg", PI / 180.0), ("rad", 180.0 / PI)],
        |gyro| Change {
            gyro,
            ..Change::NONE
        },
    )
}

fn accel_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let g = host_core::inertial::units::G0;
    units(&says.accel, &[("g", g), ("m/s2", 1.0 / g)], |accel| {
        Change {
            accel,
            ..Change::NONE
        }
    })
}
