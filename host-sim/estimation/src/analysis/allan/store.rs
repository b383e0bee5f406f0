//! Columns that wait for their analysis. A day of six axes is larger than the memory that an
//! analysis of one of them needs, so long columns wait in temporary files.

use super::{Kind, Series};
use host_core::error::Error;
use host_core::list::Writer;

/// Largest column that waits in memory, bytes: three hours at 200 samples a second. There are six
/// columns.
pub(super) const IN_MEMORY: usize = 1 << 24;

/// A series that waits for its analysis.
#[derive(Debug)]
pub struct Column {
    /// Name of the column in the file.
    pub name: String,
    /// Gyro or accelerometer.
    pub kind: Kind,
    /// Samples per second.
    pub rate_hz: f64,
    /// Increment in rad or m/s of a value of 1.
    pub scale: f64,
    /// The values as they were read.
    pub values: Writer<f64>,
}

impl Column {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The series itself, in memory.
    ///
    /// # Errors
    /// The temporary file cannot be written or read.
    pub fn series(self) -> Result<Series, Error> {
        let values = self.values.finish()?;
        let mut increments = Vec::with_capacity(values.len());
        increments.extend(values.each().map(|x| x * self.scale));
        values.check()?;
        Ok(Series {
            increments,
            column: self.name,
            kind: self.kind,
            rate_hz: self.rate_hz,
        })
    }
}
