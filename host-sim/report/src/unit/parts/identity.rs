//! Identity of the unit, its datasheet, and the sources of the report.

use super::super::{Contents, Part, Table};
use crate::allan::figures;
use serde_json::json;

pub(super) fn part(contents: &Contents) -> Part {
    let unit = &contents.unit;
    let mut tables = vec![
        Table {
            caption: Some("The unit by its datasheet".into()),
            ..Table::of_pairs(datasheet(contents))
        },
        Table {
            caption: Some("What was looked at".into()),
            ..Table::of_pairs(contents.source.clone())
        },
    ];
    if !contents.files.is_empty() {
        let rows = contents.files.iter();
        tables.push(Table {
            caption: Some("Files and their SHA-256".into()),
            ..Table::of_pairs(rows.cloned())
        });
    }
    Part {
        sentences: contents.warnings.clone(),
        tables,
        data: json!({
            "unit": unit.name,
            "serial": unit.serial,
            "source": contents.source,
            "files": contents.files,
        }),
        ..Part::new("identity", "Identity")
    }
}

/// Rows of the unit file.
fn datasheet(contents: &Contents) -> Vec<(String, String)> {
    let (unit, spec) = (&contents.unit, contents.unit.simulated());
    let given = contents.unit_name.as_deref();
    let pair = |label: &str, value: String| (label.to_owned(), value);
    vec![
        pair("unit", unit.name.clone()),
        pair("serial number", or_none(&unit.serial)),
        pair("given by", given.unwrap_or("nothing: assumed").to_owned()),
        pair("sensor", format!("{} samples a second", spec.rate_hz)),
        pair(
            "gyros, bias from turn-on to turn-on",
            format!("{} deg/h", figures(spec.gyro.bias_turn_on_dph)),
        ),
        pair(
            "gyros, angle random walk",
            format!(
                "{} deg/sqrt(h)",
                figures(spec.gyro.total_angle_random_walk_dpsqrth())
            ),
        ),
        pair(
            "accelerometers, bias from turn-on to turn-on",
            format!("{} ug", figures(spec.accel.bias_turn_on_ug)),
        ),
        pair(
            "accelerometers, velocity random walk",
            format!(
                "{} ug/sqrt(Hz)",
                figures(spec.accel.velocity_random_walk_ugpsqrthz)
            ),
        ),
    ]
}

fn or_none(text: &str) -> String {
    if text.is_empty() { "none given" } else { text }.to_owned()
}
