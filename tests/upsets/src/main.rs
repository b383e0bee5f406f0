//! `cargo run --release -p upsets`: flips bits and prints the verdicts.

use anyhow::Result;
use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use comfy_table::Table;
use host_sim::cli::stdout;
use indicatif::ProgressBar;
use std::process::ExitCode;
use upsets::child::{self, Second, Trials};
use upsets::device::Scenario;
use upsets::judge::Verdict;
use upsets::parent;

/// Flips bits of a device's memory, one or two at a time, and judges what leaves it.
#[derive(Parser)]
struct Arguments {
    /// Every so manyth bit; 1: all.
    #[arg(long, default_value_t = 97)]
    every: usize,
    /// Seconds after each flip.
    #[arg(long, default_value_t = 6)]
    seconds: u32,
    /// Two bits at a time: each with its neighbour, or with any other one.
    #[arg(long)]
    second: Option<Second>,
    /// What the device does; all three without.
    #[arg(long)]
    scenario: Option<Scenario>,
    /// Names the bits that ended so: same, recovered, bounded, raw, lost, silent, fault, hang,
    /// check, beyond or forged.
    #[arg(long)]
    list: Vec<String>,
    #[command(subcommand)]
    task: Option<Task>,
}

#[derive(Subcommand)]
enum Task {
    /// The trials themselves, in this process.
    #[command(hide = true)]
    Child {
        scenario: Scenario,
        seconds: u32,
        from: usize,
        every: usize,
        second: Option<Second>,
    },
}

fn main() -> ExitCode {
    let Some(arguments) = stdout::given::<Arguments>(Arguments::command()) else {
        return stdout::ended("upsets", Ok(()));
    };
    match run(&arguments) {
        Ok(()) => stdout::ended("upsets", Ok(())),
        Err(error) => {
            eprintln!("Error: {error:?}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<()> {
    if let Some(Task::Child {
        scenario,
        seconds,
        from,
        every,
        second,
    }) = &arguments.task
    {
        return child::run(Trials {
            scenario: *scenario,
            seconds: *seconds,
            from: *from,
            every: *every,
            second: *second,
        });
    }
    let scenarios = arguments
        .scenario
        .map_or(Scenario::value_variants().to_vec(), |s| vec![s]);
    let mut table = Table::new();
    let mut head = vec![
        "mode".to_owned(),
        "memory".into(),
        "bits".into(),
        "tried".into(),
    ];
    head.extend(Verdict::ALL.map(|verdict| format!("{verdict:?}").to_lowercase()));
    table.set_header(head);
    let program = std::env::current_exe()?;
    for scenario in scenarios {
        let bar = ProgressBar::new(0);
        let trials = Trials {
            scenario,
            seconds: arguments.seconds,
            from: 0,
            every: arguments.every,
            second: arguments.second,
        };
        let found = parent::run(&program, trials, |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        for (number, (name, bits)) in found.regions.iter().enumerate() {
            let counts = Verdict::ALL.map(|verdict| found.of(number, verdict));
            let mut row = vec![
                format!("{scenario:?}").to_lowercase(),
                name.clone(),
                bits.to_string(),
                counts.iter().sum::<usize>().to_string(),
            ];
            row.extend(counts.map(|count| count.to_string()));
            table.add_row(row);
        }
        for verdict in Verdict::ALL {
            let name = format!("{verdict:?}").to_lowercase();
            if arguments.list.contains(&name) {
                for (region, bit) in found.bits(verdict) {
                    let (byte, bit) = (bit / 8, bit % 8);
                    stdout::print(format_args!(
                        "{scenario:?} {name}: {region}, byte {byte}, bit {bit}\n"
                    ));
                }
            }
        }
    }
    stdout::print(format_args!("{table}\n"));
    Ok(())
}
