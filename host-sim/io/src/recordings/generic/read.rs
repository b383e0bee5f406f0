//! The header file as it was read, and its errors.

use super::header::{Gnss, Header, Turned, Unit};
use crate::recordings::input::{START, check_kind};
use crate::recordings::record::Kind;
use crate::recordings::session::complain;
use crate::recordings::table::Separator;
use host_core::error::Error;
use host_core::inertial::axes::Axes;
use host_unit::mounting::Mounting;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};

/// Rotation of vectors from the file's axes to the vehicle's.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    axes: Axes,
    mounting: Option<UnitQuaternion<f64>>,
}

impl Turn {
    pub(super) fn turn(&self, file: [f64; 3]) -> Vector3<f64> {
        let turned = self.axes.turn(file);
        self.mounting.map_or(turned, |mounting| mounting * turned)
    }

    /// The rotation as a matrix.
    pub(super) fn rotation(&self) -> Rotation3<f64> {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let columns = axes.map(|axis| self.turn(axis));
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&columns))
    }
}

/// A header file that was read.
#[derive(Debug)]
pub(super) struct OpenedHeader {
    pub(super) header: Header,
    pub(super) file: PathBuf,
    /// Files that replace those named in the header: that of the IMU, then that of the fixes.
    replacements: Vec<PathBuf>,
    /// File of true states that replaces the one named in the header.
    pub(super) truth_file: Option<PathBuf>,
}

impl OpenedHeader {
    pub(super) fn open(file: &Path, replacements: &[PathBuf]) -> Result<Self, Error> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::reading(file, e))?;
        check_kind(file, &text.as_bytes()[..text.len().min(START)])?;
        let remedy = |_: &str| "see the table of keys in docs/your-data.md".to_owned();
        let header: Header = host_unit::text::parse(file, &text, remedy)?;
        let read = Self {
            file: file.to_path_buf(),
            replacements: replacements.to_vec(),
            truth_file: None,
            header,
        };
        let most = 1 + usize::from(read.header.gnss.is_some());
        if replacements.len() > most {
            let problem = format!(
                "describes {most} of the {} files given with it",
                replacements.len()
            );
            let remedy =
                "give the file of the IMU, then that of the fixes if the header has [gnss]";
            return Err(read.bad("header", problem, remedy));
        }
        Ok(read)
    }

    /// The file of the IMU.
    pub(super) fn imu_file(&self) -> Result<PathBuf, Error> {
        let named = || Some(self.beside(self.header.imu.file.as_ref()?));
        self.replacements
            .first()
            .cloned()
            .or_else(named)
            .ok_or_else(|| {
                let problem = "is not in the header, and no file was given with it".to_owned();
                self.bad("imu.file", problem, "give the file of the IMU")
            })
    }

    /// The file of the fixes, if it is not that of the IMU.
    pub(super) fn gnss_file(&self, gnss: &Gnss) -> Option<PathBuf> {
        let named = || Some(self.beside(gnss.file.as_ref()?));
        self.replacements.get(1).cloned().or_else(named)
    }

    /// An error in `key`.
    pub(super) fn bad(&self, key: &str, problem: String, remedy: &str) -> Error {
        complain(&self.file, key, problem, remedy)
    }

    /// A path that the header names.
    pub(super) fn beside(&self, name: &Path) -> PathBuf {
        self.file.parent().unwrap_or(Path::new("")).join(name)
    }

    pub(super) fn value(
        &self,
        key: &str,
        name: &str,
        known: &[Unit],
    ) -> Result<(Kind, f64), Error> {
        let hit = known.iter().find(|u| u.0 == name);
        hit.map(|u| (u.1, u.2)).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|u| u.0).collect();
            self.bad(
                key,
                format!("has the unit '{name}'"),
                &format!("use one of {}", names.join(", ")),
            )
        })
    }

    /// The header with another file of the truth, which is relative to the current directory.
    pub(super) fn with_truth(mut self, file: Option<&Path>) -> Self {
        self.truth_file = file.map(Path::to_path_buf);
        self
    }

    /// Rotation of the samples: by `imu.axes` and `imu.mounting`, else by the unit's mounting.
    pub(super) fn turn(&self) -> Result<Turn, Error> {
        let imu = &self.header.imu;
        let axes = match &imu.axes {
            Some(text) => Axes::parse(text).map_err(|why| {
                let remedy = "give forward, right and down in axes of the file, \
                              as in 'y x -z' for right-forward-up";
                self.bad("imu.axes", format!("is '{text}' and {why}"), remedy)
            })?,
            None => Axes::FORWARD_RIGHT_DOWN,
        };
        let mounting = match (&imu.mounting, &imu.axes) {
            (Some(Turned::Axes(text)), _) => Some(Mounting {
                axes: Some(text.clone()),
                ..Mounting::default()
            }),
            (Some(Turned::Matrix(rows)), _) => Some(Mounting {
                matrix: Some(*rows),
                ..Mounting::default()
            }),
            (Some(Turned::Table(mounting)), _) => Some(mounting.clone()),
            (None, Some(_)) => None,
            (None, None) => Some(self.unit()?.map(|unit| unit.mounting).ok_or_else(|| {
                let problem = "is not given, nor a mounting or a unit".to_owned();
                let remedy = "give forward, right and down in axes of the file, \
                              as in 'y x -z' for right-forward-up";
                self.bad("imu.axes", problem, remedy)
            })?),
        };
        let mounting = mounting.map(|mounting| {
            let rotation = mounting.rotation();
            rotation.map_err(|f| self.bad(&format!("imu.{}", f.key), f.problem, &f.remedy))
        });
        Ok(Turn {
            axes,
            mounting: mounting.transpose()?,
        })
    }

    /// The unit that the header names.
    pub(super) fn unit(&self) -> Result<Option<host_unit::Unit>, Error> {
        let named = self.header.unit.as_deref();
        named
            .map(|name| host_unit::Unit::load_beside(name, &self.file))
            .transpose()
    }

    pub(super) fn separator(&self, key: &str, text: &str) -> Result<Separator, Error> {
        let mut chars = text.chars();
        match (text, chars.next(), chars.next()) {
            ("tab", ..) => Ok(Separator::Char(b'\t')),
            ("blank", ..) => Ok(Separator::Blank),
            (_, Some(c), None) if c.is_ascii() && !c.is_alphanumeric() && !"+-.".contains(c) => {
                Ok(Separator::Char(c as u8))
            }
            _ => {
                let remedy = "give one ASCII character such as ',' or ';', or 'tab', \
                              or 'blank' for any run of blanks";
                Err(self.bad(key, format!("is '{text}'"), remedy))
            }
        }
    }
}
