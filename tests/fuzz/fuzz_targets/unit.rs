//! Any text as a unit file: it is read or refused with a sentence, and what was read is written and
//! read again the same.
#![no_main]

use firmware::configuration::record::{decode, encode};
use host_sim::unit::Unit;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let unit = match Unit::read(&fuzz::file("unit.toml", input)) {
        Ok(unit) => unit,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let text = unit.to_text("fuzz").expect("a unit that was read");
    let again = Unit::read(&fuzz::file("again.toml", text.as_bytes())).expect("our own text");
    assert_eq!(format!("{again:?}"), format!("{unit:?}"));
    // what a device is told is a record that it takes
    if let Ok(told) = unit.configuration() {
        decode(&encode(&told)).expect("a unit that was checked");
    }
});
