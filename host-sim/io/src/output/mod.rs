//! Output files appear complete or not at all. Each is written under a temporary name in the same
//! directory and then renamed.

mod unfinished;

pub use unfinished::abandon;
pub use unfinished::{Unfinished, undivided};

use host_core::error::Error;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes `bytes` to `path` and replaces an existing file in one step. Missing parent directories
/// are created.
///
/// # Errors
/// [`Error::Unwritable`]. An existing file at `path` is then unchanged.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut sink = Sink::open(path)?;
    sink.write_all(bytes)
        .map_err(|source| Error::writing(path, source))?;
    sink.finish().map_err(|source| Error::writing(path, source))
}

/// Whether a file can be written at `path`, before the work for it is begun. Nothing is left
/// behind, and a pipe or a device is not opened: its reader would see an end.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn check_writable(path: &Path) -> Result<(), Error> {
    match std::fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(Error::writing(
            path,
            std::io::ErrorKind::IsADirectory.into(),
        )),
        Ok(there) if !there.is_file() => Ok(()),
        _ => {
            let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
            makes_files(directory_of(&target)).map_err(|source| Error::writing(path, source))
        }
    }
}

/// Whether files can be written in the directory at `path`, which need not exist. Nothing is left
/// behind.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn check_directory(path: &Path) -> Result<(), Error> {
    makes_files(path).map_err(|source| Error::writing(path, source))
}

/// Makes and removes a file in `directory`, or in the nearest directory above it that exists.
fn makes_files(directory: &Path) -> std::io::Result<()> {
    let mut above = directory.ancestors();
    let there = above.find(|at| std::fs::symlink_metadata(at).is_ok());
    temporary_file(there.unwrap_or(Path::new("."))).map(drop)
}

/// A file that is being written and does not have its final name yet.
enum Sink {
    /// A temporary file in the directory of its final name.
    Beside(NamedTempFile, PathBuf, Unfinished),
    /// A pipe or a device such as `/dev/stdout`. A file must not replace it, so it is written
    /// directly.
    Straight(File),
}

impl Sink {
    fn open(path: &Path) -> Result<Self, Error> {
        Self::try_open(path).map_err(|source| Error::writing(path, source))
    }

    fn try_open(path: &Path) -> std::io::Result<Self> {
        // A link is followed: the file behind it is replaced and the link stays.
        let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        match std::fs::metadata(path) {
            Ok(there) if there.is_dir() => return Err(std::io::ErrorKind::IsADirectory.into()),
            Ok(there) if !there.is_file() => {
                return Ok(Self::Straight(OpenOptions::new().write(true).open(path)?));
            }
            _ => {}
        }
        let directory = directory_of(&target);
        std::fs::create_dir_all(directory)?;
        let (unfinished, file) =
            Unfinished::make(|| temporary_file(directory), NamedTempFile::path)?;
        Ok(Self::Beside(file, target, unfinished))
    }

    /// Renames the file to its final name.
    fn finish(self) -> std::io::Result<()> {
        match self {
            // The data are synced first. Otherwise the rename may reach the disk before the data,
            // and a power cut would leave an empty file.
            Self::Beside(file, target, _unfinished) => file
                .as_file()
                .sync_data()
                .and_then(|()| Ok(file.persist(target).map(drop)?)),
            Self::Straight(mut file) => file.flush(),
        }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self {
            Self::Beside(file, ..) => file.write(bytes),
            Self::Straight(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self {
            Self::Beside(file, ..) => file.flush(),
            Self::Straight(file) => file.flush(),
        }
    }
}

/// Directory that holds `path`; `.` for a bare file name.
pub fn directory_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A temporary file with the permissions of an ordinary new file. By default only the owner could
/// read it.
fn temporary_file(directory: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".host-sim-");
    #[cfg(unix)]
    // the umask removes its bits from these
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(directory)
}

/// Writes numbers as CSV. The header names each column with its unit. Reading the numbers back
/// gives the same bits.
///
/// [`CsvWriter::finish`] makes the file appear under its name. If the writer is dropped before
/// that, no file remains.
pub struct CsvWriter {
    sink: BufWriter<Sink>,
    path: PathBuf,
    columns: Vec<String>,
    line: Vec<u8>,
    lines: usize,
}

impl CsvWriter {
    /// Starts a file at `path` with `columns` such as `t_s` or `dtheta_x_rad`.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn create(path: &Path, columns: &[&str]) -> Result<Self, Error> {
        let mut writer = Self {
            sink: BufWriter::with_capacity(1 << 16, Sink::open(path)?),
            path: path.to_path_buf(),
            columns: columns.iter().map(ToString::to_string).collect(),
            line: Vec::with_capacity(256),
            lines: 1,
        };
        let header = columns.join(",") + "\n";
        writer
            .sink
            .write_all(header.as_bytes())
            .map_err(|source| Error::writing(path, source))?;
        Ok(writer)
    }

    /// Adds one line, one number a column.
    ///
    /// # Errors
    /// [`Error::Value`] for NaN or infinity, which no reader of this package accepts;
    /// [`Error::ColumnCount`]; [`Error::Unwritable`].
    pub fn row(&mut self, values: &[f64]) -> Result<(), Error> {
        self.cells(values.iter().map(|value| Some(*value)))
    }

    /// Adds one line, with an empty cell for `None`.
    ///
    /// # Errors
    /// As [`CsvWriter::row`].
    pub fn cells(
        &mut self,
        values: impl ExactSizeIterator<Item = Option<f64>>,
    ) -> Result<(), Error> {
        if values.len() != self.columns.len() {
            return Err(self.wrong_count(values.len()));
        }
        let mut digits = ryu::Buffer::new();
        self.line.clear();
        for (column, value) in values.enumerate() {
            if let Some(value) = value {
                if !value.is_finite() {
                    return Err(self.not_finite(column, value));
                }
                let text = digits.format_finite(value);
                self.line.extend_from_slice(text.as_bytes());
            }
            self.line.push(b',');
        }
        self.line.pop();
        self.line.push(b'\n');
        self.lines += 1;
        self.sink
            .write_all(&self.line)
            .map_err(|source| Error::writing(&self.path, source))
    }

    /// Makes the finished file appear under its name.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn finish(self) -> Result<(), Error> {
        let path = self.path;
        let sink = self
            .sink
            .into_inner()
            .map_err(|unwritten| Error::writing(&path, unwritten.into_error()))?;
        sink.finish()
            .map_err(|source| Error::writing(&path, source))
    }

    fn wrong_count(&self, found: usize) -> Error {
        Error::ColumnCount {
            file: self.path.clone(),
            line: self.lines + 1,
            found,
            expected: self.columns.len(),
            columns: self.columns.join(","),
        }
    }

    fn not_finite(&self, column: usize, value: f64) -> Error {
        Error::Value {
            file: self.path.clone(),
            line: self.lines + 1,
            field: self.columns[column].clone(),
            text: value.to_string(),
            fault: "not finite",
            remedy: "nothing was written; look for the first bad value in the run's inputs"
                .to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(directory: &Path) -> Vec<String> {
        std::fs::read_dir(directory)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_file_is_written_with_its_parents_and_replaced_whole() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b/out.json");
        write_atomic(&path, b"first, and longer").unwrap();
        write_atomic(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(names(path.parent().unwrap()), ["out.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_devices_stay_devices() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt};
        let dir = tempfile::tempdir().unwrap();
        let (file, link) = (dir.path().join("file"), dir.path().join("link"));
        write_atomic(&file, b"old").unwrap();
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o600, 0o600);
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomic(&link, b"new").unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(std::fs::read(&file).unwrap(), b"new");
        write_atomic(Path::new("/dev/null"), b"gone").unwrap();
        assert!(
            Path::new("/dev/null")
                .metadata()
                .unwrap()
                .file_type()
                .is_char_device()
        );
    }

    #[test]
    fn paths_that_cannot_be_written_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        std::fs::write(&file, "x").unwrap();
        for path in [dir.path().to_path_buf(), file.join("below-a-file.csv")] {
            check_writable(&path).unwrap_err();
            let error = write_atomic(&path, b"y").unwrap_err();
            assert!(matches!(error, Error::Unwritable { .. }), "{error}");
            assert!(
                error.to_string().contains(path.to_str().unwrap()),
                "{error}"
            );
        }
        assert_eq!(names(dir.path()), ["file"]);
    }

    #[test]
    fn csv_numbers_read_back_to_the_same_bits() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("imu.csv");
        let values = [
            0.1 + 0.2,
            -0.0,
            1e-300,
            123_456_789.123_456_78,
            f64::MIN_POSITIVE,
            -4.848_136_811_095_36e-7,
        ];
        let mut writer = CsvWriter::create(&path, &["a", "b", "c", "d", "e", "f"]).unwrap();
        writer.row(&values).unwrap();
        assert!(
            names(dir.path()).iter().all(|n| n != "imu.csv"),
            "not in place before it is whole"
        );
        writer.finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "a,b,c,d,e,f");
        let back: Vec<u64> = lines[1]
            .split(',')
            .map(|v| v.parse::<f64>().unwrap().to_bits())
            .collect();
        assert_eq!(back, values.map(f64::to_bits));
        assert_eq!(lines.len(), 2);
    }

    #[test]
    fn csv_refuses_nan_and_wrong_counts_and_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("imu.csv");
        let mut writer = CsvWriter::create(&path, &["t_s", "dv_x_mps"]).unwrap();
        writer.row(&[0.0, 1.0]).unwrap();
        let nan = writer.row(&[0.01, f64::NAN]).unwrap_err().to_string();
        assert!(
            nan.contains("imu.csv:3: column 'dv_x_mps': 'NaN' is not finite"),
            "{nan}"
        );
        let count = writer.row(&[0.01]).unwrap_err().to_string();
        assert!(
            count.contains("imu.csv:3: 1 columns instead of 2"),
            "{count}"
        );
        drop(writer);
        assert!(names(dir.path()).is_empty());
    }
}
