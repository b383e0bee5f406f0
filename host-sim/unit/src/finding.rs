//! Faults and doubts found in a unit file.

use host_core::error::Error;
use std::path::Path;

/// One fault or doubt, with its field and the remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Line of the field or of its table, from 1, where one is known.
    pub line: Option<usize>,
    /// The field with its tables, for example `sensor.rate_hz`.
    pub key: String,
    /// The problem, as the rest of a sentence that begins with the field.
    pub problem: String,
    /// How to correct it.
    pub remedy: String,
    /// Whether the file can be used all the same.
    pub doubt: bool,
}

impl Finding {
    /// A value that cannot be used.
    #[must_use]
    pub fn wrong(
        key: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            line: None,
            key: key.into(),
            problem: problem.into(),
            remedy: remedy.into(),
            doubt: false,
        }
    }

    /// A value that can be used but is implausible.
    #[must_use]
    pub fn doubtful(
        key: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            doubt: true,
            ..Self::wrong(key, problem, remedy)
        }
    }

    /// The finding as an error of this file.
    #[must_use]
    pub fn error(self, file: &Path) -> Error {
        Error::Scenario {
            file: file.to_path_buf(),
            line: self.line,
            key: self.key,
            problem: self.problem,
            remedy: self.remedy,
        }
    }
}
