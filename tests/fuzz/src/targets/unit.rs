//! Any text as a unit file: it is read or refused with a message, and a unit that was read is the
//! same after writing and reading it again.

use firmware::configuration::record::{decode, encode};
use host_unit::Unit;

/// Whether the unit file was read.
pub fn run(input: &[u8]) -> bool {
    let unit = match Unit::read(&crate::file("unit.toml", input)) {
        Ok(unit) => unit,
        Err(error) => return crate::refused(&error),
    };
    let text = unit.to_text("fuzz").expect("a unit that was read");
    let again = Unit::read(&crate::file("again.toml", text.as_bytes())).expect("our own text");
    assert_eq!(format!("{again:?}"), format!("{unit:?}"));
    // a unit file's configuration encodes to a record that a device accepts
    if let Ok(configuration) = unit.configuration() {
        decode(&encode(&configuration)).expect("a unit that was checked");
    }
    true
}
