//! Options of a simulated device: of `device --simulate` and of `serve --simulate`.

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use host_core::error::Error;
use host_device::hil::simulated::{Cuts, Simulation};
use host_unit::Unit;
use host_unit::around::Mode;
use std::net::{SocketAddr, ToSocketAddrs};

/// An address to listen at, as a number or a name such as `localhost`, with a port.
///
/// # Errors
/// A sentence on what is wrong.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    let known = text.to_socket_addrs().ok().and_then(|mut all| all.next());
    known.ok_or_else(|| "give an address or a name and a port, such as 127.0.0.1:8210".to_owned())
}

/// The modes by their names.
const MODES: [(&str, Mode); 4] = [
    ("bypass", Mode::Bypass),
    ("frozen", Mode::Frozen),
    ("shadow", Mode::Shadow),
    ("learn", Mode::Learn),
];

/// Names of these options, with which the port of another device conflicts.
pub const SIMULATED: [&str; 7] = [
    "unit",
    "rate",
    "seconds",
    "speed",
    "mode",
    "cut_sensor",
    "cut_receiver",
];

/// What is simulated; for a command with an option `--simulate`.
#[derive(Debug, Args)]
#[group(skip)] // several commands have it
pub struct SimulatedOptions {
    /// Unit of the simulated device: a preset's name (host-sim unit list) or a unit file
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "stim300")]
    unit: String,
    /// Samples a second of the simulated sensor; without it those of the unit
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Length of a simulated drive, s, the first 60 at rest; then the device is switched off and on
    #[arg(long, value_name = "S", default_value_t = 1800)]
    #[arg(value_parser = clap::value_parser!(u32).range(2..=4000))]
    seconds: u32,
    /// Simulated time over real time
    #[arg(long, default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Mode of the simulated device at power-on
    #[arg(long, default_value = "learn", value_parser = mode())]
    mode: Mode,
    /// Second of each drive from which on the sensor's line is cut, to practise that fault
    #[arg(long, value_name = "S")]
    cut_sensor: Option<u32>,
    /// Second of each drive from which on the receiver's line is cut
    #[arg(long, value_name = "S")]
    cut_receiver: Option<u32>,
}

fn speed(text: &str) -> Result<f64, String> {
    let speed: f64 = text.parse().map_err(|_| "give a number".to_owned())?;
    if (0.1..=100.0).contains(&speed) {
        return Ok(speed);
    }
    Err("give a number from 0.1 to 100".into())
}

fn mode() -> impl TypedValueParser<Value = Mode> {
    PossibleValuesParser::new(MODES.map(|(name, _)| name)).try_map(|name| {
        let mode = MODES.into_iter().find(|(known, _)| *known == name);
        mode.map(|(_, mode)| mode).ok_or(name)
    })
}

impl SimulatedOptions {
    /// The simulation, with the command link at this address.
    ///
    /// # Errors
    /// The unit cannot be read.
    pub fn simulation(&self, listen: SocketAddr) -> Result<Simulation, Error> {
        let mut unit = Unit::load(&self.unit)?;
        unit.sensor.rate_hz = self.rate.or(unit.sensor.rate_hz);
        unit.correction.mode = self.mode;
        Ok(Simulation {
            unit,
            seconds: self.seconds,
            speed: self.speed,
            cuts: Cuts {
                sensor_s: self.cut_sensor,
                receiver_s: self.cut_receiver,
            },
            listen,
        })
    }
}
