//! Any header and any table as a recording in CSV, divided by a zero byte. The header may name no
//! file outside its folder.
#![no_main]

use host_sim::recordings::generic;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let (header, table) = fuzz::halves(input);
    if header.contains(&b'/') {
        return;
    }
    let table = fuzz::file("imu.csv", table);
    let header = fuzz::file("header.toml", header);
    match generic::read(&header, &[table]) {
        Ok(record) => {
            let (_, samples) = record.increments();
            let values = samples.iter().flat_map(|s| s.dtheta.iter().chain(&s.dv));
            assert!(values.into_iter().all(|value| value.is_finite()));
            let _ = record.session();
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
