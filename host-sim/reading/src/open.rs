//! Opens a recording of any form. The form is detected as by `report`, and the options are those of
//! `replay`.

use crate::form::{self, Form};
use crate::messages::{Euroc, Mcap, Ubx, Ulog};
use crate::options::{UnitOption, refused};
use crate::record_options::RecordOptions;
use crate::source::{Csv, KfGins, Novatel};
use clap::{Args as ClapArgs, Parser};
use host_core::error::Error;
use host_estimation::analysis::doubts::Says;
use host_io::recordings::corrected::Original;
use host_io::recordings::record::Record;
use host_unit::Unit;
use std::path::PathBuf;

/// Options of `replay` that a recording is not read by.
const OF_A_REPLAY: [&str; 9] = [
    "--learn-s",
    "--strict",
    "--part",
    "--start",
    "--attitude-sigma",
    "--estimate-time-offset",
    "--corrected",
    "--json",
    "--out",
];

/// A recording that was read, and the description of its samples.
pub struct Loaded {
    /// Name of the form, as in `replay`.
    pub name: &'static str,
    /// Samples and fixes.
    pub record: Record,
    /// Description of the samples by the file.
    pub says: Says,
    /// The unit that the recording itself names.
    pub named: Option<Unit>,
    /// The file into which corrected samples are written.
    pub original: Option<Original>,
}

/// The files of a recording, with the options that belong to its form.
pub trait Source: ClapArgs {
    /// Reads it. `unit` is that of the options.
    ///
    /// # Errors
    /// A wrong option, and any fault of the files.
    fn load(&self, unit: Option<&Unit>) -> Result<Loaded, Error>;
}

/// A recording that was opened.
#[derive(Debug)]
pub struct Opened {
    /// Name of its form, as in `replay`.
    pub form: &'static str,
    /// Samples and fixes.
    pub record: Record,
    /// Description of the samples by the file.
    pub says: Says,
    /// The unit of the options, else the one that the recording names.
    pub unit: Option<Unit>,
}

/// A source with the options of every form.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct Words<S: Source> {
    #[command(flatten)]
    source: S,
    #[command(flatten)]
    unit: UnitOption,
    #[command(flatten)]
    recording: RecordOptions,
}

/// Reads the recording in `from`: a file or folder, or IMU and fixes of KF-GINS. `options` are
/// those of `replay` for reading.
///
/// # Errors
/// An unknown form, wrong options, one that only a replay uses, and any fault of the files.
pub fn open(from: &[PathBuf], options: &[String]) -> Result<Opened, Error> {
    let name = from.first().map(|file| file.display().to_string());
    let name = name.unwrap_or_default();
    let Form::Replay(kind, mut words, _) = form::of(from)? else {
        let problem = "holds no samples with fixes";
        let remedy = "give a recording of a drive; for sensors at rest there is allan_file";
        return Err(refused(name, problem, remedy));
    };
    words.extend(options.iter().cloned());
    match kind {
        "csv" => opened::<Csv>(kind, &words),
        "kf-gins" => opened::<KfGins>(kind, &words),
        "novatel" => opened::<Novatel>(kind, &words),
        "mcap" => opened::<Mcap>(kind, &words),
        "ulog" => opened::<Ulog>(kind, &words),
        "ubx" => opened::<Ubx>(kind, &words),
        "euroc" => opened::<Euroc>(kind, &words),
        _ => Err(refused(
            name,
            "is one of the recordings with a replay of its own",
            format!("run `host-sim replay {kind}`"),
        )),
    }
}

fn opened<S: Source>(kind: &str, words: &[String]) -> Result<Opened, Error> {
    let of_a_replay = words.iter().find_map(|word| {
        let name = word.split('=').next().unwrap_or_default();
        OF_A_REPLAY.into_iter().find(|known| *known == name)
    });
    if let Some(name) = of_a_replay {
        let remedy = "give it to the replay, not to the reading";
        return Err(refused(name, "belongs to a replay", remedy));
    }
    let words = Words::<S>::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default();
        let problem = first.trim_start_matches("error: ").to_owned();
        let remedy = format!("`host-sim replay {kind} --help` lists them");
        refused("the options", problem, remedy)
    })?;
    let given = words.unit.load()?;
    let mut loaded = words.source.load(given.as_ref())?;
    let unit = given.as_ref().or(loaded.named.as_ref());
    let unit = unit.cloned().unwrap_or_default();
    words.recording.apply(&mut loaded.record, &unit)?;
    Ok(Opened {
        form: loaded.name,
        record: loaded.record,
        says: loaded.says,
        unit: given.or(loaded.named),
    })
}
