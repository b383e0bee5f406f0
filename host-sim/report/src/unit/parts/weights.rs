//! The networks, and the hash that identifies them.

use super::super::{Contents, Part, Table, WEIGHTS, hash_of};
use super::{benches, case};
use host_device::device::images;
use serde_json::json;

const TITLE: &str = "Weights";

/// The weight image beside the page: that of the device, else of the last case.
pub(in super::super) fn image(contents: &Contents) -> Option<Vec<u8>> {
    match &contents.device {
        Some(device) => Some(device.weights.clone()),
        None => Some(images(&benches(contents).ok()?.last()?.1.nets)),
    }
}

pub(super) fn part(contents: &Contents) -> Part {
    let mut rows = vec![];
    match (&contents.device, benches(contents)) {
        (Some(device), _) => {
            rows.push(("in use in the device".to_owned(), hash_of(&device.weights)));
        }
        (None, Ok(benches)) => {
            for (outcome, bench) in benches {
                let what = format!("{}: from the next power-on on", case(outcome));
                rows.push((what, hash_of(&images(&bench.nets))));
            }
        }
        (None, Err(why)) => return Part::without("weights", TITLE, why),
    }
    Part {
        sentences: vec![format!(
            "The weight image of the last line is the file {WEIGHTS} beside this report, for \
             `device weights put`. `device weights get` and `sha256sum` say what a device has."
        )],
        data: json!(rows),
        tables: vec![Table {
            caption: Some("SHA-256 of the weight image".into()),
            ..Table::of_pairs(rows)
        }],
        folded: true,
        ..Part::new("weights", TITLE)
    }
}
