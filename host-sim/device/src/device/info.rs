//! Description and configuration of a device.

use super::configure::configuration;
use super::link::Link;
use super::mode_name;
use super::receiver::{Antenna, Receiver, receiver};
use super::reset::{Start, start};
use super::times::Times;
use super::update::{perhaps, version};
use super::watch::Learner;
use firmware::configuration::{Configuration, Sensor};
use firmware::control::update::{Report, Running, Step};
use firmware::update::DEVELOPMENT_KEY;
use firmware::wire::command::{self, Protection, Remembered, Request, Response, Security};
use host_core::error::Error;
use serde::Serialize;

/// Description and configuration of a device.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    /// Version of the firmware.
    pub firmware: String,
    /// Version of the command link.
    pub link: u16,
    /// Version of the weight image.
    pub image: u16,
    /// Schema of the configurations that it accepts.
    pub schema: u16,
    /// Name of the board.
    pub board: String,
    /// Sets of pins that the board has.
    pub pin_sets: u8,
    /// Whether the board can store configuration and weights.
    pub stores: bool,
    /// Whether the device has a configuration.
    pub configured: bool,
    /// Whether the configuration in use is the stored one.
    pub stored: bool,
    /// Mode in force.
    pub mode: &'static str,
    /// Name of the unit, if it is configured.
    pub name: Option<String>,
    /// Serial number of the sensor, if it is configured.
    pub serial: Option<String>,
    /// Configured format of the sensor's frames; `None` also where the device detects it.
    pub format: Option<&'static str>,
    /// Configured sample rate, which counts where the frames state none, Hz.
    pub rate_hz: Option<f64>,
    /// Mode at power-on.
    pub mode_at_start: Option<&'static str>,
    /// Most metres that corrections within their limits can add to a free-inertial position 5, 10,
    /// 15, 20 and 22 min after an alignment; 0 without a configuration.
    pub error_bound_m: [u32; 5],
    /// The sensor's, the navigation computer's and the receiver's line.
    pub lines: [LineInfo; 3],
    /// What the device receives from its receiver.
    pub receiver: Receiver,
    /// Lever arm and delay of the fixes; `None` on a board without a learner.
    pub antenna: Option<Antenna>,
    /// The receiver's time of the samples.
    pub times: Times,
    /// The learner and its alignment.
    pub learner: Learner,
    /// Memory of the unit from earlier drives.
    pub memory: Memory,
    /// Why and how the board started; `None` if the board does not report it.
    pub start: Option<Start>,
    /// State of its store at the start.
    pub store: StoreState,
    /// Protection of the device against changes.
    pub security: Protected,
    /// State of the updates of its firmware; `None`: the board takes none over the command link.
    pub updates: Option<Updates>,
}

/// State of the updates of a device's firmware.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Updates {
    /// `flashed` by a probe, an update `on trial`, or one that was `confirmed`.
    pub running: &'static str,
    /// Address of the free slot.
    pub slot: u32,
    /// `development`, or the first digits of the public key that updates must be signed for.
    pub signer: String,
    /// Bytes of an update received; `None`: none was begun since start.
    pub received: Option<u32>,
    /// An update is whole, and the next start tries it.
    pub ready: bool,
    /// Version of an update that was tried and has not proved itself.
    pub failed: Option<String>,
}

impl From<Report> for Updates {
    fn from(of: Report) -> Self {
        Self {
            running: match of.running {
                Running::Flashed => "flashed",
                Running::Trial => "on trial",
                Running::Confirmed => "confirmed",
            },
            slot: of.slot,
            signer: match of.signer.to_be_bytes() {
                first if DEVELOPMENT_KEY.starts_with(&first) => "development".into(),
                first => format!("{:016x}", u64::from_be_bytes(first)),
            },
            received: (of.step != Step::Idle).then_some(of.received),
            ready: of.step == Step::Ready,
            failed: of.failed.map(version),
        }
    }
}

/// State of a device's store at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StoreState {
    /// Number of the record in use, if there is one.
    pub record: Option<u32>,
    /// Number of starts in the device's life, as of that record.
    pub starts: u32,
    /// Number of these starts that followed a failure.
    pub failures: u32,
    /// Total running time, h.
    pub hours: f64,
    /// Times each slot of the flash was erased.
    pub erased: [u32; 2],
    /// Whether a newer record is damaged and was not used.
    pub damaged: bool,
    /// Newer records that were skipped, because the device had failed with them.
    pub passed: u8,
}

impl From<command::StoreReport> for StoreState {
    fn from(of: command::StoreReport) -> Self {
        Self {
            record: of.generation,
            starts: of.starts,
            failures: of.failures,
            hours: f64::from(of.minutes) / 60.0,
            erased: of.erased,
            damaged: of.damaged,
            passed: of.passed,
        }
    }
}

/// Protection of a device against changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Protected {
    /// `keyed`, `open by choice` or `not provisioned`.
    pub state: &'static str,
    /// Whether the board makes random challenges.
    pub random: bool,
    /// Sealed requests refused since power-on because of another key or a forgery.
    pub forged: u32,
    /// Number of records that may be stored now in succession.
    pub stores: u16,
}

impl From<Security> for Protected {
    fn from(of: Security) -> Self {
        Self {
            state: match of.protection {
                Protection::Unprovisioned => "not provisioned",
                Protection::OpenByChoice => "open by choice",
                Protection::Keyed => "keyed",
            },
            random: of.random,
            forged: of.forged,
            stores: of.stores,
        }
    }
}

/// Memory of a device from earlier drives of its unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Memory {
    /// Number of drives that were learnt from; 0: nothing is remembered.
    pub drives: u16,
    /// Time learnt in them, h.
    pub hours: f64,
    /// Lowest and highest temperature of the sensor in these drives, degrees C, if they are known.
    pub temperatures_degc: Option<[i16; 2]>,
    /// Whether stored networks correct the samples of this drive.
    pub acts: bool,
    /// Whether the stored networks are of another sensor, or have other inputs, and are not used.
    pub of_another: bool,
}

impl From<Remembered> for Memory {
    fn from(of: Remembered) -> Self {
        Self {
            drives: of.drives,
            hours: f64::from(of.minutes) / 60.0,
            temperatures_degc: of.temperatures,
            acts: of.acts,
            of_another: of.of_another,
        }
    }
}

/// A line's bit rate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LineInfo {
    /// Which line.
    pub line: &'static str,
    /// Clock of its UART, Hz, if it is known.
    pub clock_hz: Option<u32>,
    /// Configured bit rate, bit/s; `None` without a configuration.
    pub configured: Option<u32>,
    /// Actual bit rate, bit/s, if it is known.
    pub bit_rate: Option<u32>,
    /// Error of the actual bit rate relative to the configured one, %.
    pub error_percent: Option<f64>,
}

/// The board's answer, with an owned name.
pub(super) struct Board {
    pub name: String,
    uart_clocks: [u32; 3],
    bauds: [u32; 3],
    pin_sets: u8,
    pub stores: bool,
    pub schema: u16,
    pub configured: bool,
    pub stored: bool,
}

/// Reads the board's description.
pub(super) fn board(link: &mut Link) -> Result<Board, Error> {
    link.ask(&Request::GetBoard, |answer| match answer {
        Response::Board(board) => Some(Board {
            name: board.name.to_owned(),
            uart_clocks: board.uart_clocks,
            bauds: board.bauds,
            pin_sets: board.pin_sets,
            stores: board.stores,
            schema: board.schema,
            configured: board.configured,
            stored: board.stored,
        }),
        _ => None,
    })
}

/// Asks a device what it is and how it is configured.
///
/// # Errors
/// As [`Link::ask`], or the device has another version of the link.
pub fn info(link: &mut Link) -> Result<Info, Error> {
    let versions = link.version()?;
    let board = board(link)?;
    let configuration = configuration(link)?;
    let health = link.health()?;
    let receiver = receiver(link, configuration.as_ref())?;
    let antenna = link.antenna()?.map(Antenna::from);
    let bauds = configuration.as_ref().map(|configuration| {
        let lines = configuration.lines;
        [lines.sensor_baud, lines.sensor_baud, lines.receiver_baud]
    });
    let line = |at: usize, line| {
        LineInfo::new(
            line,
            board.uart_clocks[at],
            bauds.map(|b| b[at]),
            board.bauds[at],
        )
    };
    let lines = [
        line(0, "sensor"),
        line(1, "navigation"),
        line(2, "receiver"),
    ];
    let identity = configuration.as_ref().map(|of| &of.identity);
    Ok(Info {
        firmware: version(versions.firmware),
        link: versions.wire,
        image: versions.image,
        schema: board.schema,
        lines,
        board: board.name,
        pin_sets: board.pin_sets,
        stores: board.stores,
        configured: board.configured,
        stored: board.stored,
        mode: mode_name(health.mode),
        error_bound_m: health.error_bound_m,
        receiver,
        antenna,
        times: link.times()?,
        learner: Learner::from(&health),
        memory: link.remembered()?.into(),
        store: link.store_report()?.into(),
        start: start(link)?,
        security: link.security()?.into(),
        updates: perhaps(link)?.map(Updates::from),
        name: identity.map(|identity| identity.name.to_string()),
        serial: identity.map(|identity| identity.serial.to_string()),
        format: configuration.as_ref().and_then(format),
        rate_hz: configuration.as_ref().map(|of| of.rate),
        mode_at_start: configuration
            .as_ref()
            .map(|of| mode_name(of.correction.mode)),
    })
}

/// Name of the configured format.
fn format(configuration: &Configuration) -> Option<&'static str> {
    match configuration.sensor.as_ref()? {
        Sensor::Stream(settings) => Some(settings.format().name()),
        Sensor::Spi(_) => Some("adis-spi"),
    }
}

impl LineInfo {
    /// `clock` in Hz and `bit_rate` in bit/s; 0 stands for a value that the board does not know.
    fn new(line: &'static str, clock: u32, configured: Option<u32>, bit_rate: u32) -> Self {
        let known = |value: u32| (value > 0).then_some(value);
        let bit_rate = known(bit_rate);
        let error =
            |(nominal, actual): (u32, u32)| (f64::from(actual) / f64::from(nominal) - 1.0) * 100.0;
        Self {
            line,
            clock_hz: known(clock),
            configured,
            bit_rate,
            error_percent: configured.zip(bit_rate).map(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 84 MHz / 45 = 1 866 667 bit/s, 1.27 % above the 1 843 200 bit/s of a STIM300.
    #[test]
    fn the_error_of_a_bit_rate_is_in_per_cent_of_the_configured_one() {
        let line = LineInfo::new("sensor", 84_000_000, Some(1_843_200), 1_866_667);
        assert!((line.error_percent.unwrap() - 1.2731).abs() < 1e-4);
        let line = LineInfo::new("sensor", 0, Some(1_843_200), 0);
        assert_eq!((line.clock_hz, line.error_percent), (None, None));
    }
}
