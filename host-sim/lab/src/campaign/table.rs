//! Results as CSV: one row a run, error model and scheme.

use super::{Merged, Row, Seeds};
use crate::experiment::run::TIMES_MIN;
use std::io;

/// The file: the same bytes for the same results.
///
/// # Errors
/// Never fails, since it writes to memory.
pub fn to_csv(results: &Merged) -> io::Result<Vec<u8>> {
    let mut file = csv::Writer::from_writer(Vec::new());
    file.write_record(head())?;
    let fingerprint = fingerprint(&results.fingerprint);
    for row in &results.rows {
        file.write_record(cells(results, row, &fingerprint))?;
    }
    file.into_inner().map_err(|error| error.into_error())
}

fn head() -> Vec<String> {
    let mut names: Vec<String> = ["run", "error_model", "scheme", "start", "drives"]
        .map(String::from)
        .into();
    for t in TIMES_MIN {
        names.extend(["horizontal", "north", "east"].map(|of| format!("{of}_{t}min_m")));
    }
    let last = [
        "heading_rad",
        "seed_unit",
        "seed_turn_on",
        "seed_drive",
        "tuned_walk_per_h",
        "tuned_none_factor",
        "tuned_rnn_factor",
        "version",
        "fingerprint",
    ];
    names.extend(last.map(String::from));
    names
}

fn cells(results: &Merged, row: &Row, fingerprint: &str) -> Vec<String> {
    let (seeds, tuned) = (Seeds::of(row.run), results.tuning.of(row.error_model));
    let mut cells = vec![
        row.run.to_string(),
        row.error_model.to_string(),
        row.scheme.clone(),
        row.start.to_string(),
        row.drives.to_string(),
    ];
    for i in 0..TIMES_MIN.len() {
        cells.extend([row.horizontal_m[i], row.north_m[i], row.east_m[i]].map(|x| x.to_string()));
    }
    cells.push(seeds.heading.to_string());
    cells.extend([seeds.unit, seeds.turn_on, seeds.drive].map(|seed| seed.to_string()));
    let walk = tuned.walk_of(&row.scheme);
    cells.extend([walk, tuned.none_factor, tuned.rnn_factor].map(|x| x.to_string()));
    cells.extend([crate::version().replace(',', ""), fingerprint.to_owned()]);
    cells
}

/// Sixteen hexadecimal digits for a campaign's settings (FNV-1a).
#[must_use]
pub fn fingerprint(settings: &str) -> String {
    let hash = settings.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
