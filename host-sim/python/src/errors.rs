//! Rust's errors as Python's exceptions, with their text.

use host_core::error::Error;
use pyo3::PyErr;
use pyo3::exceptions::{PyFileNotFoundError, PyOSError, PyValueError};

/// A missing file is a `FileNotFoundError`, what the system refuses an `OSError`, and all else a
/// `ValueError`. The text names file, line, field and remedy.
pub fn raised(error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::Missing { .. } => PyFileNotFoundError::new_err(text),
        Error::Folder { .. } | Error::Unreadable { .. } | Error::Unwritable { .. } => {
            PyOSError::new_err(text)
        }
        _ => PyValueError::new_err(text),
    }
}

/// A `ValueError` in the form of all others: what, what is wrong, the remedy.
pub fn refused(what: &str, problem: impl AsRef<str>, remedy: impl AsRef<str>) -> PyErr {
    let (problem, remedy) = (problem.as_ref(), remedy.as_ref());
    PyValueError::new_err(format!("{what}: {problem}; remedy: {remedy}"))
}
