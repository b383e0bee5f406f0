//! Allan deviation at rest, compared with the datasheet.

use super::super::{Contents, Figure, Part, Table};
use super::data;
use crate::allan::{against, caption, picture, rows};
use host_core::error::Error;
use host_estimation::analysis::allan::{Analysis, Kind};

const TITLE: &str = "Noise at rest";

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
                caption: caption(findings),
                picture: picture(&of, findings.configured.as_ref()),
                narrow: None,
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
