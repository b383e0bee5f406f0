//! Results as Apache Parquet: one row a run, error model and scheme.

use super::{Merged, Row, Seeds};
use crate::experiment::run::TIMES_MIN;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::sync::Arc;

/// Values of one column.
enum Values {
    Number(Vec<i32>),
    Seed(Vec<i64>),
    Real(Vec<f64>),
    Text(Vec<ByteArray>),
}

/// The file: the same bytes for the same results.
///
/// # Errors
/// Only what the format itself refuses.
pub fn to_parquet(results: &Merged) -> Result<Vec<u8>, ParquetError> {
    let columns = columns(results);
    let fields: Result<Vec<Arc<Type>>, ParquetError> = columns
        .iter()
        .map(|(name, values)| field(name, values).map(Arc::new))
        .collect();
    let schema = Type::group_type_builder("campaign")
        .with_fields(fields?)
        .build()?;
    let properties = WriterProperties::builder()
        .set_created_by(concat!("host-sim ", env!("CARGO_PKG_VERSION")).into())
        .set_compression(Compression::UNCOMPRESSED)
        .build();
    let mut out = Vec::new();
    let mut file = SerializedFileWriter::new(&mut out, Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, values) in &columns {
        write(&mut group, values)?;
    }
    group.close()?;
    file.close()?;
    Ok(out)
}

fn columns(results: &Merged) -> Vec<(String, Values)> {
    let rows = &results.rows;
    let real = |value: &dyn Fn(&Row) -> f64| Values::Real(rows.iter().map(value).collect());
    let text = |value: &dyn Fn(&Row) -> String| {
        Values::Text(rows.iter().map(|r| value(r).as_str().into()).collect())
    };
    let seed = |value: &dyn Fn(Seeds) -> u64| {
        let cast = |r: &Row| value(Seeds::of(r.run)).cast_signed();
        Values::Seed(rows.iter().map(cast).collect())
    };
    let mut out = vec![
        (
            "run".into(),
            Values::Number(rows.iter().map(|r| r.run.cast_signed()).collect()),
        ),
        ("error_model".into(), text(&|r| r.error_model.to_string())),
        ("scheme".into(), text(&|r| r.scheme.clone())),
        ("start".into(), text(&|r| r.start.to_string())),
        (
            "drives".into(),
            Values::Number(rows.iter().map(|r| r.drives.cast_signed()).collect()),
        ),
    ];
    for (i, t) in TIMES_MIN.iter().enumerate() {
        out.push((format!("horizontal_{t}min_m"), real(&|r| r.horizontal_m[i])));
        out.push((format!("north_{t}min_m"), real(&|r| r.north_m[i])));
        out.push((format!("east_{t}min_m"), real(&|r| r.east_m[i])));
    }
    let tuned = |r: &Row| results.tuning.of(r.error_model);
    let fingerprint = fingerprint(&results.fingerprint);
    out.extend([
        ("heading_rad".into(), real(&|r| Seeds::of(r.run).heading)),
        ("seed_unit".into(), seed(&|s| s.unit)),
        ("seed_turn_on".into(), seed(&|s| s.turn_on)),
        ("seed_drive".into(), seed(&|s| s.drive)),
        (
            "tuned_walk_per_h".into(),
            real(&|r| tuned(r).walk_of(&r.scheme)),
        ),
        ("tuned_none_factor".into(), real(&|r| tuned(r).none_factor)),
        ("tuned_rnn_factor".into(), real(&|r| tuned(r).rnn_factor)),
        (
            "version".into(),
            text(&|_| env!("CARGO_PKG_VERSION").into()),
        ),
        ("fingerprint".into(), text(&|_| fingerprint.clone())),
    ]);
    out
}

/// Sixteen hexadecimal digits for a campaign's settings (FNV-1a).
#[must_use]
pub fn fingerprint(settings: &str) -> String {
    let hash = settings.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

fn field(name: &str, values: &Values) -> Result<Type, ParquetError> {
    let unsigned = |bit_width| Some(LogicalType::integer(bit_width, false));
    let (physical, logical) = match values {
        Values::Number(_) => (Physical::INT32, unsigned(32)),
        Values::Seed(_) => (Physical::INT64, unsigned(64)),
        Values::Real(_) => (Physical::DOUBLE, None),
        Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical)
        .with_logical_type(logical)
        .with_repetition(Repetition::REQUIRED)
        .build()
}

fn write<W: std::io::Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &Values,
) -> Result<(), ParquetError> {
    let Some(mut column) = group.next_column()? else {
        return Err(ParquetError::General("a column too many".into()));
    };
    match values {
        Values::Number(v) => column.typed::<Int32Type>().write_batch(v, None, None)?,
        Values::Seed(v) => column.typed::<Int64Type>().write_batch(v, None, None)?,
        Values::Real(v) => column.typed::<DoubleType>().write_batch(v, None, None)?,
        Values::Text(v) => column.typed::<ByteArrayType>().write_batch(v, None, None)?,
    };
    column.close()
}
