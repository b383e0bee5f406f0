//! The state that a device reports at its command link.

use super::super::{Part, Table};
use super::data;
use host_device::device::Info;
use host_device::device::faults::Fault;
use serde::Serialize;
use std::collections::BTreeMap;

/// The data that were read from a device.
#[derive(Debug, Clone, Serialize)]
pub struct Readout {
    /// Its identity and configuration.
    pub info: Info,
    /// Present faults.
    pub faults: Vec<Fault>,
    /// Its counters since power-on.
    pub counters: BTreeMap<&'static str, u32>,
    /// The weight image in use.
    #[serde(skip)]
    pub weights: Vec<u8>,
    /// Number of pages of its black box that are in use, or why it is not known.
    pub black_box: Result<u32, String>,
    /// The data that could not be read, in sentences.
    pub missing: Vec<String>,
}

pub(super) fn part(readout: &Readout) -> Part {
    let faults = readout.faults.iter().map(|fault| {
        let text = |text: &str| text.to_owned();
        vec![text(fault.name), text(fault.says), text(fault.remedy)]
    });
    let counters = readout
        .counters
        .iter()
        .map(|(name, n)| ((*name).to_owned(), n.to_string()));
    let mut tables = vec![
        Table {
            caption: Some("State".into()),
            ..Table::of_pairs(state(readout))
        },
        Table {
            caption: Some("Counters since power-on".into()),
            ..Table::of_pairs(counters)
        },
    ];
    if !readout.faults.is_empty() {
        tables.insert(
            0,
            Table {
                caption: Some("Faults now".into()),
                head: ["fault", "what it says", "remedy"]
                    .map(String::from)
                    .to_vec(),
                rows: faults.collect(),
                text: 3,
                ..Table::default()
            },
        );
    }
    Part {
        sentences: readout.missing.clone(),
        tables,
        data: data(readout),
        ..Part::new("device", "State of the device")
    }
}

/// Labels and values of its state.
fn state(readout: &Readout) -> Vec<(String, String)> {
    let Readout { info, .. } = readout;
    let pair = |label: &str, value: String| (label.to_owned(), value);
    let learner = &info.learner;
    let sigma = learner.heading_sigma_deg;
    let sigma = sigma.map_or("unknown".into(), |deg| format!("{deg:.3} deg"));
    vec![
        pair("mode", info.mode.to_owned()),
        pair("configured", yes(info.configured)),
        pair("configuration stored", yes(info.stored)),
        pair("security", info.security.state.to_owned()),
        pair("navigates", yes(learner.navigates)),
        pair("heading from", format!("{}, sigma {sigma}", learner.way)),
        pair("candidate in force", name(learner.winner)),
        pair(
            "fixes used, refused",
            format!("{}, {}", learner.used_fixes, learner.refused_fixes),
        ),
        pair(
            "promoted, given up",
            format!("{}, {}", learner.promotions, learner.rollbacks),
        ),
        pair(
            "drives remembered",
            format!("{}, {:.1} h", info.memory.drives, info.memory.hours),
        ),
        pair("stored networks act", yes(info.memory.acts)),
        pair("black box", black_box(&readout.black_box)),
    ]
}

fn yes(is: bool) -> String {
    if is { "yes" } else { "no" }.to_owned()
}

/// The name of a candidate by the number that the device reports.
pub(in super::super) fn name(winner: u8) -> String {
    let names = firmware::learn::bank::NAMES;
    names
        .get(usize::from(winner))
        .map_or_else(|| format!("number {winner}"), |n| (*n).to_owned())
}

fn black_box(pages: &Result<u32, String>) -> String {
    match pages {
        Ok(pages) => format!("pages begun: {pages}; `device blackbox -o FILE` fetches them"),
        Err(why) => why.clone(),
    }
}
