//! The command line of `host-sim-serve`.

use clap::{ArgGroup, Parser};
use host_sim::cli::simulated::{SIMULATED, SimulatedOptions, address};
use std::net::SocketAddr;
use std::path::PathBuf;

/// What a device does, live in the browser.
///
/// A page with rates and forces, estimated errors, rehearsals, faults with their remedies and the
/// track, and with buttons for mode, alignment, store and configuration. The same streams go to
/// Foxglove, Lichtblick and PlotJuggler.
#[derive(Debug, Parser)]
#[command(name = "host-sim serve", version, after_help = EXAMPLES)]
#[command(group(ArgGroup::new("what").required(true).args(["device", "simulate"])))]
pub struct Options {
    /// Port at the device's command link: a serial device (/dev/ttyUSB0, COM3) or tcp:HOST:PORT
    #[arg(long, value_name = "PORT", conflicts_with_all = SIMULATED)]
    pub device: Option<String>,
    /// Bit rate of the command link; sockets ignore it
    #[arg(long, default_value_t = 921_600)]
    pub baud: u32,
    /// File of the device's key: orders of the buttons are sealed with it
    #[arg(long, value_name = "FILE", env = "LRNN_KEY")]
    pub key: Option<PathBuf>,
    /// Port that receives the device's stream to the navigation computer: without it the page has
    /// no rates and forces
    #[arg(long, value_name = "PORT", conflicts_with = "simulate")]
    pub stream: Option<String>,
    /// Port that receives the sensor's frames; without it raw values are corrected ones plus the
    /// correction
    #[arg(long, value_name = "PORT", conflicts_with = "simulate")]
    pub sensor: Option<String>,
    /// A simulated device on a simulated drive, which begins again when it is over
    #[arg(long)]
    pub simulate: bool,
    /// What is simulated.
    #[command(flatten)]
    pub simulated: SimulatedOptions,
    /// Address and port of the page
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        default_value = "127.0.0.1:8210",
        value_parser = address
    )]
    pub listen: SocketAddr,
    /// Another name of this computer by which a browser may ask for the page
    #[arg(long, value_name = "NAME")]
    pub host: Vec<String>,
    /// Have buttons also when other computers can open the page
    #[arg(long)]
    pub orders: bool,
    /// Have no buttons
    #[arg(long, conflicts_with = "orders")]
    pub read_only: bool,
    /// Serve Foxglove's protocol too
    #[arg(long, value_name = "ADDRESS:PORT", num_args = 0..=1, value_parser = address)]
    #[arg(default_missing_value = "127.0.0.1:8765")]
    pub foxglove: Option<SocketAddr>,
    /// Record to a new MCAP file, which is whole when the program is ended with Ctrl-C
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  host-sim serve --simulate --speed 10
  host-sim serve --device /dev/ttyUSB0 --stream /dev/ttyUSB1 --key unit.key
  host-sim serve --device tcp:127.0.0.1:5557 --foxglove --mcap drive.mcap

Ctrl-C ends it. Exit codes: 0 ended, 2 bad input or a port that cannot be had.";

impl Options {
    /// Whether the page has buttons: on this computer unless `--read-only`, beyond it with
    /// `--orders`.
    #[must_use]
    pub fn has_orders(&self) -> bool {
        !self.read_only && (self.orders || self.listen.ip().is_loopback())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn read(text: &str) -> Result<Options, clap::Error> {
        Options::try_parse_from(text.split_whitespace())
    }

    #[test]
    fn the_arguments_fit_together() {
        Options::command().debug_assert();
        assert!(read("serve").is_err());
        assert!(read("serve --simulate --device x").is_err());
        assert!(read("serve --device x --speed 3").is_err());
        assert!(read("serve --simulate --speed 0").is_err());
        assert!(read("serve --simulate --stream x").is_err());
        let foxglove = read("serve --simulate --foxglove").expect("good").foxglove;
        assert_eq!(
            foxglove,
            Some("127.0.0.1:8765".parse().expect("an address"))
        );
    }

    #[test]
    fn buttons_are_for_this_computer() {
        let buttons = |text: &str| read(text).expect("good").has_orders();
        assert!(buttons("serve --simulate"));
        assert!(!buttons("serve --simulate --read-only"));
        assert!(!buttons("serve --simulate --listen 0.0.0.0:80"));
        assert!(buttons("serve --simulate --listen 0.0.0.0:80 --orders"));
    }
}
