//! The parts of the report, one file each.

mod bound;
pub(super) mod device;
mod identity;
mod learnable;
mod learnt;
mod made;
mod navigation;
mod noise;
mod rehearsals;
pub(super) mod weights;

pub(super) use learnable::halved;
pub(super) use rehearsals::in_force;

use super::{Contents, Part};
use host_core::error::Error;
use host_lab::experiment::outcome::{Bench, Outcome};
use serde::Serialize;
use serde_json::Value;

/// All parts, in the order of the report.
pub(super) fn all(contents: &Contents) -> Result<Vec<Part>, Error> {
    let mut parts = vec![
        identity::part(contents),
        noise::part(contents)?,
        learnable::part(contents)?,
        learnt::part(contents),
        rehearsals::part(contents),
        navigation::part(contents)?,
        bound::part(contents),
        weights::part(contents),
    ];
    parts.extend(contents.device.as_ref().map(device::part));
    parts.push(made::part(contents));
    Ok(parts)
}

/// The cases with results of the device, or why there are none.
fn benches(contents: &Contents) -> Result<Vec<(&Outcome, &Bench)>, &str> {
    let outcomes = contents.outcomes.as_ref().map_err(String::as_str)?;
    let each = outcomes.iter();
    Ok(each
        .filter_map(|outcome| Some((outcome, outcome.bench.as_deref()?)))
        .collect())
}

/// The title of one of several replays.
fn case(outcome: &Outcome) -> String {
    format!("{}, {}", outcome.recording, outcome.case)
}

/// Results as data. A value that JSON cannot hold becomes `null`.
fn data<T: Serialize + ?Sized>(results: &T) -> Value {
    serde_json::to_value(results).unwrap_or_default()
}
