//! Opens a recording of any form, for `lrnn_imu.read` of Python. The form is detected as by
//! `report`, and the options are those of `replay`.

use super::options::refused;
use super::replay::What;
use super::report::form::{self, Form};
use super::report::given::{parsed, words};
use super::user_recording::{Loaded, Options};
use host_core::error::Error;
use host_estimation::analysis::doubts::Says;
use host_io::recordings::record::Record;
use host_unit::Unit;
use std::path::PathBuf;

/// A recording that was read.
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

/// Reads the recording in `from`: a file or folder, or IMU and fixes of KF-GINS. `options` are
/// those of `replay` for reading.
///
/// # Errors
/// An unknown form, wrong options, one that only a replay uses, and any fault of the files.
pub fn open(from: &[PathBuf], options: &[String]) -> Result<Opened, Error> {
    let name = from.first().map(|file| file.display().to_string());
    let name = name.unwrap_or_default();
    let Form::Replay(kind, arguments, _) = form::of(from)? else {
        let problem = "holds no samples with fixes";
        let remedy = "give a recording of a drive; for sensors at rest there is allan_file";
        return Err(refused(name, problem, remedy));
    };
    let args = parsed(&words(kind, &arguments, None, options), "the options")?;
    match &args.what {
        What::Csv(args) => opened(args.load()?, &args.options),
        What::KfGins(args) => opened(args.load()?, &args.options),
        What::Novatel(args) => opened(args.load()?, &args.options),
        What::Mcap(args) => opened(args.load()?, &args.options),
        What::Ulog(args) => opened(args.load()?, &args.options),
        What::Ubx(args) => opened(args.load()?, &args.options),
        What::Euroc(args) => opened(args.load()?, &args.options),
        _ => Err(refused(
            name,
            "is one of the recordings with a replay of its own",
            format!("run `host-sim replay {kind}`"),
        )),
    }
}

fn opened(mut loaded: Loaded, options: &Options) -> Result<Opened, Error> {
    let given = options.apply(&mut loaded.record, loaded.named.as_ref())?;
    Ok(Opened {
        form: loaded.name,
        record: loaded.record,
        says: loaded.says,
        unit: given.or(loaded.named),
    })
}
