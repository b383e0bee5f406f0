//! The mistakes that people make with a recording, in the order in which they are tried, each with
//! what the recording is like without it.

use super::change::{Change, LatLonOrder, Order};
use super::{AXES, Field, Says, TimeDoubt, signs};
use host_io::recordings::clocks;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// A fitted mistake.
pub(super) struct Candidate {
    /// The recording without the mistake.
    pub(super) change: Change,
    /// The field that states it wrongly.
    pub(super) field: String,
    /// What to write instead.
    pub(super) remedy: String,
}

/// A mistake: the candidates for what a recording may be like without it.
pub(super) type Mistake = fn(&Says, Option<&TimeDoubt>) -> Vec<Candidate>;

/// The order of the mistakes.
pub(super) const TABLE: [Mistake; 11] = [
    time_offset,
    time_unit,
    position_unit,
    position_order,
    velocity_order,
    velocity_unit,
    height_unit,
    axes,
    gyro_signs,
    gyro_unit,
    accel_unit,
];

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
    units(&says.fixes.position, &[("rad", 180.0 / PI)], |factor| {
        Change {
            position: [(0, factor), (1, factor)],
            ..Change::NONE
        }
    })
}

/// A lost sign, and latitude and longitude in each other's place. Positions alone do not show which
/// of the two has lost it: the one way is the other one turned by half a turn.
fn position_order(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let latitude = &says.fixes.position;
    let field = |of: &str| latitude.name.replace("latitude", of);
    let minus = |lost: String| match &latitude.named {
        Some((unit, _)) => format!("{lost}: the unit '-{unit}' would fit"),
        None => format!("{lost}: give them with it"),
    };
    let seem = |of: &str, side: &str| {
        minus(format!(
            "the {of} seem to have lost their sign, {side} is negative"
        ))
    };
    let [west, south] = match says.fixes.order.1 {
        Some(_) => [
            (field("longitude"), seem("longitudes", "west")),
            (field("latitude"), seem("latitudes", "south")),
        ],
        None => {
            let (one, other) = (field("latitude"), field("longitude"));
            let fields = match one == other {
                true => one,
                false => format!("{one} or {other}"),
            };
            let either = "either the longitudes seem to have lost their sign (west is negative) \
                          or the latitudes (south is negative), and positions alone do not show \
                          which";
            let either = (fields, minus(either.to_owned()));
            [either.clone(), either]
        }
    };
    let candidate = |position: LatLonOrder, field: String, remedy: String| Candidate {
        change: Change {
            position,
            ..Change::NONE
        },
        field,
        remedy,
    };
    let both =
        "latitudes and longitudes seem to have lost their signs: south and west are negative";
    let swapped = "latitude and longitude seem to have changed places: check their columns";
    vec![
        candidate([(0, 1.0), (1, -1.0)], west.0, west.1),
        candidate([(0, -1.0), (1, 1.0)], south.0, south.1),
        candidate([(0, -1.0), (1, -1.0)], field("latitude"), both.into()),
        candidate(
            [(1, 1.0), (0, 1.0)],
            field("latitude").trim_end_matches(".unit").to_owned(),
            swapped.into(),
        ),
    ]
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

/// What the columns hold if the velocity is `order` of the given one.
fn order_remedy(given: Option<Order>, order: Order) -> String {
    let given = given.unwrap_or(Change::NONE.order);
    let mut columns = ["?"; 3];
    let names = [["north", "south"], ["east", "west"], ["down", "up"]];
    for (axis, (of, sign)) in order.into_iter().enumerate() {
        let (column, given_sign) = given[of];
        columns[column] = names[axis][usize::from(sign * given_sign < 0.0)];
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
    let known = [("ft", 0.3048), ("mm", 1e-3), ("cm", 1e-2), ("km", 1e3)];
    units(&says.fixes.height, &known, |height| Change {
        height,
        ..Change::NONE
    })
}

/// The rotations by multiples of 90 degrees, which leave the forward axis as it is where they can;
/// and columns in each other's place or with the wrong sign.
fn axes(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let (field, example) = &says.axes;
    let all = [1.0, -1.0].into_iter().flat_map(turned);
    all.map(|axes| Candidate {
        change: Change {
            gyro: axes,
            accel: axes,
            ..Change::NONE
        },
        field: field.clone(),
        remedy: axes_remedy(&axes, example),
    })
    .collect()
}

/// Gyros with the wrong sign, and two in each other's place.
fn gyro_signs(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let all = signs::others().map(|gyros| Candidate {
        change: Change {
            gyro: gyros.turn,
            ..Change::NONE
        },
        field: self::gyros(says),
        remedy: match gyros.swapped {
            true => format!(
                "check the columns: the gyros of the axes called {} seem to have changed places",
                gyros.axes
            ),
            false => format!(
                "check the signs: the gyros of the axes called {} seem to turn the other way",
                gyros.axes
            ),
        },
    });
    all.collect()
}

/// The field of the gyros.
pub(super) fn gyros(says: &Says) -> String {
    says.gyro.name.trim_end_matches(".unit").to_owned()
}

/// What is forward, right and down if `axes` turns the given ones into the right ones.
fn axes_remedy(axes: &Matrix3<f64>, example: &str) -> String {
    let now = AXES.iter().enumerate().map(|(row, name)| {
        let column = (0..3).find(|column| axes[(row, *column)] != 0.0);
        let column = column.unwrap_or_default();
        let against = if axes[(row, column)] < 0.0 {
            "against "
        } else {
            ""
        };
        format!(
            "{name} seems to be {against}what is called {}",
            AXES[column]
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
            if matrix.determinant() * hand > 0.0 && matrix != Change::NONE.gyro {
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
        |factor| Change {
            gyro: Matrix3::from_diagonal_element(factor),
            ..Change::NONE
        },
    )
}

fn accel_unit(says: &Says, _: Option<&TimeDoubt>) -> Vec<Candidate> {
    let g = host_core::inertial::units::G0;
    units(&says.accel, &[("g", g), ("m/s2", 1.0 / g)], |factor| {
        Change {
            accel: Matrix3::from_diagonal_element(factor),
            ..Change::NONE
        }
    })
}
