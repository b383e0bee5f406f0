//! Any bytes as a log of PX4: they are read or refused with a sentence, and all that is read is
//! finite.
#![no_main]

use host_sim::recordings::ulog::{Choice, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let path = fuzz::file("in.ulog", input);
    match read(&path, &Choice::default(), &|_, _| ()) {
        Ok(reading) => {
            let (_, samples) = reading.record.increments();
            let values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
            assert!(values.into_iter().all(|value| value.is_finite()));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
