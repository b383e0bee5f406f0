//! Unit files on the base of another one, with new numbers and their sources.

use super::sources_of;
use host_core::error::Error;
use host_estimation::analysis::standing::Number;
use host_io::output::write_atomic;
use host_unit::{Sources, ask, schema};
use std::path::Path;

/// The tables of a preset or file, without the terms of a simulation, which would describe another
/// sensor than the new numbers.
pub(super) fn given(name: &str) -> Result<(toml::Table, Sources), Error> {
    let text = sources_of(name)?;
    let mut table: toml::Table = toml::from_str(&text).unwrap_or_default();
    table.remove("simulation");
    Ok((table, Sources::of(&text)))
}

/// The text of the unit file.
pub(super) fn filled(
    mut table: toml::Table,
    mut sources: Sources,
    numbers: &[Number],
    about: &[String],
) -> String {
    for number in numbers {
        let Some((triad, key)) = number.key.split_once('.') else {
            continue;
        };
        let value = toml::Value::Float(number.value);
        sources.put(number.key, value.clone(), number.source.clone());
        let entry = table
            .entry(triad)
            .or_insert_with(|| toml::Table::new().into());
        if let Some(table) = entry.as_table_mut() {
            table.insert(key.to_owned(), value);
        }
    }
    ask::text(&table, &sources, about)
}

/// Writes a unit file, and its schema beside it if there is none.
pub(super) fn write(file: &Path, text: &str) -> Result<(), Error> {
    write_atomic(file, text.as_bytes())?;
    let beside = file.with_file_name(schema::FILE);
    match beside.exists() {
        true => Ok(()),
        false => write_atomic(&beside, schema::text().as_bytes()),
    }
}
