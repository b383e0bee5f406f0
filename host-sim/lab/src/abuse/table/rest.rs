//! Cases of what may happen to a vehicle that has just been switched on, before it stands.

use super::super::act::Act;
use super::super::begin::Begin;
use super::super::case::{CaseParameter, Row};
use super::super::motion::Motion;
use super::super::sensor::Fault;
use super::super::times::Span;
use super::given;

/// How long it happens.
const LASTS: CaseParameter = given("lasts_s", 60.0);

/// A row without parameters of its own but the last one, [`LASTS`].
const fn row(
    name: &'static str,
    about: &'static str,
    given: &'static [CaseParameter],
    acts: fn(&[f64]) -> Vec<Act>,
) -> Row {
    Row {
        name,
        about,
        span: Span::Before,
        given,
        acts,
    }
}

fn begins(begin: Begin, lasts_s: f64) -> Vec<Act> {
    vec![Act::Motion(Motion::Begins(begin, lasts_s))]
}

/// The rows.
pub(super) const ROWS: &[Row] = &[
    row(
        "rest",
        "Nothing: the vehicle stands a minute longer.",
        &[LASTS],
        |v| begins(Begin::Stands, v[0]),
    ),
    row(
        "rest-idling",
        "The engine idles and shakes it.",
        &[given("force_mps2", 0.5), LASTS],
        |v| begins(Begin::Idles(v[0]), v[1]),
    ),
    row(
        "rest-seated",
        "Somebody sits down after 10 s and rises after 20 s.",
        &[given("tilt_deg", 1.0), LASTS],
        |v| begins(Begin::SitsDown(v[0]), v[1]),
    ),
    row(
        "rest-swayed",
        "People sway it once a second, for 3 s in every 8 s.",
        &[given("roll_deg", 0.3), LASTS],
        |v| begins(Begin::Swayed(v[0]), v[1]),
    ),
    row(
        "rest-loaded",
        "It is loaded: something knocks at it every 3 s.",
        &[given("force_mps2", 0.45), LASTS],
        |v| begins(Begin::Loaded(v[0]), v[1]),
    ),
    row(
        "rest-lift",
        "It is in a lift, which starts after 8 s and stops after 20 s.",
        &[given("force_mps2", 0.8), LASTS],
        |v| begins(Begin::Lift(v[0]), v[1]),
    ),
    row(
        "rest-ferry",
        "It is on a ferry that rolls in swell.",
        &[given("roll_deg", 1.15), given("period_s", 10.0), LASTS],
        |v| begins(Begin::Ferry([v[0], v[1]]), v[2]),
    ),
    row(
        "rest-ferry-calm",
        "The ferry rolls so little that the swell passes for a rest.",
        &[given("roll_deg", 0.1), given("period_s", 12.0), LASTS],
        |v| begins(Begin::Ferry([v[0], v[1]]), v[2]),
    ),
    row(
        "rest-towed",
        "It is towed along a road.",
        &[given("force_mps2", 0.2), LASTS],
        |v| begins(Begin::Towed(v[0]), v[1]),
    ),
    row(
        "rest-creep",
        "It creeps in a wide bend: 0.17 deg/s.",
        &[given("speed_mps", 0.3), given("radius_m", 100.0), LASTS],
        |v| begins(Begin::Creeps([v[0], v[1]]), v[2]),
    ),
    row(
        "rest-turned",
        "It is turned evenly for 15 s and stands from then on.",
        &[given("gyro_dps", 1.15), given("until_s", 15.0), LASTS],
        |v| begins(Begin::Turned([v[0], v[1]]), v[2]),
    ),
    row(
        "rest-turntable-0.1",
        "It is on a turntable.",
        &[given("gyro_dps", 0.1), LASTS],
        |v| begins(Begin::Turned([v[0], f64::INFINITY]), v[1]),
    ),
    row(
        "rest-turntable-0.5",
        "The turntable turns faster.",
        &[given("gyro_dps", 0.5), LASTS],
        |v| begins(Begin::Turned([v[0], f64::INFINITY]), v[1]),
    ),
    row(
        "rest-turntable-2",
        "The turntable turns faster again.",
        &[given("gyro_dps", 2.0), LASTS],
        |v| begins(Begin::Turned([v[0], f64::INFINITY]), v[1]),
    ),
    row(
        "rest-stuck-gyro",
        "It stands, and the downward gyro keeps its first value.",
        &[LASTS],
        |v| {
            let mut acts = begins(Begin::Stands, v[0]);
            acts.push(Act::Sensor(Fault::Stuck(2)));
            acts
        },
    ),
];
