//! The part of a recording in which the sensors are at rest, for the Allan analysis.

use host_core::error::Error;
use host_core::list::Writer;
use host_estimation::analysis::allan::{Column, Kind};
use host_io::recordings::InitialAttitude;
use host_io::recordings::columns::IMU;
use host_io::recordings::gaps::gaps;
use host_io::recordings::pace::{Pace, nearly_whole};
use host_io::recordings::record::{Kind as Samples, Record};
use host_report::unit::PartResult;

/// Number of bytes of a column that stay in memory.
const IN_MEMORY: usize = 1 << 24;
/// Shortest rest that is worth an analysis, s.
const LEAST_S: f64 = 60.0;
/// Fixes that lie no farther apart than this are those of a vehicle at rest, m, or this many
/// standard deviations.
const APART_M: f64 = 5.0;
const SIGMAS: f64 = 6.0;

/// Sensors at rest.
#[derive(Debug)]
pub(in crate::cli) struct Rest {
    /// Description in words.
    pub source: String,
    pub columns: Vec<Column>,
    /// Notes for the reader, without a full stop.
    pub notes: Vec<String>,
}

/// The longest rest that a recording is known to have, or why there is none.
pub(super) fn of(record: &Record) -> Result<PartResult<Rest>, Error> {
    match span(record) {
        Some(span) => within(record, span),
        None => Ok(Err(
            "the recording has no known standstill: its start names none (--standstill-s does where \
             replay has it), and its fixes are not all at one place"
                .into(),
        )),
    }
}

/// All of a recording that is at rest, up to the first gap, or why it cannot be used.
pub(in crate::cli) fn throughout(record: &Record) -> Result<PartResult<Rest>, Error> {
    let (first, last) = record
        .time
        .start()
        .zip(record.time.end())
        .unwrap_or_default();
    within(record, (first - 1.0, last, "at rest throughout"))
}

/// The part of a recording from a time to another.
fn within(
    record: &Record,
    (begin, end, what): (f64, f64, &'static str),
) -> Result<PartResult<Rest>, Error> {
    let pace = Pace::of(&record.time);
    let gaps = gaps(&record.time, record.kind, &pace);
    let mut gaps = gaps.iter().peekable();
    let within = |t: f64| t > begin && t <= end;
    let mut columns: Vec<Column> = columns();
    let (mut gap, mut first, mut last, mut count) = (None, None, begin, 0.0);
    let samples = record.time.each().zip(record.samples.each());
    for (k, (t, sample)) in samples.enumerate() {
        let after_gap = gaps.next_if(|gap| gap.next == k).is_some();
        if !within(t) {
            continue;
        }
        if after_gap && first.is_some() {
            gap = Some(last);
            break;
        }
        first.get_or_insert(t);
        last = t;
        count += 1.0;
        let values = sample.dtheta.iter().chain(sample.dv.iter());
        for (column, value) in columns.iter_mut().zip(values) {
            column.values.push(*value)?;
        }
    }
    let spanned = last - first.unwrap_or(last);
    let length = spanned + pace.step;
    if length < LEAST_S {
        let why = match gap {
            Some(t) => {
                format!("samples are missing {length:.0} s after its beginning, at {t:.3} s")
            }
            None => format!("it lasts {length:.0} s"),
        };
        return Ok(Err(format!(
            "the rest is too short for an analysis: {why}; {LEAST_S} s are needed, hours are better"
        )));
    }
    let rate_hz = nearly_whole((count - 1.0) / spanned);
    for column in &mut columns {
        column.rate_hz = rate_hz;
        column.scale = match record.kind {
            Samples::Increment => 1.0,
            Samples::Rate => 1.0 / rate_hz,
        };
    }
    let mut notes = vec![];
    if let Some(t) = gap {
        notes.push(format!(
            "only the rest before {t:.3} s is analysed, because samples are missing there"
        ));
    }
    Ok(Ok(Rest {
        source: format!("{}, {what}, {length:.0} s", record.file.display()),
        columns,
        notes,
    }))
}

/// The six columns without values, whose rate is not known yet.
fn columns() -> Vec<Column> {
    let names = IMU[1..].iter().enumerate();
    names
        .map(|(i, name)| Column {
            name: (*name).to_owned(),
            kind: if i < 3 { Kind::Gyro } else { Kind::Accel },
            rate_hz: f64::NAN,
            scale: f64::NAN,
            values: Writer::new(IN_MEMORY),
        })
        .collect()
}

/// Start and end of the time at rest, and its description.
fn span(record: &Record) -> Option<(f64, f64, &'static str)> {
    let (first, last) = (record.time.start()?, record.time.end()?);
    if stands(record) {
        return Some((first - 1.0, last, "at rest throughout"));
    }
    match record.initial_attitude {
        Some(InitialAttitude::Standstill(s)) => {
            let begin = record.first_epoch();
            Some((begin, begin + s as f64, "its standstill"))
        }
        _ => None,
    }
}

/// Whether all fixes have the same position, and no speed.
fn stands(record: &Record) -> bool {
    let placed = || record.fixes.iter().filter(|fix| fix.has_position());
    let Some(first) = placed().next() else {
        return false;
    };
    let origin = first.position();
    placed().all(|fix| {
        let apart = fix.position().ned_from(&origin);
        let sigma = fix.sigmas[0].max(fix.sigmas[1]);
        let fast = fix.measured_velocity().is_some_and(|v| {
            let most = (SIGMAS * fix.sigmas[3].max(fix.sigmas[4])).max(0.3);
            v[0].hypot(v[1]) > most
        });
        apart.x.hypot(apart.y) <= APART_M.max(1.5 * SIGMAS * sigma) && !fast
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::inertial::sins::Increment;

    /// Two minutes at 400 Hz whose stamps have three decimals: steps of 2 and 3 ms.
    #[test]
    fn the_rate_is_that_of_the_samples() {
        let stamps: Vec<f64> = (1..=48_000_u32)
            .map(|k| (f64::from(k) * 2.5).floor() * 1e-3)
            .collect();
        let mut record = Record::default();
        for kind in [Samples::Increment, Samples::Rate] {
            record.kind = kind;
            record.samples.edit(|all| {
                *all = vec![Increment::default(); stamps.len()];
            });
            record.time.edit(|all| all.clone_from(&stamps));
            let rest = throughout(&record).unwrap().unwrap();
            assert!(rest.notes.is_empty(), "{:?}", rest.notes);
            for column in rest.columns {
                assert!((column.rate_hz - 400.0).abs() < 1e-9, "{}", column.rate_hz);
            }
        }
        // a second is missing after the first 100: the part before it is analysed
        record.time.edit(|all| {
            let late = all.iter_mut().skip(40_000);
            late.for_each(|t| *t += 1.0);
        });
        let rest = throughout(&record).unwrap().unwrap();
        assert_eq!(rest.notes.len(), 1);
        assert!((rest.columns[0].rate_hz - 400.0).abs() < 0.01);
    }
}
