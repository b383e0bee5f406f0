//! docs/your-data.md against the parser.

use super::super::header::Header;

#[test]
fn the_documented_example_is_a_header() {
    let doc: String = include_str!("../mod.rs")
        .lines()
        .skip_while(|l| *l != "//! ```toml")
        .skip(1)
        .take_while(|l| *l != "//! ```")
        .map(|l| l.trim_start_matches("//!").to_owned() + "\n")
        .collect();
    let header: Header = toml::from_str(&doc).unwrap();
    assert_eq!(header.start.standstill_s, Some(300.0));
    // the keys that are commented out exist, too
    let all = doc
        .replace("# separator", "separator")
        .replace("# names", "names")
        .replace("# max_gap", "max_gap");
    toml::from_str::<Header>(&all).unwrap();
}

/// The example header in docs/your-data.md is valid.
#[test]
fn the_example_of_the_page_is_a_header() {
    let page = include_str!("../../../../../../docs/your-data.md");
    let (_, example) = page.split_once("```toml\n").unwrap();
    let (example, _) = example.split_once("```").unwrap();
    let header: Header = toml::from_str(example).unwrap();
    assert_eq!(header.start.standstill_s, Some(120.0));
}

/// The rows of the table of keys in docs/your-data.md, as `table.key`.
fn documented() -> std::collections::BTreeSet<String> {
    let page = include_str!("../../../../../../docs/your-data.md");
    let (_, table) = page.split_once("| field | meaning | default |").unwrap();
    let rows = table.lines().skip(1).take_while(|row| !row.is_empty());
    let keys = rows.filter_map(|row| row.strip_prefix("| ")?.split_once(" | "));
    let keys = keys.flat_map(|(first, _)| {
        let mut table = "";
        let names = first.split('`').skip(1).step_by(2);
        let key = names.map(move |name| match name.split_once('.') {
            Some((of, key)) => {
                table = of;
                format!("{table}.{key}")
            }
            None if table.is_empty() => name.to_owned(),
            None => format!("{table}.{name}"),
        });
        key.collect::<Vec<_>>()
    });
    keys.collect()
}

/// The keys that the parser lists when it meets an unknown one.
fn expected(header: &str) -> Vec<String> {
    let error = toml::from_str::<super::header::Header>(header).unwrap_err();
    let (_, names) = error.message().split_once("expected ").unwrap();
    names
        .split('`')
        .skip(1)
        .step_by(2)
        .map(String::from)
        .collect()
}

/// docs/your-data.md explains each key of the header, and no other.
#[test]
fn the_table_of_keys_is_that_of_the_parser() {
    let mut known: Vec<String> = expected("zzz = 1");
    known.retain(|table| !["imu", "wheels", "start"].contains(&table.as_str()));
    for table in ["imu", "gnss", "wheels", "start"] {
        let keys = expected(&format!("[{table}]\nzzz = 1"));
        known.extend(keys.iter().map(|key| format!("{table}.{key}")));
    }
    let truth = toml::from_str::<super::header::TruthTable>("zzz = 1").unwrap_err();
    let (_, names) = truth.message().split_once("expected ").unwrap();
    let names = names.split('`').skip(1).step_by(2);
    known.extend(names.map(|key| format!("truth.{key}")));
    let documented = documented();
    assert!(known.len() > 30, "{known:?}");
    assert_eq!(documented, known.into_iter().collect());
}
