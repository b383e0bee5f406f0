//! The recorded laser-gyro IMU: a header line, then six integer pulse counts every 10 ms.
//!
//! The recording is `data/lasergyro.imu` of asenlinmu/psins in CSV form. Its licence keeps it out
//! of this repository.

use super::table::{Cell, Table};
use host_core::error::Error;
use std::path::Path;

/// The header line: the columns in their order.
pub const HEADER: &str =
    "gyro_x_pulses,gyro_y_pulses,gyro_z_pulses,accel_x_pulses,accel_y_pulses,accel_z_pulses";
/// Sample rate, Hz.
pub const RATE_HZ: f64 = 100.0;
/// One gyro pulse, 0.1 arcsec, in rad.
pub const GYRO_LSB_RAD: f64 = 0.1 / 3600.0 * std::f64::consts::PI / 180.0;
/// One accelerometer pulse, 125 ug s, in m/s. The recording counts in g = 9.780327 m/s2, normal
/// gravity on the equator.
pub const ACCEL_LSB_MPS: f64 = 125e-6 * 9.780_327;

/// A recording in pulses, in the axes of the file: right, forward, up. It has no gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Samples per second.
    pub rate_hz: f64,
    /// Rotation of one gyro pulse, rad.
    pub gyro_lsb_rad: f64,
    /// Velocity increment of one accelerometer pulse, m/s.
    pub accel_lsb_mps: f64,
    /// Pulses of each sample: gyro x, y, z, then accelerometer x, y, z.
    pub pulses: Vec<[i32; 6]>,
}

/// Reads a recording, plain or gzipped.
///
/// # Errors
/// Any fault of the file, with line and column; see the variants of [`Error`].
pub fn load(file: &Path) -> Result<Recording, Error> {
    let table = Table::<i32>::with_header(file, HEADER)?;
    let sample = |row: &[i32]| std::array::from_fn(|column| row[column]);
    Ok(Recording {
        rate_hz: RATE_HZ,
        gyro_lsb_rad: GYRO_LSB_RAD,
        accel_lsb_mps: ACCEL_LSB_MPS,
        pulses: table.rows().map(sample).collect(),
    })
}

impl Cell for i32 {
    const REMEDY: &str = "give whole pulses, at most 2147483647 either way";

    fn parse(text: &str) -> Result<Self, &'static str> {
        text.parse().map_err(|_| fault(text))
    }
}

/// Description of a `text` that is not a number of pulses.
fn fault(text: &str) -> &'static str {
    let digits = text.trim_start_matches(['+', '-']);
    match text.parse::<f64>() {
        Ok(number) if !number.is_finite() && !digits.starts_with(|c: char| c.is_ascii_digit()) => {
            "not finite"
        }
        Ok(_) if digits.bytes().all(|byte| byte.is_ascii_digit()) => "out of range",
        Ok(_) => "not an integer",
        Err(_) if text.is_empty() => "missing",
        Err(_) => "not a number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;
    use test_bench::recordings::recorded;

    const GOOD: &str = "1,-2,3,4,5,80\n0,0,2147483647,-2147483648,0,80\n";

    fn with_header(rows: &str) -> Vec<u8> {
        format!("{HEADER}\n{rows}").into_bytes()
    }

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn load_bytes(bytes: &[u8]) -> Result<Recording, Error> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("imu.csv");
        std::fs::write(&file, bytes).unwrap();
        load(&file)
    }

    /// The message that `bytes` gives, from the file's name on.
    fn complaint(bytes: &[u8]) -> String {
        let message = load_bytes(bytes).unwrap_err().to_string();
        assert!(message.contains("; remedy: "), "{message}");
        message[message.find("imu.csv").unwrap()..].to_owned()
    }

    #[test]
    fn plain_gzip_and_windows_files_read_alike() {
        let pulses = vec![[1, -2, 3, 4, 5, 80], [0, 0, i32::MAX, i32::MIN, 0, 80]];
        let plain = with_header(GOOD);
        let windows = String::from_utf8(plain.clone())
            .unwrap()
            .replace('\n', "\r\n");
        let marked = [b"\xef\xbb\xbf", plain.as_slice()].concat();
        let unended = &plain[..plain.len() - 1];
        for bytes in [&plain, &gzip(&plain), windows.as_bytes(), &marked, unended] {
            assert_eq!(load_bytes(bytes).unwrap().pulses, pulses);
        }
        let two_members = [
            gzip(&with_header("1,-2,3,4,5,80\n")),
            gzip(b"0,0,2147483647,-2147483648,0,80\n"),
        ]
        .concat();
        assert_eq!(load_bytes(&two_members).unwrap().pulses, pulses);
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = load(Path::new("no/such/imu.csv.gz"))
            .unwrap_err()
            .to_string();
        assert!(
            message.starts_with("no/such/imu.csv.gz: no such file; remedy: "),
            "{message}"
        );
        assert!(matches!(load(Path::new("/")), Err(Error::Folder { .. })));
    }

    #[test]
    fn empty_files_say_what_is_expected() {
        for bytes in [b"".as_slice(), b"\n", b"  \r\n", &gzip(b"")] {
            let message = complaint(bytes);
            assert!(
                message.starts_with("imu.csv: is empty; remedy: ") && message.contains(HEADER),
                "{message}"
            );
        }
        assert!(complaint(&with_header("")).starts_with("imu.csv: has a header and no data"));
    }

    #[test]
    fn a_wrong_header_shows_both() {
        let message = complaint(b"t,x,y\n1,2,3\n");
        assert!(
            message.starts_with("imu.csv:1: header is 't,x,y'; remedy: ")
                && message.ends_with(&format!("'{HEADER}'"))
        );
        assert!(complaint(GOOD.as_bytes()).starts_with("imu.csv:1: header is '1,-2,3,4,5,80'"));
        let binary = complaint(&[0x89, b'P', 0, 0xff, 0xfe]);
        assert!(binary.starts_with("imu.csv: is not text"), "{binary}");
    }

    #[test]
    fn wrong_column_counts_name_the_line() {
        for (row, found) in [
            ("1,2,3,4,5\n", 5),
            ("1,2,3,4,5,6,7\n", 7),
            ("\n1,2,3,4,5,6\n", 0),
            ("7\n", 1),
        ] {
            let message = complaint(&with_header(&format!("0,0,0,0,0,80\n{row}")));
            assert!(
                message.starts_with(&format!("imu.csv:3: {found} columns instead of 6")),
                "{message}"
            );
        }
    }

    #[test]
    fn bad_pulses_name_line_column_and_fault() {
        let cases = [
            ("0.5", "not an integer"),
            ("1e3", "not an integer"),
            ("NaN", "not finite"),
            ("-inf", "not finite"),
            ("abc", "not a number"),
            ("", "missing"),
            ("2147483648", "out of range"),
            ("-99999999999999999999", "out of range"),
        ];
        for (text, fault) in cases {
            let message = complaint(&with_header(&format!("0,0,0,0,0,80\n0,0,0,0,{text},80\n")));
            let expected = format!(
                "imu.csv:3: column 'accel_y_pulses': '{text}' is {fault}; remedy: give whole pulses"
            );
            assert!(message.starts_with(&expected), "{message}");
        }
        assert!(
            complaint(&[with_header("0,0,"), b"\xff,0,0,0".to_vec()].concat())
                .contains("column 'gyro_z_pulses'")
        );
    }

    #[test]
    fn broken_gzip_says_how_far_it_came() {
        let rows: String = (0..5000)
            .map(|i| format!("{},{},0,0,0,80\n", i * 7919 % 1009, i * 104_729 % 997))
            .collect();
        let whole = gzip(&with_header(&rows));
        let cut = complaint(&whole[..whole.len() / 2]);
        assert!(
            cut.contains(": the compressed data end after ") && cut.contains("; remedy: "),
            "{cut}"
        );
        let (_, line) = cut.split_once("behind line ").unwrap();
        let line: usize = line.split(';').next().unwrap().parse().unwrap();
        assert!((1000..4500).contains(&line), "{cut}");
        assert!(
            complaint(&whole[..whole.len() - 4]).contains("data end after"),
            "check sum missing"
        );
        let mut damaged = whole.clone();
        let at = damaged.len() - 6;
        damaged[at] ^= 0x55;
        assert!(
            complaint(&damaged).contains("the compressed data are damaged after"),
            "check sum wrong"
        );
        assert!(complaint(&whole[..2]).contains("the compressed data end after 0 unpacked bytes;"));
    }

    #[test]
    fn the_real_recording_has_the_documented_length_and_gravity() {
        let Some(file) = recorded("lasergyro-static.csv.gz") else {
            return;
        };
        let recording = load(&file).unwrap();
        assert_eq!(recording.pulses.len(), 184_718);
        assert_eq!(recording.pulses[0], [0, 0, 2, 0, 0, 80]);
        let mut mean = [0.0; 3];
        for sample in &recording.pulses {
            for axis in 0..3 {
                mean[axis] += f64::from(sample[3 + axis]) * ACCEL_LSB_MPS * RATE_HZ
                    / recording.pulses.len() as f64;
            }
        }
        let magnitude = mean.iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!(
            (magnitude - 9.79548).abs() < 2e-4,
            "mean |f| {magnitude} m/s2"
        );
    }
}
