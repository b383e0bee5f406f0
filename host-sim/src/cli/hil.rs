//! `host-sim hil`.

use crate::error::Error;
use crate::hil::{Control, Report, Setup, run};
use crate::output::write_atomic;
use clap::Args as ClapArgs;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use firmware::wire::ImuFormat;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Arguments of `hil`. A port is a serial device (`/dev/ttyUSB0`, `COM3`) or `tcp:HOST:PORT`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    /// Port at the board's sensor line: the drive goes in here
    #[arg(long, value_name = "PORT")]
    imu: String,
    /// Port at the board's navigation line: the stream comes out here
    #[arg(long, value_name = "PORT")]
    nav: String,
    /// Port at the board's receiver line: a fix a second, as UBX
    #[arg(long, value_name = "PORT")]
    gnss: Option<String>,
    /// Port at the board's command link: gives it two networks for the run and sets mode frozen; without it every byte must pass unchanged
    #[arg(long, value_name = "PORT")]
    command: Option<String>,
    /// What the sensor speaks
    #[arg(long, default_value = "stim300", value_parser = format_parser())]
    format: ImuFormat,
    /// Length of the drive, s, of which the first ten are at rest
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(2..=4000))]
    seconds: u32,
    /// Bit rate of sensor, navigation and command line; nothing to a socket
    #[arg(long, default_value_t = 921_600)]
    baud: u32,
    /// Bit rate of the receiver's line
    #[arg(long, default_value_t = 115_200)]
    gnss_baud: u32,
    /// As fast as the lines take it instead of in real time: for sockets, which stop when they are full, serial lines do not
    #[arg(long)]
    fast: bool,
    /// Write the report as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// The formats by their names.
fn format_parser() -> impl TypedValueParser<Value = ImuFormat> {
    let names = ImuFormat::ALL.map(ImuFormat::name);
    PossibleValuesParser::new(names).try_map(|name| ImuFormat::from_name(&name).ok_or(name))
}

impl Args {
    /// Runs, prints and writes; an unequal stream is an error.
    pub(super) fn run(&self) -> Result<(), Error> {
        let setup = Setup {
            imu: self.imu.clone(),
            nav: self.nav.clone(),
            gnss: self.gnss.clone(),
            command: self.command.clone(),
            baud: self.baud,
            gnss_baud: self.gnss_baud,
            format: self.format,
            seconds: self.seconds,
            fast: self.fast,
        };
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        // without a handler an interruption ends the program at once, and the board keeps the networks of the run
        if let Err(error) = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed)) {
            eprintln!("host-sim: an interruption will not restore the board ({error})");
        }
        let bar = ProgressBar::new(0);
        if let Ok(style) =
            ProgressStyle::with_template("{elapsed} {wide_bar} {bytes} of {total_bytes}")
        {
            bar.set_style(style);
        }
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
        if let Some(file) = &self.json {
            let text = serde_json::to_string_pretty(&report).map_err(|error| Error::Option {
                option: "--json".into(),
                problem: error.to_string(),
                remedy: "report it".into(),
            })?;
            write_atomic(file, (text + "\n").as_bytes())?;
        }
        report.check(&self.nav)
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
        None => "bit for bit software in the loop".into(),
        Some(at) => format!(
            "differs from software in the loop, first in byte {at}; {} samples differ",
            verdict.different
        ),
    };
    println!("stream            {equal}");
    println!("counters          {} wrong", verdict.counter_errors);
    println!(
        "damage            {} wrong checksums, {} bytes of no frame",
        verdict.bad_checksums, verdict.garbage_bytes
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
            "frame in to out   {:.2} ms median, {:.2} to {:.2} ms, 99 % under {:.2} ms (host clock, ports and system included)",
            latency.median_ms, latency.min_ms, latency.max_ms, latency.p99_ms
        );
    }
    if let Some(silences) = report.silences.filter(|silences| *silences > 0) {
        println!(
            "silences          {silences}: this computer was late, and the networks gave up the block"
        );
    }
    if let Some(busiest) = report.busiest_percent {
        println!(
            "processor         {busiest:.1} % of its busiest second since power-on, the rest asleep"
        );
    }
    if let Some(fixes) = report.fixes {
        println!("fixes             {fixes} taken");
    }
    if report.interrupted {
        println!("interrupted; judged is what was sent");
    }
}
