//! The error bound of corrections.

use super::super::{Contents, Part, Table};
use super::benches;
use crate::text::{capital, thousands};
use firmware::error_bound::TIMES_S;
use serde_json::json;

const TITLE: &str = "Bound of the harm";

pub(super) fn part(contents: &Contents) -> Part {
    let head = ["case".to_owned()].into_iter();
    let head = head.chain(TIMES_S.iter().map(|s| format!("{} min, m", s / 60)));
    let mut sentences = vec![];
    let mut rows: Vec<(String, [u32; 5])> = vec![];
    let mut why = None;
    match benches(contents) {
        Ok(benches) => {
            for (outcome, bench) in benches {
                let text = format!("{}.", capital(&bench.bound));
                if !sentences.contains(&text) {
                    sentences.push(text);
                }
                rows.push((super::case(outcome), bench.bound_m));
            }
        }
        Err(text) => why = Some(text.to_owned()),
    }
    if let Some(device) = &contents.device {
        why = match device.info.configured {
            true => {
                rows.push(("device".into(), device.info.error_bound_m));
                None
            }
            false => Some("a device without a configuration corrects nothing".into()),
        };
    }
    if let Some(why) = why {
        return Part::without("bound", TITLE, &why);
    }
    let data = rows
        .iter()
        .map(|(case, metres)| json!({ "case": case, "metres": metres }));
    let row = |(case, metres): &(String, [u32; 5])| {
        let metres = metres.iter().map(|m| thousands(*m));
        [case.clone()].into_iter().chain(metres).collect()
    };
    Part {
        data: data.collect(),
        sentences,
        tables: vec![Table {
            caption: Some(
                "Most metres that corrections within their limits add to a free-inertial position, \
                 so long after an alignment"
                    .into(),
            ),
            head: head.collect(),
            rows: rows.iter().map(row).collect(),
            text: 1,
            ..Table::default()
        }],
        folded: true,
        ..Part::new("bound", TITLE)
    }
}
