//! Allan deviation at rest, compared with the datasheet.

use super::super::{Contents, Figure, Part, Table};
use super::data;
use crate::allan::{figures, picture, rows};
use host_core::error::Error;
use host_lab::analysis::allan::findings::Findings;
use host_lab::analysis::allan::{Analysis, Coefficient, Kind};

const TITLE: &str = "Noise at rest";
/// Ratio of the noise to the datasheet's from which on the verdict reports it.
const WORSE: f64 = 1.3;

pub(super) fn part(contents: &Contents) -> Result<Part, Error> {
    let findings = match &contents.noise {
        Ok(findings) => findings,
        Err(why) => return Ok(Part::without("noise", TITLE, why)),
    };
    findings.json()?; // rejects results that are not finite
    let mut figures = vec![];
    for (kind, name, title) in [
        (Kind::Gyro, "allan-gyro", "Allan deviation of the gyros"),
        (
            Kind::Accel,
            "allan-accel",
            "Allan deviation of the accelerometers",
        ),
    ] {
        let of = findings.analyses.iter().filter(|a| a.kind == kind);
        let of: Vec<&Analysis> = of.collect();
        if !of.is_empty() {
            figures.push(Figure {
                name,
                title: title.to_owned(),
                caption: "Points: overlapping Allan deviation with its 95 % interval. Lines: the \
                          sum of the fitted noises. Dashes: the datasheet."
                    .to_owned(),
                picture: picture(&of, findings.configured.as_ref()),
            });
        }
    }
    let head = [
        "column",
        "noise",
        "value",
        "95 % interval",
        "unit",
        "datasheet",
    ];
    let mut sentences = vec![format!("Source: {}.", findings.source)];
    sentences.extend(against(findings));
    sentences.extend(findings.notes.iter().map(|note| format!("{note}.")));
    Ok(Part {
        sentences,
        tables: vec![Table {
            caption: Some("Noise coefficients (IEEE 647 and 952)".into()),
            head: head.map(String::from).to_vec(),
            rows: rows(findings).into_iter().map(Vec::from).collect(),
            text: 2,
            ..Table::default()
        }],
        figures,
        data: data(findings),
        ..Part::new("noise", TITLE)
    })
}

/// Compares the white noise of each axis with the datasheet, in sentences.
pub(in super::super) fn against(findings: &Findings) -> Vec<String> {
    let mut out = vec![];
    for (kind, name) in [(Kind::Gyro, "gyros"), (Kind::Accel, "accelerometers")] {
        let stated = findings
            .configured
            .and_then(|c| c[usize::from(kind == Kind::Accel)][1]);
        let of = findings.analyses.iter().filter(|a| a.kind == kind);
        let visible: Vec<(&Analysis, &Coefficient)> = of
            .filter_map(|a| Some((a, a.coefficients.get(1)?)))
            .filter(|(_, n)| n.is_seen())
            .collect();
        if visible.is_empty() && findings.analyses.iter().any(|a| a.kind == kind) {
            out.push(format!(
                "White noise of the {name}: not compared with the datasheet, because other \
                 noise or sway hides it."
            ));
        }
        let Some(stated) = stated.filter(|stated| *stated > 0.0 && !visible.is_empty()) else {
            continue;
        };
        let worse = visible.iter().filter(|(_, n)| n.low > WORSE * stated);
        let worse: Vec<String> = worse
            .map(|(a, n)| format!("{} {:.1} times", a.column, n.value / stated))
            .collect();
        let unit = visible[0].1.unit;
        let names: Vec<&str> = visible.iter().map(|(a, _)| a.column.as_str()).collect();
        let sheet = format!("the {} {unit} of the datasheet", figures(stated));
        out.push(match worse.is_empty() {
            true => format!(
                "White noise of the {name} (seen in {}): not above {sheet}, by its 95 % intervals.",
                names.join(", ")
            ),
            false => format!(
                "White noise of the {name}: above {sheet}: {}.",
                worse.join(", ")
            ),
        });
    }
    out
}
