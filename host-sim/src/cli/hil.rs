//! `host-sim hil`.

use super::interrupt::asked;
use super::options::{UnitOption, refused};
use super::output::JsonOption;
use super::progress::bar;
use clap::Args as ClapArgs;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use firmware::configuration::Configuration;
use firmware::wire::ImuFormat;
use host_core::error::Error;
use host_core::words::{agrees, counted};
use host_device::device::read_key;
use host_device::hil::{Control, Report, Setup, run};
use host_unit::Unit;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Arguments of `hil`. A port is a serial device (`/dev/ttyUSB0`, `COM3`) or `tcp:HOST:PORT`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Port at the board's sensor line, into which the drive is sent
    #[arg(long, value_name = "PORT")]
    imu: String,
    /// Port at the board's navigation line, which gives the corrected stream
    #[arg(long, value_name = "PORT")]
    nav: String,
    /// Port at the board's receiver line, into which one fix a second is sent as UBX
    #[arg(long, value_name = "PORT")]
    gnss: Option<String>,
    /// Port at the board's command link: the run loads two networks and sets the mode frozen.
    /// Without this port every byte must pass unchanged
    #[arg(long, value_name = "PORT")]
    command: Option<String>,
    /// File of the board's key, if it has one
    #[arg(long, value_name = "FILE", env = "LRNN_KEY")]
    key: Option<PathBuf>,
    #[command(flatten)]
    unit: UnitOption,
    /// Wire format of the sensor without --unit, or where the unit leaves it open
    #[arg(long, default_value = "stim300", value_parser = format_parser())]
    format: ImuFormat,
    /// Length of the drive, s; the first ten seconds are at rest
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=4000))]
    seconds: u32,
    /// Bit rate of the command link, and of the sensor and navigation lines without --unit; sockets
    /// ignore it
    #[arg(long, default_value_t = 921_600)]
    baud: u32,
    /// Bit rate of the receiver's line without --unit
    #[arg(long, default_value_t = 115_200)]
    gnss_baud: u32,
    /// As fast as the lines take it instead of in real time. For sockets only: a full serial line
    /// loses bytes
    #[arg(long)]
    fast: bool,
    #[command(flatten)]
    json: JsonOption,
}

/// The formats by their names.
fn format_parser() -> impl TypedValueParser<Value = ImuFormat> {
    let names = ImuFormat::ALL.map(ImuFormat::name);
    PossibleValuesParser::new(names).try_map(|name| ImuFormat::from_name(&name).ok_or(name))
}

impl Args {
    /// Configuration of the board: the unit's, or the default, with which the board detects the
    /// format.
    fn configuration(&self, unit: Option<&Unit>) -> Result<Configuration, Error> {
        if let Some(unit) = unit {
            let configuration = unit.configuration();
            return configuration
                .map_err(|f| refused(format!("--unit: {}", f.key), f.problem, f.remedy));
        }
        let mut configuration = Configuration::default();
        configuration.lines.sensor_baud = self.baud;
        configuration.lines.receiver_baud = self.gnss_baud;
        Ok(configuration)
    }

    /// Runs, prints the report and writes it; a stream that differs is an error.
    pub(super) fn run(&self) -> Result<(), Error> {
        let unit = self.unit.load()?;
        let format = unit.as_ref().and_then(|unit| unit.sensor.imu_format());
        let setup = Setup {
            imu: self.imu.clone(),
            nav: self.nav.clone(),
            gnss: self.gnss.clone(),
            command: self.command.clone(),
            key: self.key.as_deref().map(read_key).transpose()?,
            baud: self.baud,
            configuration: self.configuration(unit.as_ref())?,
            format: format.unwrap_or(self.format),
            errors: unit.as_ref().map(Unit::simulated),
            seconds: self.seconds,
            fast: self.fast,
        };
        // on Ctrl-C the run restores the networks that the board had before
        let stop = asked();
        let bar = bar(
            0,
            "{elapsed} {wide_bar} {bytes} of {total_bytes}, {eta} left",
        );
        let progress = |came: usize, of: usize| {
            bar.set_length(of as u64);
            bar.set_position(came as u64);
        };
        let control = Control {
            stop: &stop,
            progress: &progress,
        };
        let found = run(&setup, control);
        bar.finish_and_clear();
        let report = found?;
        print(&report);
        let text = serde_json::to_string_pretty(&report)
            .map_err(|error| refused("--json", error.to_string(), "report it"))?;
        self.json.write_text(&(text + "\n"))?;
        report.check(&self.nav)?;
        if stop.load(Ordering::Relaxed) {
            let text = "the board has its networks again; what was sent until then is equal";
            return Err(Error::Interrupted(text.into()));
        }
        Ok(())
    }
}

fn print(report: &Report) {
    let verdict = &report.verdict;
    if let Some(firmware) = &report.firmware {
        println!("firmware          {firmware}");
    }
    let corrected = if report.corrected {
        "two frozen networks"
    } else {
        "none: no --command"
    };
    println!("correction        {corrected}");
    println!(
        "samples           {} of {}",
        verdict.received, verdict.expected
    );
    let equal = match verdict.first_difference {
        None => "equal to software in the loop, bit for bit".into(),
        Some(at) => format!(
            "differs from software in the loop, first in byte {at}; {} {}",
            counted(verdict.different, "sample"),
            agrees(verdict.different, "differs", "differ")
        ),
    };
    println!("stream            {equal}");
    println!("counters          {} wrong", verdict.counter_errors);
    println!(
        "damage            {}, {} of no frame",
        counted(verdict.bad_checksums, "wrong checksum"),
        counted(verdict.garbage_bytes, "byte")
    );
    println!(
        "free inertial     {:.3} m off the truth at the end, software in the loop {:.3} m{}",
        verdict.stream_error_m,
        verdict.software_error_m,
        if verdict.navigation_equal {
            ", the same to the last bit"
        } else {
            ""
        }
    );
    if let Some(latency) = &report.latency {
        println!(
            "frame in to out   {:.2} ms median, {:.2} to {:.2} ms, 99 % under {:.2} ms \
             (host clock, ports and system included)",
            latency.median_ms, latency.min_ms, latency.max_ms, latency.p99_ms
        );
    }
    if let Some(silences) = report.silences.filter(|silences| *silences > 0) {
        println!(
            "silences          {silences}: this computer was late, so the networks dropped \
             the block"
        );
    }
    if let Some(busiest) = report.busiest_percent {
        println!("processor         busy for {busiest:.1} % of its busiest second since power-on");
    }
    if let Some(fixes) = report.fixes {
        println!("fixes             {fixes} received");
    }
    if report.stays_configured {
        println!(
            "configuration     the board had none; it keeps that of the run until it is switched off"
        );
    }
    if report.interrupted {
        println!("interrupted; only the part that was sent is judged");
    }
}
