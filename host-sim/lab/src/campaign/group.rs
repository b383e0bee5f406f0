//! A group of a campaign's rows: the errors of the sensors, those of the fixes, and whether the
//! schemes know their size.

use host_core::error::Error;
use host_core::simulator::imu::ErrorModelName;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Errors of the fixes of a group. The sizes are in `campaign/causes.rs`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum FixErrors {
    /// The errors of the scenario's receiver.
    #[default]
    AsInScenario,
    /// Coloured noise, as large as that of a receiver in a town.
    Coloured,
    /// White noise larger than the receiver reports.
    Optimistic,
    /// Fixes arrive late.
    Late,
    /// The antenna is not at the IMU.
    LeverArm,
    /// There are gaps without fixes.
    Gaps,
    /// Bursts of multipath.
    Multipath,
}

impl FixErrors {
    /// All causes, in the order of the tables.
    pub const CAUSES: [Self; 6] = [
        Self::Coloured,
        Self::Optimistic,
        Self::Late,
        Self::LeverArm,
        Self::Gaps,
        Self::Multipath,
    ];

    /// Its part of a group's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AsInScenario => "",
            Self::Coloured => "coloured-fixes",
            Self::Optimistic => "optimistic-fixes",
            Self::Late => "late-fixes",
            Self::LeverArm => "lever-arm",
            Self::Gaps => "gaps",
            Self::Multipath => "multipath",
        }
    }
}

/// A group. Its name on the command line and in files has up to three parts with `+` between them:
/// the errors of the sensors (without them `linear`), those of the fixes, and `told`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Group {
    /// Errors of the sensors.
    pub sensors: ErrorModelName,
    /// Errors of the fixes.
    pub fixes: FixErrors,
    /// Whether the schemes know how large the cause is: a single cause of the sensors, or that of
    /// the fixes. The name of this field is part of a campaign's fingerprint.
    pub told: bool,
}

/// Last part of the name of a group whose schemes know the size of its cause.
const TOLD: &str = "told";

impl Group {
    /// The same group, whose schemes know the size of the cause.
    #[must_use]
    pub fn with_known_cause(self) -> Self {
        Self { told: true, ..self }
    }

    /// Whether the schemes can know the size of the cause. A gap shows by itself, and no datasheet
    /// states a bias for the residual of dither.
    #[must_use]
    pub fn can_be_known(self) -> bool {
        let (sensors, fixes) = (self.sensors, self.fixes);
        let single = ErrorModelName::CAUSES.contains(&sensors) && sensors != ErrorModelName::Dither;
        single || ![FixErrors::AsInScenario, FixErrors::Gaps].contains(&fixes)
    }

    /// Whether the biases of a unit step between its drives, so that the judged drive depends on
    /// their number.
    #[must_use]
    pub fn steps(&self) -> bool {
        self.sensors == ErrorModelName::Real
    }

    /// The groups of some rows, each once, in the order of the tables.
    #[must_use]
    pub fn present(of: impl Iterator<Item = Self>) -> Vec<Self> {
        let mut groups: Vec<Self> = of.collect();
        groups.sort_by_key(|group| group.rank());
        groups.dedup();
        groups
    }

    /// Position in tables: by errors of fixes, then by those of sensors, then by whether the cause
    /// is known.
    #[must_use]
    pub fn rank(self) -> (FixErrors, usize, bool) {
        let sensors = ErrorModelName::every().position(|m| m == self.sensors);
        (self.fixes, sensors.unwrap_or(0), self.told)
    }
}

impl From<ErrorModelName> for Group {
    fn from(sensors: ErrorModelName) -> Self {
        Self {
            sensors,
            fixes: FixErrors::AsInScenario,
            told: false,
        }
    }
}

impl From<FixErrors> for Group {
    fn from(fixes: FixErrors) -> Self {
        Self {
            fixes,
            ..ErrorModelName::Linear.into()
        }
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let alone = self.fixes == FixErrors::AsInScenario;
        let sensors = match self.sensors {
            ErrorModelName::Linear if !alone => "",
            other => other.name(),
        };
        let suffix = if self.told { TOLD } else { "" };
        let parts = [sensors, self.fixes.name(), suffix];
        let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        f.pad(&parts.join("+"))
    }
}

impl FromStr for Group {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let mut group = Self::from(ErrorModelName::Linear);
        let (mut sensors, mut rest) = (None, text);
        if let Some(before) = text.strip_suffix(TOLD).and_then(|t| t.strip_suffix('+')) {
            (group.told, rest) = (true, before);
        }
        for part in rest.split('+') {
            let fixes = FixErrors::CAUSES.iter().find(|f| f.name() == part);
            match fixes {
                Some(fixes) if group.fixes == FixErrors::AsInScenario => group.fixes = *fixes,
                None if sensors.is_none() && group.fixes == FixErrors::AsInScenario => {
                    sensors = Some(part.parse().map_err(|_| unknown(part))?);
                }
                _ => return Err(unknown(text)),
            }
        }
        group.sensors = sensors.unwrap_or(ErrorModelName::Linear);
        if group.told && !group.can_be_known() {
            return Err(Error::Option {
                option: format!("group of errors '{text}'"),
                problem: "has no single cause whose size can be known".into(),
                remedy: "leave +told out, or give a cause whose size can be known".into(),
            });
        }
        Ok(group)
    }
}

fn unknown(text: &str) -> Error {
    let sensors = ErrorModelName::every().map(ErrorModelName::name);
    let known: Vec<&str> = sensors
        .chain(FixErrors::CAUSES.map(FixErrors::name))
        .collect();
    Error::unknown("group of errors", text, &known)
}

impl TryFrom<String> for Group {
    type Error = Error;

    fn try_from(text: String) -> Result<Self, Error> {
        text.parse()
    }
}

impl From<Group> for String {
    fn from(group: Group) -> Self {
        group.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_group_has_a_name_of_its_own() {
        let mut names = Vec::new();
        for sensors in ErrorModelName::every() {
            let alone = Group::from(sensors);
            assert_eq!(alone.to_string(), sensors.name());
            let fixes = FixErrors::CAUSES.map(|fixes| Group { fixes, ..alone });
            let known = [alone]
                .into_iter()
                .chain(fixes)
                .map(Group::with_known_cause);
            let known = known.filter(|group| group.can_be_known());
            for group in [alone].into_iter().chain(fixes).chain(known) {
                let name = group.to_string();
                assert_eq!(name.parse::<Group>().unwrap(), group, "{name}");
                assert_eq!(
                    serde_json::to_string(&group).unwrap(),
                    format!("\"{name}\"")
                );
                names.push(name);
            }
        }
        let all = names.len();
        names.sort();
        names.dedup();
        // seven kinds and 22 causes, each with six causes of fixes or without; all but gaps and
        // dither can be known
        let known = 29 * 5 + 2 * 21;
        assert_eq!((names.len(), all), (29 * 7 + known, 29 * 7 + known));
        let late: Group = "late-fixes".parse().unwrap();
        assert_eq!(late, FixErrors::Late.into());
        assert_eq!("linear+late-fixes".parse::<Group>().unwrap(), late);
        assert_eq!(late.with_known_cause().to_string(), "late-fixes+told");
        assert_eq!(
            "noise+gaps".parse::<Group>().unwrap().to_string(),
            "noise+gaps"
        );
    }

    #[test]
    fn what_is_no_group_is_refused() {
        for wrong in [
            "",
            "told",
            "all+told",
            "gaps+told",
            "late-fixes+noise",
            "noise+linear",
            "gaps+gaps",
            "noise+",
            "hysteresis+told+told",
        ] {
            let error = wrong.parse::<Group>().unwrap_err().to_string();
            assert!(error.contains("group of errors"), "{wrong}: {error}");
        }
    }
}
