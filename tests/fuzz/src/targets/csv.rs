//! Any header and any table as a recording in CSV, divided by a zero byte. The header may name no
//! file outside its folder.

use host_io::recordings::generic;

/// Whether a header may name a file in another folder: a slash that is not part of a unit, or an
/// escape.
fn names_folders(header: &[u8]) -> bool {
    let text = String::from_utf8_lossy(header);
    let units = ["rad/s", "deg/s", "deg/h", "km/h", "m/s"];
    let left = units
        .iter()
        .fold(text.into_owned(), |text, unit| text.replace(unit, " "));
    left.contains(['/', '\\'])
}

/// Whether the recording was read.
pub fn run(input: &[u8]) -> bool {
    let (header, table) = crate::halves(input);
    if names_folders(header) {
        return false;
    }
    let table = crate::file("imu.csv", table);
    let header = crate::file("header.toml", header);
    match generic::read(&header, &[table]) {
        Ok(record) => {
            crate::finite(&record);
            let _ = record.session();
            true
        }
        Err(error) => crate::refused(&error),
    }
}
