//! `--corrected`: writes the recording with the samples corrected by a scheme.

use super::options::refused;
use clap::builder::PossibleValuesParser;
use clap::{Args as ClapArgs, ValueEnum};
use flate2::Compression;
use flate2::write::GzEncoder;
use host_core::error::Error;
use host_core::inertial::sins::Increment;
use host_io::output::{check_writable, write_atomic};
use host_io::recordings::corrected::Original;
use host_io::recordings::kfgins;
use host_io::recordings::record::Record;
use host_lab::experiment::correction::{Correction, SCHEMES};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Form of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Format of the recording
    Same,
    /// Text of KF-GINS: increments, forward-right-down
    KfGins,
}

/// Options of the corrected recording: file, scheme and format.
#[derive(Debug, ClapArgs)]
pub(super) struct CorrectedOptions {
    /// Write the samples again to this file, as a scheme has corrected them. It is gzipped if its
    /// name ends in .gz
    #[arg(long, value_name = "FILE")]
    corrected: Option<PathBuf>,
    /// Scheme whose correction is written: what its row of the table was navigated with
    #[arg(
        long,
        value_name = "SCHEME",
        default_value = "device",
        requires = "corrected",
        value_parser = PossibleValuesParser::new(SCHEMES)
    )]
    corrected_by: String,
    /// Form of the file
    #[arg(
        long,
        value_name = "FORM",
        default_value = "same",
        requires = "corrected"
    )]
    corrected_format: Form,
    /// KF-GINS: added to all times to make them seconds of the week, s
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        allow_hyphen_values = true,
        requires = "corrected"
    )]
    corrected_shift: f64,
    /// Replace the file of --corrected if it is there; files of the recording are never replaced
    #[arg(long, requires = "corrected")]
    force: bool,
}

impl CorrectedOptions {
    /// The scheme, if a file is wanted.
    pub(super) fn scheme(&self) -> Option<&str> {
        self.corrected.as_ref().map(|_| self.corrected_by.as_str())
    }

    /// The file that is wanted, checked before the work for it begins.
    pub(super) fn target(
        &self,
        original: Option<Original>,
        record: &Record,
    ) -> Result<Option<Target<'_>>, Error> {
        let Some(file) = &self.corrected else {
            return Ok(None);
        };
        let source = original.as_ref().map_or(&*record.file, Original::file);
        let same = |other: &Path| {
            let [a, b] = [file, other].map(std::fs::canonicalize);
            a.ok().zip(b.ok()).is_some_and(|(a, b)| a == b)
        };
        let named = named_files();
        let mut own = named.iter().map(PathBuf::as_path);
        if same(source) || same(&record.file) || own.any(same) {
            let problem = format!("'{}' is a file of the recording itself", file.display());
            return Err(refused("--corrected", problem, "give another file"));
        }
        if file.is_file() && !self.force {
            let problem = format!("'{}' is there already", file.display());
            let remedy = "give another file, or --force to replace it";
            return Err(refused("--corrected", problem, remedy));
        }
        let what = match (self.corrected_format, original) {
            (Form::KfGins, _) => {
                kfgins::imu_text(record, self.corrected_shift, "--corrected-shift")?;
                TargetFormat::KfGins(self.corrected_shift)
            }
            (Form::Same, Some(original)) => TargetFormat::Same(original),
            (Form::Same, None) => {
                let problem = "this format is read but not written";
                return Err(refused(
                    "--corrected-format",
                    problem,
                    "give --corrected-format kf-gins, or convert the recording to csv and replay \
                     that",
                ));
            }
        };
        check_writable(file)?;
        let by = &self.corrected_by;
        Ok(Some(Target { file, by, what }))
    }
}

/// The files that the command names but for that of `--corrected`, and those that its TOML files
/// name: header and unit, samples, fixes, truth, wheels.
fn named_files() -> Vec<PathBuf> {
    fn strings(value: &toml::Value, found: &mut Vec<String>) {
        match value {
            toml::Value::String(text) => found.push(text.clone()),
            toml::Value::Array(all) => all.iter().for_each(|value| strings(value, found)),
            toml::Value::Table(all) => all.values().for_each(|value| strings(value, found)),
            _ => {}
        }
    }
    let mut given: Vec<String> = Vec::new();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--corrected" => drop(words.next()),
            _ if word.starts_with("--corrected=") => {}
            _ => given.push(word.split_once('=').map_or(&*word, |(_, of)| of).to_owned()),
        }
    }
    let mut files: Vec<PathBuf> = given.iter().map(PathBuf::from).collect();
    for file in files.clone() {
        if file.extension().is_some_and(|end| end == "toml")
            && let Ok(text) = std::fs::read_to_string(&file)
            && let Ok(table) = text.parse::<toml::Table>()
        {
            let mut named = Vec::new();
            strings(&toml::Value::Table(table), &mut named);
            let beside = |name: &String| file.with_file_name(name);
            files.extend(named.iter().map(beside));
        }
    }
    files
}

/// Format in which it is written.
enum TargetFormat {
    Same(Original),
    /// KF-GINS text, with the offset that is added to the times, s.
    KfGins(f64),
}

/// A file that is wanted.
pub(super) struct Target<'o> {
    file: &'o Path,
    by: &'o str,
    what: TargetFormat,
}

impl Target<'_> {
    /// Writes the file, and gives a sentence for the report. The first epoch is at time `begin` on
    /// the clock of the IMU, s.
    pub(super) fn write(
        &self,
        record: &Record,
        correction: &Correction,
        begin: f64,
    ) -> Result<String, Error> {
        let taken = correction.taken(record, begin);
        record.check()?;
        let bytes = match &self.what {
            TargetFormat::Same(original) => original.without(&taken)?,
            TargetFormat::KfGins(shift) => {
                let record = Record {
                    samples: less(&record.samples, &taken).into(),
                    ..record.clone()
                };
                kfgins::imu_text(&record, *shift, "--corrected-shift")?.into_bytes()
            }
        };
        let packed = self.file.extension().is_some_and(|e| e == "gz");
        let bytes = if packed {
            gzip(&bytes, self.file)?
        } else {
            bytes
        };
        write_atomic(self.file, &bytes)?;
        let changed = taken.iter().filter(|t| **t != Increment::default()).count();
        Ok(format!(
            "{} holds the samples as {} has corrected them: {changed} of {} differ.",
            self.file.display(),
            self.by,
            taken.len()
        ))
    }
}

fn less(samples: &[Increment], taken: &[Increment]) -> Vec<Increment> {
    let less = |(a, b): (&Increment, &Increment)| Increment {
        dtheta: a.dtheta - b.dtheta,
        dv: a.dv - b.dv,
    };
    samples.iter().zip(taken).map(less).collect()
}

fn gzip(bytes: &[u8], file: &Path) -> Result<Vec<u8>, Error> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    packed.map_err(|source| Error::writing(file, source))
}
