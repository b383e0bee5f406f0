//! The unit files that come with the program: commented TOML, each number with its source.

use super::{Unit, schema};

macro_rules! presets {
    ($($name:literal,)+) => {
        /// Names and texts of the presets.
        pub const PRESETS: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../assets/units/", $name, ".toml"))),)+
        ];
    };
}

presets! {
    "medium",
    "nav",
    "tactical",
    "adis16495",
    "adis16505",
    "fog",
    "fog-mems",
    "hg1700",
    "hg4930",
    "hg9900",
    "icm-42688",
    "kitti",
    "kvh1750",
    "kvh1775",
    "ld-a15",
    "mems",
    "mti-10",
    "stim300",
    "vn-100",
}

/// Names of the presets.
#[must_use]
pub fn names() -> Vec<&'static str> {
    PRESETS.iter().map(|(name, _)| *name).collect()
}

/// The text of a preset as a user's file, which refers to the schema beside it.
#[must_use]
pub fn text(name: &str) -> Option<String> {
    let (_, text) = PRESETS.iter().find(|(known, _)| *known == name)?;
    let (_, rest) = text.split_once('\n')?;
    Some(format!("#:schema {}\n{rest}", schema::FILE))
}

/// Title of a preset: its first comment line.
#[must_use]
pub fn title(text: &str) -> &str {
    let mut lines = text.lines().filter_map(|line| line.strip_prefix("# "));
    lines.next().unwrap_or_default()
}

impl Unit {
    /// A preset by its name, if there is one.
    #[must_use]
    pub fn preset(name: &str) -> Option<Self> {
        let (_, text) = PRESETS.iter().find(|(known, _)| *known == name)?;
        toml::from_str(text).ok()
    }
}
