//! Columns that say whether a line holds a fix.

use super::header::Valid;
use crate::recordings::table::DENIED;

/// Names of columns whose value 0 means no fix, in small letters: qualities of a fix, numbers of
/// satellites.
const ZERO: [&str; 16] = [
    "numsv",
    "num_sv",
    "satellites",
    "num_satellites",
    "nsat",
    "sats",
    "fix",
    "fix_quality",
    "fix_ok",
    "fix_valid",
    "gps_fix",
    "gps_valid",
    "valid",
    "quality",
    "gps_quality",
    "gpsqual",
];
/// Ends of the names of types of a fix. Below 2 there is none: 1 is "no fix" or dead reckoning.
const TYPE: [&str; 4] = ["fix_type", "fixtype", "fix type", "gps_type"];
const LEAST_TYPE: f64 = 2.0;
/// Names of dilutions of precision. Receivers give 99 or more where they have no fix.
const DILUTION: [&str; 4] = ["hdop", "pdop", "gps_hdop", "gps_pdop"];
const NO_DILUTION: f64 = 99.0;
/// Names of accuracies. Autopilots give 9999, or all bits, where there is no fix.
const ACCURACY: [&str; 2] = ["eph", "gps_eph"];
const NO_ACCURACY: f64 = 9999.0;
/// Ends of the names of columns whose negative values mean no fix, as in ROS's `NavSatStatus`.
const NEGATIVE: [&str; 2] = ["status", "fix_status"];

/// A column with the range of values of a fix.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quality {
    /// Name of the column.
    pub(super) column: String,
    least: f64,
    /// Below this value; `most` of the header includes it.
    below: f64,
    most: f64,
    /// Whether the header names it.
    given: bool,
}

impl Quality {
    /// By the header.
    pub(super) fn given(valid: &Valid) -> Self {
        Self {
            column: valid.column.clone(),
            least: valid.least.unwrap_or(f64::MIN),
            below: f64::INFINITY,
            most: valid.most.unwrap_or(f64::MAX),
            given: true,
        }
    }

    /// The columns of a file whose names say what they are.
    pub(super) fn known(names: &[String]) -> impl Iterator<Item = Self> {
        names.iter().filter_map(|name| {
            let small = name.trim().to_ascii_lowercase();
            let (least, below) = match small.as_str() {
                name if ZERO.contains(&name) => (f64::MIN_POSITIVE, f64::INFINITY),
                name if TYPE.iter().any(|end| name.ends_with(end)) => (LEAST_TYPE, f64::INFINITY),
                name if DILUTION.contains(&name) => (f64::MIN, NO_DILUTION),
                name if ACCURACY.contains(&name) => (f64::MIN, NO_ACCURACY),
                name if NEGATIVE.iter().any(|end| name.ends_with(end)) => (0.0, f64::INFINITY),
                _ => return None,
            };
            Some(Self {
                column: name.clone(),
                least,
                below,
                most: f64::MAX,
                given: false,
            })
        })
    }

    /// Why a value means that there is no fix; `None` if it does not.
    pub(super) fn denies(&self, value: f64) -> Option<String> {
        let fits = (self.least..=self.most).contains(&value) && value < self.below;
        // without a value only the header's columns mean that there is none
        let denied = if value.is_nan() { self.given } else { !fits };
        denied.then(|| match value {
            DENIED => format!("'{}' says that there is none", self.column),
            value if value.is_nan() => format!("'{}' is empty", self.column),
            value => format!("'{}' is {value}", self.column),
        })
    }

    /// Whether the header names the column.
    pub(super) fn is_given(&self) -> bool {
        self.given
    }
}
