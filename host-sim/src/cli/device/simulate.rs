//! `host-sim device --simulate`.

use crate::cli::interrupt::asked;
use crate::cli::simulated::{SimulatedOptions, address};
use crate::cli::stdout;
use clap::Args as ClapArgs;
use host_core::error::Error;
use host_device::hil::simulated::Simulated;
use std::net::SocketAddr;
use std::sync::atomic::Ordering;

/// The simulated device.
#[derive(Debug, ClapArgs)]
#[group(skip)] // `device` has arguments of its own
pub(super) struct Args {
    /// Be a device for practice: the firmware's own application on a simulated drive, with its
    /// command link at a TCP port. Ctrl-C ends it
    #[arg(long, conflicts_with_all = ["port", "baud", "key", "as_json"])]
    pub(super) simulate: bool,
    /// Address and port of its command link; the stream to the navigation computer is at the next
    /// port. Port 0 is any two that are free
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        value_parser = address,
        default_value = "127.0.0.1:5557"
    )]
    listen: SocketAddr,
    #[command(flatten)]
    simulated: SimulatedOptions,
}

impl Args {
    /// Runs the device until Ctrl-C. A failure to print ends it.
    pub(super) fn run(&self) -> Result<(), Error> {
        let stop = asked();
        let simulated = Simulated::new(&self.simulated.simulation(self.listen)?)?;
        let [command, stream] = &simulated.ports;
        let mut say = |line: &str| {
            if stdout::print_now(&format!("{line}\n")).is_err() {
                stop.store(true, Ordering::Relaxed);
            }
        };
        say(&format!(
            "a simulated device runs; Ctrl-C ends it, and what it has learnt is lost\n\
             command link   {command}\n\
             stream         {stream}\n\
             in another terminal:\n  \
             host-sim device --port {command} watch\n  \
             host-sim serve --device {command} --stream {stream}"
        ));
        simulated.run(&stop, &mut say);
        Ok(())
    }
}
