//! Any bytes as a configuration record of any schema, also with a right frame around them: an
//! accepted record is in range, and an application starts with it.

use firmware::app::{App, Config};
use firmware::configuration::record::{decode, encode, schema};

fn framed(schema: u8, body: &[u8]) -> Vec<u8> {
    let mut record = b"LRNC".to_vec();
    record.extend([schema % 6, 0]);
    record.extend((body.len() as u16).to_le_bytes());
    record.extend(body);
    record.extend(crate::crc32(&record).to_le_bytes());
    record
}

fn check(record: &[u8]) -> bool {
    let _ = schema(record);
    let Ok(configuration) = decode(record) else {
        return false;
    };
    assert!(configuration.check().is_ok());
    let again = encode(&configuration);
    let same = decode(&again).expect("our own record");
    assert_eq!(format!("{same:?}"), format!("{configuration:?}")); // NaN is not equal to itself
    let _ = App::new(Config::of(&configuration)).faults();
    true
}

/// Whether a record was accepted.
pub fn run(input: &[u8]) -> bool {
    let plain = check(input);
    let [schema, body @ ..] = input else {
        return plain;
    };
    plain | check(&framed(*schema, &body[..body.len().min(500)]))
}
