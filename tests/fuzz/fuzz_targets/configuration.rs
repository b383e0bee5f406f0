//! Any bytes as a configuration record of any schema, also with a right frame around them: what is
//! taken is in range, and an application starts with it.
#![no_main]

use firmware::app::{App, Config};
use firmware::configuration::record::{decode, encode, schema};
use libfuzzer_sys::fuzz_target;

fn framed(schema: u8, body: &[u8]) -> Vec<u8> {
    let mut record = b"LRNC".to_vec();
    record.extend([schema % 6, 0]);
    record.extend((body.len() as u16).to_le_bytes());
    record.extend(body);
    record.extend(fuzz::crc32(&record).to_le_bytes());
    record
}

fn check(record: &[u8]) {
    let _ = schema(record);
    let Ok(told) = decode(record) else { return };
    assert!(told.check().is_ok());
    let again = encode(&told);
    let same = decode(&again).expect("our own record");
    assert_eq!(format!("{same:?}"), format!("{told:?}")); // NaN is not equal to itself
    let _ = App::new(Config::of(&told)).faults();
}

fuzz_target!(|input: &[u8]| {
    check(input);
    if let [schema, body @ ..] = input {
        check(&framed(*schema, &body[..body.len().min(500)]));
    }
});
