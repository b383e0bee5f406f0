//! Any bytes as a bag of ROS 2: they are read or refused with a message, and all values read are
//! finite.

use host_io::recordings::mcap::{Choice, read};

/// Whether the bag was read.
pub fn run(input: &[u8]) -> bool {
    let path = crate::file("in.mcap", input);
    match read(&path, &Choice::default(), &|_, _| ()) {
        Ok(reading) => {
            crate::finite(&reading.record);
            true
        }
        Err(error) => crate::refused(&error),
    }
}
