//! A group of a campaign's rows: which errors the sensors have, which the fixes have, and whether
//! the schemes are told of them.

use host_core::error::Error;
use host_core::simulator::imu::ErrorModelName;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// What the fixes of a group suffer from. The sizes are in `campaign/causes.rs`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum FixErrors {
    /// What the scenario says.
    #[default]
    AsInScenario,
    /// Errors that last, as large as a receiver in a town has them.
    Coloured,
    /// White noise larger than the receiver tells.
    Optimistic,
    /// They arrive late.
    Late,
    /// They are those of an antenna that is not at the IMU.
    LeverArm,
    /// There are times without them.
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

    /// Name in the name of a group.
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
    /// Whether the schemes are told how large the cause is: a single cause of the sensors, or that
    /// of the fixes.
    pub told: bool,
}

/// How the name of a group ends whose schemes are told of its cause.
const TOLD: &str = "told";

impl Group {
    /// The group itself, or that of `other` if its schemes are told.
    #[must_use]
    pub fn untold(self) -> Self {
        Self {
            told: false,
            ..self
        }
    }

    /// The same, and the schemes are told of the cause.
    #[must_use]
    pub fn told(self) -> Self {
        Self { told: true, ..self }
    }

    /// Whether there is anything to tell. A fix that does not come tells of a gap, and no datasheet
    /// has a bias for what remains of dither.
    #[must_use]
    pub fn can_be_told(self) -> bool {
        let (sensors, fixes) = (self.sensors, self.fixes);
        let single = ErrorModelName::CAUSES.contains(&sensors) && sensors != ErrorModelName::Dither;
        single || ![FixErrors::AsInScenario, FixErrors::Gaps].contains(&fixes)
    }

    /// The groups of some rows, each once, in the order of the tables.
    #[must_use]
    pub fn present(of: impl Iterator<Item = Self>) -> Vec<Self> {
        let mut groups: Vec<Self> = of.collect();
        groups.sort_by_key(|group| group.rank());
        groups.dedup();
        groups
    }

    /// Position in tables: errors of fixes, then of sensors, then whether told.
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
        let told = if self.told { TOLD } else { "" };
        let parts = [sensors, self.fixes.name(), told];
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
        if group.told && !group.can_be_told() {
            return Err(Error::Option {
                option: format!("group of errors '{text}'"),
                problem: "there is no single cause in it that can be told".into(),
                remedy: "leave +told out, or give a cause whose size somebody can know".into(),
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
            let told = [alone].into_iter().chain(fixes).map(Group::told);
            let told = told.filter(|group| group.can_be_told());
            for group in [alone].into_iter().chain(fixes).chain(told) {
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
        // six kinds and 22 causes, each with six causes of fixes or without; all but gaps and
        // dither can be told
        let told = 28 * 5 + 2 * 21;
        assert_eq!((names.len(), all), (28 * 7 + told, 28 * 7 + told));
        let late: Group = "late-fixes".parse().unwrap();
        assert_eq!(late, FixErrors::Late.into());
        assert_eq!("linear+late-fixes".parse::<Group>().unwrap(), late);
        assert_eq!(late.told().to_string(), "late-fixes+told");
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
