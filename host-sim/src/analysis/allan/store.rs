//! Columns that wait for their analysis. A day of six axes is larger than the memory that an
//! analysis of one of them needs, so long columns wait in temporary files.

use super::{Kind, Series};
use crate::error::Error;
use std::io::{self, BufWriter, Read, Seek, Write};
use tempfile::{SpooledTempFile, spooled_tempfile};

/// A column of at most so many bytes waits in memory: three hours at 200 samples a second.
const IN_MEMORY: usize = 1 << 24;

/// Values in the order in which they came.
#[derive(Debug)]
pub struct Store {
    values: BufWriter<SpooledTempFile>,
    count: usize,
}

impl Default for Store {
    fn default() -> Self {
        Self::with_memory(IN_MEMORY)
    }
}

impl Store {
    fn with_memory(bytes: usize) -> Self {
        Self {
            values: BufWriter::with_capacity(1 << 16, spooled_tempfile(bytes)),
            count: 0,
        }
    }

    /// Adds a value.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, value: f64) -> Result<(), Error> {
        self.count += 1;
        let written = self.values.write_all(&value.to_le_bytes());
        written.map_err(refused)
    }

    /// All values, each through `change`.
    fn read(self, change: impl Fn(f64) -> f64) -> io::Result<Vec<f64>> {
        let mut file = self.values.into_inner().map_err(io::Error::from)?;
        file.rewind()?;
        let mut values = Vec::with_capacity(self.count);
        let mut piece = [0; 1 << 13];
        let mut left = 8 * self.count;
        while left > 0 {
            let bytes = &mut piece[..left.min(1 << 13)];
            file.read_exact(bytes)?;
            left -= bytes.len();
            let (eights, _) = bytes.as_chunks();
            values.extend(eights.iter().map(|b| change(f64::from_le_bytes(*b))));
        }
        Ok(values)
    }
}

/// The error of a temporary file.
fn refused(source: io::Error) -> Error {
    Error::writing(&std::env::temp_dir().join("a temporary file"), source)
}

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
    pub values: Store,
}

impl Column {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.count
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The series itself, in memory.
    ///
    /// # Errors
    /// The temporary file cannot be read.
    pub fn series(self) -> Result<Series, Error> {
        let scale = self.scale;
        Ok(Series {
            increments: self.values.read(|x| x * scale).map_err(refused)?,
            column: self.name,
            kind: self.kind,
            rate_hz: self.rate_hz,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_as_they_went_from_memory_and_from_a_file() {
        let values: Vec<f64> = (0..30_000).map(|i| f64::from(i).sin() / 3.0).collect();
        for (memory, file) in [(1 << 24, false), (1000, true)] {
            let mut store = Store::with_memory(memory);
            values.iter().for_each(|x| store.push(*x).unwrap());
            assert_eq!(store.values.get_ref().is_rolled(), file);
            assert_eq!(store.read(|x| x).unwrap(), values);
        }
        assert!(Store::default().read(|x| x).unwrap().is_empty());
    }
}
