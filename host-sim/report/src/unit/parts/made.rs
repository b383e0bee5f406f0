//! Versions, and the commands that made the report.

use super::super::{Contents, Part, Table};
use firmware::model::Nets;
use firmware::wire::command::WIRE_VERSION;
use host_device::device::images;
use serde_json::json;

pub(super) fn part(contents: &Contents) -> Part {
    // the version of the image follows four bytes of a magic number
    let image = images(&Nets::NONE).get(4).copied().unwrap_or(0);
    let pair = |label: &str, value: String| (label.to_owned(), value);
    let mut versions = vec![
        pair("host-sim", env!("CARGO_PKG_VERSION").to_owned()),
        pair("command link", WIRE_VERSION.to_string()),
        pair("weight image", image.to_string()),
    ];
    if let Some(device) = &contents.device {
        versions.push(pair("firmware of the device", device.info.firmware.clone()));
    }
    Part {
        sentences: vec![
            "The first command makes this report again, byte for byte, from the same files. The \
             others give its parts alone."
                .into(),
        ],
        data: json!({ "versions": versions, "commands": contents.commands }),
        tables: vec![Table::of_pairs(versions)],
        commands: contents.commands.clone(),
        folded: true,
        ..Part::new("made", "Versions and commands")
    }
}
