//! Prepares a recording for the parts of the report. It is read and replayed by the code of
//! `replay` and `allan`.

use super::super::options::{quoted, refused};
use super::super::replay::{self, Source};
use super::super::user_recording::Options;
use super::files::hashes;
use super::rest::{self, Rest};
use clap::Parser;
use host_core::error::Error;
use host_core::inertial::session::Session;
use host_core::words::thousands;
use host_estimation::analysis::allan::columns::{Choice, load};
use host_io::recordings::record::Record;
use host_lab::campaign::fleet::readings;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Report;
use host_lab::experiment::{fog_mems, kitti, lasergyro};
use host_reading::Loaded;
use host_reading::form::Form;
use host_report::unit::PartResult;
use host_unit::Unit;
use std::path::{Path, PathBuf};

/// File of temperatures beside the header of a CSV, as `simulate` writes it.
const TEMPERATURE: &str = "temperature.csv";

/// `replay` as a program of its own.
#[derive(Debug, Parser)]
#[command(name = "replay", no_binary_name = true)]
struct Replay {
    #[command(flatten)]
    args: replay::Args,
}

/// Input of the report from a recording.
pub(super) struct ReportInput {
    pub unit: Unit,
    /// No unit was given: it is assumed.
    pub assumed: bool,
    pub source: Vec<(String, String)>,
    pub files: Vec<(String, String)>,
    pub warnings: Vec<String>,
    pub rest: PartResult<Rest>,
    pub outcomes: PartResult<Vec<Outcome>>,
    pub temperatures: PartResult<Vec<(f64, f64)>>,
    /// The command that gives the replay, or the analysis, alone.
    pub command: Option<String>,
}

/// Reads the recording, and replays it.
pub(super) fn read(
    form: &Form,
    unit: Option<Unit>,
    name: Option<&str>,
    options: &[String],
) -> Result<ReportInput, Error> {
    match form {
        Form::Device(_) => Err(refused("--from", "is a device", "give a recording")),
        Form::AtRest(file) => at_rest(file, unit, options),
        Form::Replay(kind, arguments, files) => {
            let all = words(kind, arguments, name, options);
            let args = parsed(&all, "the options after --")?;
            let mut given = replayed(&args, unit, !options.is_empty())?;
            let unit_file = name.map(PathBuf::from);
            let beside = files.first().map(|file| file.with_file_name(TEMPERATURE));
            let read = given.temperatures.is_ok();
            let more: Vec<PathBuf> = unit_file
                .into_iter()
                .chain(beside.filter(|_| read))
                .collect();
            given.files = hashes(files, &more)?;
            let typed: Vec<String> = all.into_iter().map(quoted).collect();
            given.command = Some(format!("host-sim replay {}", typed.join(" ")));
            Ok(given)
        }
    }
}

/// The words after `host-sim replay`.
fn words(kind: &str, arguments: &[String], unit: Option<&str>, options: &[String]) -> Vec<String> {
    let named = unit.map(|unit| ["--unit".to_owned(), unit.to_owned()]);
    [kind.to_owned()]
        .into_iter()
        .chain(arguments.iter().cloned())
        .chain(named.into_iter().flatten())
        .chain(options.iter().cloned())
        .collect()
}

/// These words as `replay` takes them; errors name their source.
fn parsed(words: &[String], source: &str) -> Result<replay::Args, Error> {
    let parsed = Replay::try_parse_from(words).map_err(|error| {
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default();
        let problem = first.trim_start_matches("error: ").to_owned();
        let kind = words.first().map_or("", String::as_str);
        let remedy = format!("`host-sim replay {kind} --help` lists them");
        refused(source, problem, remedy)
    })?;
    Ok(parsed.args)
}

/// Columns of sensors at rest, as `allan FILE` takes them.
fn at_rest(file: &Path, unit: Option<Unit>, options: &[String]) -> Result<ReportInput, Error> {
    if !options.is_empty() {
        let problem = format!("'{}' belongs to `replay`", options.join(" "));
        let remedy = "leave it out, or describe the file by a header.toml (docs/your-data.md)";
        return Err(refused("--", problem, remedy));
    }
    let mut notes = vec![];
    let columns = load(file, &Choice::default(), &mut notes)?;
    let first = columns.first();
    let seconds = first.map_or(0.0, |c| c.len() as f64 / c.rate_hz);
    let rate = first.map_or(0.0, |c| c.rate_hz);
    let why = || {
        "the recording has samples alone; with fixes and a header.toml (docs/your-data.md) it can \
         be replayed"
            .to_owned()
    };
    Ok(ReportInput {
        assumed: unit.is_none(),
        unit: unit.unwrap_or_default(),
        source: vec![
            pair("recording", file.display().to_string()),
            pair(
                "samples",
                format!("{rate} a second, for {seconds:.0} s, taken as at rest"),
            ),
        ],
        files: hashes(&[file.to_path_buf()], &[])?,
        warnings: vec![],
        rest: Ok(Rest {
            source: file.display().to_string(),
            columns,
            notes,
        }),
        outcomes: Err(why()),
        temperatures: Err(no_temperatures()),
        command: Some(format!(
            "host-sim allan {}",
            quoted(file.display().to_string())
        )),
    })
}

fn pair(label: &str, value: String) -> (String, String) {
    (label.to_owned(), value)
}

fn no_temperatures() -> String {
    format!("the recording has no temperatures (a file {TEMPERATURE} beside a header.toml)")
}

fn replayed(args: &replay::Args, unit: Option<Unit>, strict: bool) -> Result<ReportInput, Error> {
    match &args.what {
        Source::Csv(args) => user(args.load()?, &args.options, unit, strict),
        Source::KfGins(args) => user(args.load()?, &args.options, unit, strict),
        Source::Novatel(args) => user(args.load()?, &args.options, unit, strict),
        Source::Mcap(args) => user(args.load()?, &args.options, unit, strict),
        Source::Ulog(args) => user(args.load()?, &args.options, unit, strict),
        Source::Ubx(args) => user(args.load()?, &args.options, unit, strict),
        Source::Euroc(args) => user(args.load()?, &args.options, unit, strict),
        Source::Kitti(args) => {
            let drives = args.outcomes()?;
            let sessions: Vec<&Session> = drives.iter().map(|(session, _)| session).collect();
            let source = sessions
                .first()
                .map(|s| of_session("a road drive of KITTI", s));
            let outcomes = drives.into_iter().flat_map(|(_, of)| of).collect();
            known(kitti::UNIT, unit, source.unwrap_or_default(), Ok(outcomes))
        }
        Source::FogMems(args) => {
            let (session, outcomes) = args.outcomes()?;
            let source = of_session("MEMS beside a fibre-optic navigator", &session);
            known(fog_mems::UNIT, unit, source, Ok(outcomes))
        }
        Source::Lasergyro(args) => {
            let columns = load(&args.file, &Choice::default(), &mut Vec::new())?;
            let outcomes = match args.report() {
                Ok(report) => Ok(vec![outcome(report)]),
                Err(error) if !strict => Err(not_replayed(&error)),
                Err(error) => return Err(error),
            };
            let source = vec![pair("recording", "laser gyros at rest".into())];
            let given = known(lasergyro::UNIT, unit, source, outcomes)?;
            Ok(ReportInput {
                rest: Ok(Rest {
                    source: args.file.display().to_string(),
                    columns,
                    notes: vec![],
                }),
                ..given
            })
        }
        Source::Hybrid(_) | Source::Sessions(_) | Source::Blackbox(_) => Err(refused(
            "--from",
            "is not a recording of a unit",
            "give one that docs/your-data.md lists",
        )),
    }
}

/// One of the recordings with a unit of their own.
fn known(
    usual: &str,
    unit: Option<Unit>,
    source: Vec<(String, String)>,
    outcomes: PartResult<Vec<Outcome>>,
) -> Result<ReportInput, Error> {
    Ok(ReportInput {
        assumed: unit.is_none(),
        unit: unit.map_or_else(|| Unit::load(usual), Ok)?,
        source,
        files: vec![],
        warnings: vec![],
        rest: Err("the vehicle drives from the first second on".into()),
        outcomes,
        temperatures: Err(no_temperatures()),
        command: None,
    })
}

fn of_session(what: &str, session: &Session) -> Vec<(String, String)> {
    let fixes = session.fixes.iter().flatten().count();
    vec![
        pair("recording", what.to_owned()),
        pair(
            "samples",
            format!(
                "{:.0} a second, for {} s",
                1.0 / session.dt,
                thousands(session.epochs())
            ),
        ),
        pair("fixes", thousands(fixes)),
    ]
}

/// A report of a run as a case of a replay.
fn outcome(report: Report) -> Outcome {
    let bench = report.bench;
    let case = bench.as_ref().map_or(String::new(), |b| {
        let (l, j) = (&b.learn, &b.judge);
        format!(
            "learn {}-{} s, judge {}-{} s",
            l.start, l.end, j.start, j.end
        )
    });
    Outcome {
        schema: report.results.schema,
        recording: report.results.scenario,
        case,
        start: String::new(),
        residual: None,
        rows: report.results.rows,
        notes: report.notes,
        warnings: vec![],
        curves: report.curves,
        bench,
    }
}

/// A user's recording. Wrong options end the command; parts that the recording cannot give are left
/// out.
fn user(
    loaded: Loaded,
    options: &Options,
    unit: Option<Unit>,
    strict: bool,
) -> Result<ReportInput, Error> {
    let record = &loaded.record;
    let rest = rest::of(record)?;
    let source = source(record);
    let temperatures = temperatures(record)?;
    let named = unit.or_else(|| loaded.named.clone());
    let outcomes = match options.judge(loaded) {
        Ok(outcome) => Ok(vec![outcome]),
        Err(error @ (Error::Option { .. } | Error::Scenario { .. })) if !strict => {
            Err(not_replayed(&error))
        }
        Err(error) => return Err(error),
    };
    let warnings = outcomes.as_ref().map_or(vec![], |outcomes: &Vec<Outcome>| {
        let each = outcomes.iter().flat_map(|o| &o.warnings);
        each.map(ToString::to_string).collect()
    });
    Ok(ReportInput {
        assumed: named.is_none(),
        unit: named.unwrap_or_default(),
        source,
        files: vec![],
        warnings,
        rest,
        outcomes,
        temperatures,
        command: None,
    })
}

/// An error as the reason why a part is left out: without a full stop.
fn not_replayed(error: &Error) -> String {
    format!(
        "it cannot be replayed ({})",
        error.to_string().replace("; remedy:", ". Remedy:")
    )
}

fn source(record: &Record) -> Vec<(String, String)> {
    let ends = record.time.start().zip(record.time.end());
    let (from, to) = ends.unwrap_or((0.0, 0.0));
    let later = record.time.each().skip(1);
    let steps = record.time.each().zip(later).map(|(a, b)| b - a);
    let long = record
        .max_gap_s
        .unwrap_or(0.1_f64.max(3.0 / record.rate_hz.max(1) as f64));
    let (mut gaps, mut longest) = (0, 0.0_f64);
    for step in steps.filter(|step| *step > long) {
        gaps += 1;
        longest = longest.max(step);
    }
    let gaps = match gaps {
        0 => "none".to_owned(),
        n => format!("{n} longer than {long:.2} s, the longest {longest:.2} s"),
    };
    let judged = if record.truth.is_some() {
        "better states than the fixes"
    } else {
        "the fixes"
    };
    vec![
        pair("recording", record.file.display().to_string()),
        pair(
            "samples",
            format!(
                "{}, {} a second, for {:.1} s from {from:.3} s on",
                thousands(record.samples.len()),
                record.rate_hz,
                to - from
            ),
        ),
        pair("gaps of samples", gaps),
        pair("fixes", thousands(record.fixes.len())),
        pair("judged by", judged.to_owned()),
    ]
}

/// The readings of the thermometers beside the recording.
fn temperatures(record: &Record) -> Result<PartResult<Vec<(f64, f64)>>, Error> {
    let file: PathBuf = record.file.with_file_name(TEMPERATURE);
    if !file.is_file() {
        return Ok(Err(no_temperatures()));
    }
    let ends = record.time.start().zip(record.time.end());
    let Some((from, to)) = ends else {
        return Ok(Err(no_temperatures()));
    };
    let begin = from.floor();
    let seconds = (to - begin).ceil().max(0.0) as usize;
    let each = readings(&file, begin, seconds)?.into_iter().enumerate();
    Ok(Ok(each
        .map(|(k, of)| (begin + (k + 1) as f64, of.axes.mean()))
        .collect()))
}
