//! The table of cases, by what is disturbed. A new case is one row in one of these files.

mod combined;
mod configured;
mod motion;
mod receiver;
mod rest;
mod sensor;
mod timing;

use super::case::{CaseParameter, Row};
use super::times::Span;

/// The parts of the table with their headings.
pub const PARTS: [(&str, &[Row]); 7] = [
    ("Nothing", &[NONE]),
    ("Receiver", receiver::ROWS),
    ("Motion", motion::ROWS),
    ("Sensor", sensor::ROWS),
    ("Line and timing", timing::ROWS),
    ("Configured, wired and asked", configured::ROWS),
    (AT_POWER_ON, rest::ROWS),
];

const NONE: Row = Row {
    name: "none",
    about: "Nothing is wrong: what the device gains or costs without a disturbance.",
    span: Span::Always,
    given: &[],
    acts: |_| Vec::new(),
};

/// All rows.
pub fn rows() -> impl Iterator<Item = &'static Row> {
    PARTS.iter().flat_map(|(_, rows)| rows.iter())
}

/// The heading of the part of the table that a case belongs to.
#[must_use]
pub fn part_of(case: &str) -> &'static str {
    let of = |(_, rows): &&(&str, &[Row])| rows.iter().any(|row| row.name == case);
    PARTS
        .iter()
        .find(of)
        .map_or(COMBINED, |(heading, _)| heading)
}

/// Heading of the cases of the first rest.
pub const AT_POWER_ON: &str = "At power-on";

/// Names of the cases of the first rest.
pub fn at_power_on() -> impl Iterator<Item = &'static str> {
    let parts = PARTS.iter().filter(|(heading, _)| *heading == AT_POWER_ON);
    parts.flat_map(|(_, rows)| *rows).map(|row| row.name)
}

/// Heading of the cases that are no single row.
pub const COMBINED: &str = "Several at once, and with an end";

/// The names of the cases that are run by default: all rows, several at once, and those that end.
pub fn usual() -> impl Iterator<Item = &'static str> {
    rows()
        .map(|row| row.name)
        .chain(combined::NAMES.iter().copied())
}

const fn given(key: &'static str, value: f64) -> CaseParameter {
    CaseParameter { key, value }
}
