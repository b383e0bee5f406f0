//! The file of the fixes, in its three forms.

use super::table;
use crate::recordings::columns::{POSITION, SIGMA, SIGMA_V, VELOCITY};
use crate::recordings::nowhere::{LeftOut, is_nowhere};
use crate::recordings::record::{NOT_MEASURED, TimedFix};
use crate::recordings::table::Table;
use crate::recordings::week::Unwrapped;
use host_core::error::Error;
use std::path::Path;

/// Metres of a degree of latitude.
const DEGREE_M: f64 = 111_200.0;
/// Longest time between fixes whose positions show a velocity, s.
const NEAR_S: f64 = 2.5;

/// Order of the last nine of 13 columns. Both are in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Velocity, then the standard deviations of position and velocity.
    VelocitySigma,
    /// Standard deviations of position, velocity, then the standard deviations of velocity.
    SigmaVelocity,
}

impl Order {
    /// First columns of velocity, standard deviations of position, and of velocity.
    fn columns(self) -> [usize; 3] {
        match self {
            Self::VelocitySigma => [4, 7, 10],
            Self::SigmaVelocity => [7, 4, 10],
        }
    }

    fn names(self) -> &'static str {
        match self {
            Self::VelocitySigma => "velocity, then the standard deviations",
            Self::SigmaVelocity => {
                "standard deviations of position, velocity, then its standard deviations"
            }
        }
    }
}

/// Reads the fixes. `order`: that of 13 columns, which is else the one that the numbers fit.
pub(super) fn fixes(
    file: &Path,
    order: Option<Order>,
    notes: &mut Vec<String>,
) -> Result<Vec<TimedFix>, Error> {
    let plain = [&POSITION[..], &SIGMA].concat();
    let full = [&POSITION[..], &VELOCITY, &SIGMA, &SIGMA_V].concat();
    let mut table = table(file, &[&plain, &full], false, true)?;
    notes.append(&mut table.notes);
    table.check_within(1..2, 89.9, "give a latitude in degrees, not at a pole")?;
    table.check_within(2..3, 360.0, "give a longitude in degrees")?;
    table.check_within(3..4, 20_000.0, "give a height in m")?;
    let has_velocity = table.row(0).len() == full.len();
    let order = has_velocity.then(|| order.unwrap_or_else(|| guessed(&table)));
    if let Some(order) = order {
        notes.push(format!(
            "{}: the last nine of its 13 columns are read as {}; --gnss-order gives another order.",
            file.display(),
            order.names()
        ));
    }
    let mut out: Vec<TimedFix> = Vec::with_capacity(table.count());
    let mut left_out = LeftOut::default();
    let mut week = Unwrapped::default();
    let mut before = [f64::NEG_INFINITY; 2];
    for (k, r) in table.rows().enumerate() {
        if r.iter().any(|x| x.is_nan()) {
            left_out.count("a value is nan", r[0]);
            continue;
        }
        let time = week.on(r[0]);
        if time <= before[0] {
            return Err(table.time_back(k, "t_s", [before[1], r[0]]));
        }
        before = [time, r[0]];
        if is_nowhere(r[1], r[2]) {
            left_out.count(
                "latitude and longitude are 0, as before the first fix",
                time,
            );
            continue;
        }
        let bad = |c| table.complain(k, c, "not a standard deviation", "give a number above 0");
        out.push(fix(r, time, order).map_err(bad)?);
    }
    notes.extend(week.note("fixes"));
    notes.extend(left_out.notes(&file.display().to_string()));
    Ok(out)
}

/// One fix, or the column of a bad standard deviation.
fn fix(r: &[f64], time: f64, order: Option<Order>) -> Result<TimedFix, usize> {
    let [velocity, sigma, sigma_v] = order.map_or([0, 4, 0], Order::columns);
    let mut sigmas = [NOT_MEASURED; 6];
    for (first, at) in [(0, sigma), (3, sigma_v)] {
        if at == 0 {
            continue;
        }
        let from = r.get(at..at + 3).unwrap_or_default();
        if let Some(c) = from.iter().position(|s| *s <= 0.0) {
            return Err(at + c);
        }
        for (to, from) in sigmas[first..].iter_mut().zip(from) {
            *to = *from;
        }
    }
    let velocity = match (order, r.get(velocity..velocity + 3)) {
        (Some(_), Some([n, e, d])) => [*n, *e, *d],
        _ => [0.0; 3],
    };
    Ok(TimedFix {
        time,
        lat_deg: r[1],
        lon_deg: r[2],
        height_m: r[3],
        velocity,
        sigmas,
    })
}

/// The order that the numbers fit: standard deviations are above 0, and a velocity is the one
/// between the positions.
fn guessed(table: &Table) -> Order {
    let positive = |order: Order| {
        let [_, sigma, _] = order.columns();
        table
            .rows()
            .all(|r| r[sigma..sigma + 3].iter().all(|s| *s > 0.0))
    };
    let off = |order: Order| {
        let [velocity, ..] = order.columns();
        let rows: Vec<&[f64]> = table.rows().collect();
        let pairs = rows
            .windows(2)
            .filter(|w| (0.0..NEAR_S).contains(&(w[1][0] - w[0][0])));
        let sum = pairs.map(|w| {
            let (a, b, dt) = (w[0], w[1], w[1][0] - w[0][0]);
            let north = (b[1] - a[1]) * DEGREE_M / dt;
            let east = (b[2] - a[2]) * DEGREE_M * a[1].to_radians().cos() / dt;
            (north - a[velocity]).hypot(east - a[velocity + 1])
        });
        sum.sum::<f64>()
    };
    let (first, second) = (Order::VelocitySigma, Order::SigmaVelocity);
    match (positive(first), positive(second)) {
        (true, false) => first,
        (false, true) => second,
        _ if off(second) < off(first) => second,
        _ => first,
    }
}
