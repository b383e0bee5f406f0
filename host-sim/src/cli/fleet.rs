//! `host-sim fleet`.

use super::options::{ScenarioOption, UnitOption, arguments, pool, refused, shard};
use super::output::{JsonOption, check_ours, output_file};
use super::progress::bar;
use super::stdout;
use clap::{Args as ClapArgs, Subcommand};
use firmware::inputs::{Inputs as DeviceInputs, Source};
use firmware::model::IMAGES_LEN;
use host_core::error::Error;
use host_io::output::write_atomic;
use host_lab::campaign::fleet::{
    Drive, Fleet, LEAST_UNITS, Origin, PROGRESS, folders, learn, merge,
};
use host_lab::campaign::{Campaign, Group};
use host_unit::Unit;
use host_unit::networks::Input;
use host_unit::prior::Prior;
use std::path::{Path, PathBuf};

/// Arguments of `fleet`.
#[derive(Debug, ClapArgs)]
pub struct Args {
    #[command(subcommand)]
    action: Option<Action>,
    #[command(flatten)]
    scenario: ScenarioOption,
    /// Errors of the simulated units: a group as in `campaign`
    #[arg(long, value_name = "GROUP", default_value = "all")]
    models: String,
    /// How warm the simulated units are at power-on: cold, warm, hot, mixed
    #[arg(long, value_name = "NAME", default_value = "mixed")]
    start: String,
    /// Number of simulated units
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    units: u32,
    /// Drives of each simulated unit, each on another day
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    drives: u32,
    /// Recordings instead: folders of units, each with a folder for each drive, in which
    /// header.toml is; a single folder may hold the folders of all units
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["models", "start", "units", "drives", "scenario"])]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    inputs: Inputs,
    /// Threads, on which the results do not depend [default: all cores]
    #[arg(long)]
    jobs: Option<usize>,
    /// Directory of the drives' errors
    #[arg(long, value_name = "DIR", default_value = "out/fleet")]
    out: PathBuf,
    /// Keep the units that an interrupted command has finished
    #[arg(long)]
    resume: bool,
    /// Only the units whose number modulo N is I; nothing is learnt before `fleet merge`
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// The unit file to write: the unit's, with the table [prior]
    #[arg(long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    #[command(flatten)]
    written: Written,
}

/// Files to write beside the unit file.
#[derive(Debug, Clone, ClapArgs)]
struct Written {
    /// Write the initial networks of a unit of this type, for `device weights put`
    #[arg(long, value_name = "FILE", value_parser = output_file())]
    weights: Option<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
}

/// Inputs of the networks.
#[derive(Debug, Clone, ClapArgs)]
struct Inputs {
    /// Three inputs of both networks: rate-x to rate-z, force-x to force-z, temperature,
    /// temperature-rate, vibration, rate-magnitude
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "NAMES",
        default_value = "temperature,temperature-rate,vibration"
    )]
    inputs: Vec<String>,
    /// Other inputs of the accelerometers' network
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    accel_inputs: Vec<String>,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Learn from the directories of all shards
    Merge {
        /// Directories of the shards
        #[arg(required = true)]
        dirs: Vec<PathBuf>,
        #[command(flatten)]
        unit: UnitOption,
        #[command(flatten)]
        inputs: Inputs,
        /// The unit file to write: the unit's, with the table [prior]
        #[arg(long, value_name = "FILE.toml")]
        output: Option<PathBuf>,
        #[command(flatten)]
        written: Written,
    },
}

impl Inputs {
    fn parsed(&self) -> Result<DeviceInputs, Error> {
        let three = |option: &str, names: &[String]| {
            let all: Result<Vec<Input>, Error> = names.iter().map(|name| name.parse()).collect();
            let count = names.len();
            <[Input; 3]>::try_from(all?)
                .map_err(|_| refused(option, format!("names {count}"), "name three inputs"))
        };
        let gyro = three("--inputs", &self.inputs)?;
        match &self.accel_inputs[..] {
            [] => Ok([gyro; 2].map(|three| three.map(Source::from))),
            names => Ok([gyro, three("--accel-inputs", names)?].map(|t| t.map(Source::from))),
        }
    }
}

impl Args {
    /// Simulates or reads what is missing, learns, prints and writes.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(Action::Merge {
            dirs,
            unit,
            inputs,
            output,
            written,
        }) = &self.action
        {
            let inputs = inputs.parsed()?;
            let drives = merge(dirs, &inputs)?;
            let unit = unit_of_shards(&dirs[0], unit)?;
            let files = (output.as_deref(), written);
            return finish(&drives, &inputs, &unit, files);
        }
        let pool = pool(self.jobs)?;
        let (fleet, unit) = self.fleet()?;
        if self.recordings.is_empty() && fleet.shard.1 == 1 && (self.units as usize) < LEAST_UNITS {
            let problem = format!("is {}, too few to separate a type from a unit", self.units);
            let remedy = format!("give at least {LEAST_UNITS}");
            return Err(refused("--units", problem, remedy));
        }
        let wanted = fleet.wanted().len() as u64;
        let bar = bar(
            wanted,
            "{bar:30} {pos}/{len} units, {elapsed} elapsed, {eta} left",
        );
        let done = pool.install(|| fleet.execute(&|| bar.inc(1)));
        bar.finish_and_clear();
        done?;
        if fleet.shard.1 > 1 {
            let text = unit.to_text(&format!("host-sim {}", arguments()))?;
            write_atomic(&self.out.join(UNIT), text.as_bytes())?;
            println!(
                "the other shards are missing: `host-sim fleet merge` learns from all of them"
            );
            return Ok(());
        }
        let files = (self.output.as_deref(), &self.written);
        let drives = merge(std::slice::from_ref(&self.out), &fleet.inputs)?;
        pool.install(|| finish(&drives, &fleet.inputs, &unit, files))
    }

    fn fleet(&self) -> Result<(Fleet, Unit), Error> {
        let (from, unit) = match &self.recordings[..] {
            [] => self.simulation()?,
            dirs => {
                let unit = self.scenario.unit.load_or("medium")?;
                let units = match dirs {
                    [one] if !one.join("header.toml").exists() => folders_of(one)?,
                    several => several.to_vec(),
                };
                let of = Origin::Recordings {
                    units,
                    unit: Box::new(unit.clone()),
                };
                (of, unit)
            }
        };
        let fleet = Fleet {
            from,
            inputs: self.inputs.parsed()?,
            out: self.out.clone(),
            resume: self.resume,
            shard: shard(self.shard.as_deref())?,
        };
        Ok((fleet, unit))
    }

    fn simulation(&self) -> Result<(Origin, Unit), Error> {
        let mut scenario = self.scenario.load()?;
        scenario.set_start(&self.start)?;
        scenario.vehicle_stands("give a vehicle that stands for 300 s first")?;
        scenario.one_fix_a_second("fleet")?;
        let unit = scenario.unit().clone();
        let group: Group = self.models.parse()?;
        let campaign = Campaign {
            runs: self.units,
            ..Campaign::single(scenario, &[group.sensors])
        };
        let of = Origin::Simulation {
            campaign: Box::new(campaign),
            group,
            drives: self.drives,
        };
        Ok((of, unit))
    }
}

/// The folders of units in a folder; the folder itself if its folders are drives.
fn folders_of(dir: &Path) -> Result<Vec<PathBuf>, Error> {
    let inside = folders(dir)?;
    match inside
        .iter()
        .any(|drive| drive.join("header.toml").exists())
    {
        true => Ok(vec![dir.to_path_buf()]),
        false if inside.is_empty() => Err(refused(
            format!("--recordings: {}", dir.display()),
            "has no folders",
            "give a folder that holds the folders of the units, or the folders of the units",
        )),
        false => Ok(inside),
    }
}

/// Learns from the series, prints and writes.
fn finish(
    units: &[Vec<Drive>],
    inputs: &DeviceInputs,
    unit: &Unit,
    (output, written): (Option<&Path>, &Written),
) -> Result<(), Error> {
    let bar = bar(
        PROGRESS as u64,
        "{bar:30} learning, {elapsed} elapsed, {eta} left",
    );
    let prior = learn(units, inputs, unit, &|| bar.inc(1));
    bar.finish_and_clear();
    let prior = prior?;
    println!("{}", host_report::fleet::table(&prior, stdout::width()));
    written.json.write(&prior)?;
    if let Some(file) = &written.weights {
        let mut image = [0; IMAGES_LEN];
        prior.nets().write_images(0, &mut image);
        write_atomic(file, &image)?;
    }
    if let Some(file) = output {
        write(file, unit, prior)?;
    }
    Ok(())
}

/// The unit file that a shard leaves for the merge.
const UNIT: &str = "unit.toml";

/// The unit of a fleet's shards, of which `dir` has one; it may be given, but not be another.
fn unit_of_shards(dir: &Path, given: &UnitOption) -> Result<Unit, Error> {
    let (given, file) = (given.load()?, dir.join(UNIT));
    if !file.exists() {
        return given.ok_or_else(|| {
            let problem = format!("is missing, and so is {}", file.display());
            refused("--unit", problem, "give the --unit of the shards")
        });
    }
    let unit = Unit::load(&file.display().to_string())?;
    match given {
        Some(given) if given != unit => {
            let problem = format!("is '{}', which is not that of the shards", given.name);
            let remedy = format!("leave it out: theirs is '{}'", unit.name);
            Err(refused("--unit", problem, remedy))
        }
        _ => Ok(unit),
    }
}

fn write(file: &Path, unit: &Unit, prior: Prior) -> Result<(), Error> {
    let unit = Unit {
        networks: prior.networks(),
        prior: Some(prior),
        ..unit.clone()
    };
    let text = unit.to_text(&format!("host-sim {}", arguments()))?;
    check_ours("--output", file, |bytes| {
        String::from_utf8_lossy(bytes).contains("\n# host-sim fleet")
    })?;
    write_atomic(file, text.as_bytes())?;
    println!("written: {}", file.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shards merge into a unit of their own type, whatever is not given.
    #[test]
    fn the_unit_of_shards_is_theirs() {
        let dir = tempfile::tempdir().unwrap();
        let option = |name: Option<&str>| UnitOption {
            unit: name.map(str::to_owned),
        };
        let of = |name| unit_of_shards(dir.path(), &option(name));
        let missing = of(None).unwrap_err().to_string();
        assert!(missing.contains("--unit: is missing"), "{missing}");
        assert_eq!(of(Some("mems")).unwrap().name, "mems");
        let text = Unit::load("mems").unwrap().to_text("test").unwrap();
        std::fs::write(dir.path().join(UNIT), text).unwrap();
        for given in [None, Some("mems")] {
            assert_eq!(of(given).unwrap(), Unit::load("mems").unwrap());
        }
        let other = of(Some("medium")).unwrap_err().to_string();
        assert!(other.contains("'medium', which is not"), "{other}");
        assert!(other.contains("theirs is 'mems'"), "{other}");
    }
}
