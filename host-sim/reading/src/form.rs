//! Detects the form of the recording of `--from` by its first bytes.

use crate::options::refused;
use host_core::error::Error;
use host_io::recordings::read::head;
use host_io::recordings::{fog_mems, kitti, lasergyro, ubx};
use std::path::{Path, PathBuf};

/// Number of bytes that identify the form.
const HEAD: usize = 4096;

/// A form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Form {
    /// A device at this port.
    Device(String),
    /// What `replay NAME` takes: the name, and its arguments.
    Replay(&'static str, Vec<String>, Vec<PathBuf>),
    /// A CSV of sensors at rest, as `allan` takes it.
    AtRest(PathBuf),
}

/// The form of the given files or port.
///
/// # Errors
/// There is no such file, or its form is not known.
pub fn of(from: &[PathBuf]) -> Result<Form, Error> {
    let Some(first) = from.first() else {
        return Err(refused("--from", "is empty", "give a recording"));
    };
    let text = first.to_string_lossy();
    let port = text.strip_prefix("device:");
    if let Some(port) = port.or_else(|| text.starts_with("tcp:").then_some(&*text)) {
        return match from {
            [_] => Ok(Form::Device(port.to_owned())),
            _ => Err(refused(
                "--from",
                "has a device and a file",
                "give one of them",
            )),
        };
    }
    if let [first, second] = from {
        return pair(first, second);
    }
    if first.is_dir() {
        return folder(first);
    }
    if text.ends_with(".toml") {
        return Ok(replay("csv", &["--header"], &[first]));
    }
    let head = head(first, HEAD)?;
    let begins = |magic: &[u8]| head.starts_with(magic);
    let text = String::from_utf8_lossy(&head);
    let line = text
        .lines()
        .next()
        .unwrap_or_default()
        .trim_start_matches('\u{feff}');
    Ok(match () {
        () if begins(b"\x89MCAP") => replay("mcap", &[], &[first]),
        () if begins(b"ULog") => replay("ulog", &[], &[first]),
        () if begins(&[0xb5, 0x62]) => replay("ubx", &[], &[first]),
        () if head
            .windows(3)
            .any(|w| matches!(w, [0xaa, 0x44, 0x12 | 0x13])) =>
        {
            replay("novatel", &[], &[first])
        }
        // a receiver's port often has NMEA between the messages
        () if ubx::is_among(&head) => replay("ubx", &[], &[first]),
        () if line == lasergyro::HEADER => replay("lasergyro", &[], &[first]),
        () if line == kitti::HEADER => replay("kitti", &[], &[first]),
        () if line == fog_mems::MEMS_HEADER => {
            let remedy = "give the file of the navigator after it: --from MEMS.csv FOG.csv";
            return Err(refused(
                first.display().to_string(),
                "needs its reference",
                remedy,
            ));
        }
        // the names of the columns may stand below other lines
        () if text
            .lines()
            .any(|l| l.contains([',', ';', '\t']) && l.contains('_')) =>
        {
            Form::AtRest(first.clone())
        }
        () => return Err(unknown(first)),
    })
}

fn unknown(file: &Path) -> Error {
    refused(
        file.display().to_string(),
        "has no form that is known: no MCAP, ULog, UBX or NovAtel log, and no CSV with a header",
        "give the header.toml of a CSV, IMU and fixes of KF-GINS (--from imu.txt gnss.txt), or one \
         of the logs that docs/your-data.md lists",
    )
}

fn replay(name: &'static str, before: &[&str], files: &[&Path]) -> Form {
    let paths = files.iter().map(|file| file.display().to_string());
    let before = before.iter().map(|text| (*text).to_owned());
    Form::Replay(
        name,
        before.chain(paths).collect(),
        files.iter().map(|file| file.to_path_buf()).collect(),
    )
}

/// Two files: KF-GINS text, or the MEMS beside its navigator.
fn pair(first: &Path, second: &Path) -> Result<Form, Error> {
    let head = head(first, HEAD)?;
    let is_fog = head.starts_with(fog_mems::MEMS_HEADER.as_bytes());
    let _ = self::head(second, HEAD)?; // the file must exist
    let name = if is_fog { "fog-mems" } else { "kf-gins" };
    Ok(replay(name, &[], &[first, second]))
}

fn folder(folder: &Path) -> Result<Form, Error> {
    let header = folder.join("header.toml");
    if header.is_file() {
        return Ok(replay("csv", &["--header"], &[&header]));
    }
    if folder.join("metadata.yaml").is_file() {
        return Ok(replay("mcap", &[], &[folder]));
    }
    if folder.join("mav0").is_dir() {
        return Ok(replay("euroc", &[], &[folder]));
    }
    Err(refused(
        folder.display().to_string(),
        "is a folder without header.toml, metadata.yaml (a bag) or mav0 (EuRoC)",
        "give a file, or the folder of such a recording",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(name: &str, bytes: &[u8]) -> Result<Form, String> {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join(name);
        std::fs::write(&file, bytes).unwrap();
        of(&[file]).map_err(|error| error.to_string())
    }

    #[test]
    fn the_first_bytes_tell_the_form() {
        let name = |name, bytes: &[u8]| match form(name, bytes) {
            Ok(Form::Replay(name, ..)) => name,
            Ok(Form::AtRest(_)) => "at rest",
            other => panic!("{other:?}"),
        };
        assert_eq!(name("a", b"\x89MCAP0\r\n"), "mcap");
        assert_eq!(name("a.log", b"ULog\x01\x12\x35\x01"), "ulog");
        assert_eq!(name("a", &[0xb5, 0x62, 1, 7]), "ubx");
        let mixed = b"$GNTXT,01,01,02,u-blox AG*4E\r\n\xb5\x62\x05\x01\x02\x00\x06\x8a\x98\xc1";
        assert_eq!(name("a", mixed), "ubx");
        assert_eq!(name("a", &[0, 0xaa, 0x44, 0x12]), "novatel");
        assert_eq!(name("a.csv", lasergyro::HEADER.as_bytes()), "lasergyro");
        assert_eq!(name("a.csv", kitti::HEADER.as_bytes()), "kitti");
        assert_eq!(name("a.csv", b"t_s,dtheta_x_rad\n0,1\n"), "at rest");
        assert_eq!(name("header.toml", b""), "csv");
    }

    #[test]
    fn what_is_unknown_is_named_with_a_remedy() {
        for bytes in [&b""[..], b"hello", &[0xff; 2000]] {
            let message = form("odd.bin", bytes).unwrap_err();
            assert!(
                message.contains("odd.bin") && message.contains("remedy"),
                "{message}"
            );
        }
        let missing = of(&[PathBuf::from("no/such.mcap")])
            .unwrap_err()
            .to_string();
        assert!(missing.contains("no/such.mcap: no such file"), "{missing}");
    }

    #[test]
    fn a_device_is_a_port() {
        let port = |text: &str| of(&[PathBuf::from(text)]).unwrap();
        assert_eq!(port("device:COM3"), Form::Device("COM3".into()));
        assert_eq!(port("tcp:a:1"), Form::Device("tcp:a:1".into()));
    }
}
