//! Any bytes as a log of PX4: they are read or refused with a message, and all values read are
//! finite.

use host_io::recordings::ulog::{Choice, read};

/// Whether the log was read.
pub fn run(input: &[u8]) -> bool {
    let path = crate::file("in.ulog", input);
    match read(&path, &Choice::default(), &|_, _| ()) {
        Ok(reading) => {
            crate::finite(&reading.record);
            true
        }
        Err(error) => crate::refused(&error),
    }
}
