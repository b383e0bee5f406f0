//! Simulated drives (`host_device::hil::drive`), converted to recordings for the images.

use anyhow::{Context, Result, ensure};
use firmware::configuration::Configuration;
use firmware::wire::ImuFormat;
use host_core::inertial::session::Session;
use host_core::simulator::imu::ImuSpec;
use host_device::hil as simulated;

use crate::replay::{Input, LONGEST, Pace};

/// A piece of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Input at which its bytes arrive.
    pub input: Input,
    /// Time of arrival, microseconds from the start.
    pub at_us: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Simulates `seconds` of `format`.
///
/// # Errors
/// A sample does not fit into its field.
pub fn drive(format: ImuFormat, seconds: u32) -> Result<Vec<Record>> {
    Ok(records(simulated::drive(format, seconds)?.records))
}

/// The sensor's frames of a drive.
///
/// # Panics
/// A sample does not fit into its field.
#[must_use]
pub fn frames(format: ImuFormat, seconds: u32) -> Vec<Record> {
    let records = drive(format, seconds).expect("a drive").into_iter();
    records
        .filter(|record| record.input == Input::Sensor)
        .collect()
}

/// Hexadecimal, as the models of the chips read bytes.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The bytes of [`hex`].
///
/// # Errors
/// Something else than pairs of digits.
pub fn unhex(digits: &str) -> Result<Vec<u8>> {
    let pairs = digits.as_bytes().chunks(2);
    let byte = |pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    let bytes = pairs.map(byte).collect::<Option<_>>();
    bytes.with_context(|| format!("`{digits}` is not hexadecimal"))
}

/// As [`drive`], after `standstill_s` seconds at rest. Also returns the simulated session.
///
/// # Errors
/// A sample does not fit into its field.
pub fn drive_from(
    format: ImuFormat,
    seconds: u32,
    standstill_s: u32,
) -> Result<(Session, Vec<Record>)> {
    let drive = simulated::drive_from(format, seconds, standstill_s)?;
    Ok((drive.session, records(drive.records)))
}

/// A drive for a device with this configuration. `seconds`: its length, and how much of it is at
/// rest.
///
/// # Errors
/// The sensor cannot be simulated at this rate, or a sample does not fit into its field.
pub fn drive_configured(
    configuration: &Configuration,
    format: ImuFormat,
    seconds: [u32; 2],
) -> Result<Vec<Record>> {
    let medium = ImuSpec::preset("medium").context("no preset medium")?;
    let drive = simulated::drive_configured(configuration, format, &medium, seconds)?;
    Ok(records(drive.records))
}

fn records(simulated: Vec<simulated::Record>) -> Vec<Record> {
    let record = |record: simulated::Record| Record {
        input: match record.input {
            simulated::Input::Sensor => Input::Sensor,
            simulated::Input::Gnss => Input::Gnss,
        },
        at_us: record.at_us,
        bytes: record.bytes,
    };
    simulated.into_iter().map(record).collect()
}

/// A recording for the `replay` image at pace [`Pace::Time`], of a device that learns and is
/// configured for this sensor: the arguments of [`configured`](crate::replay::configured).
///
/// # Errors
/// As [`recording`].
pub fn timed_recording(
    (format, variant, rate): (ImuFormat, u8, u16),
    records: &[Record],
) -> Result<Vec<u8>> {
    let mut file = recording(format, Pace::Time, true, records)?;
    let [low, high] = rate.to_le_bytes();
    file.splice(3..3, [variant, low, high]);
    Ok(file)
}

/// A recording for the `replay` image.
///
/// # Errors
/// A format without a number, or a record too long for one.
pub fn recording(
    format: ImuFormat,
    pace: Pace,
    learns: bool,
    records: &[Record],
) -> Result<Vec<u8>> {
    let number = ImuFormat::ALL.iter().position(|known| *known == format);
    let number = number.with_context(|| format!("no recordings of {format:?}"))?;
    let mut file = vec![number as u8, pace as u8, u8::from(learns)];
    for record in records {
        ensure!(record.bytes.len() <= LONGEST, "a record is too long");
        file.push(record.input as u8);
        file.extend_from_slice(&(record.bytes.len() as u16).to_le_bytes());
        file.extend_from_slice(&record.at_us.to_le_bytes());
        file.extend_from_slice(&record.bytes);
    }
    Ok(file)
}
