//! Names of the sensors, the navigation computers, and the activations of a run.

use host_core::error::Error;
use host_core::simulator::imu::ErrorModelName;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// Declares an enum whose variants have names on the command line and in files.
macro_rules! named {
    ($(#[$doc:meta])* $type:ident ($what:literal) { $($(#[$variant_doc:meta])* $variant:ident $name:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum $type {
            $($(#[$variant_doc])* $variant,)+
        }

        impl $type {
            /// All of them, in the order of the tables.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];

            /// Its name.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }
        }

        impl FromStr for $type {
            type Err = Error;

            fn from_str(text: &str) -> Result<Self, Error> {
                let found = Self::ALL.iter().find(|one| one.name() == text);
                let names: Vec<&str> = Self::ALL.iter().map(|one| one.name()).collect();
                found.copied().ok_or_else(|| Error::unknown($what, text, &names))
            }
        }

        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.name())
            }
        }
    };
}

named! {
    /// The sensor's true errors. The device and the navigation computer get the datasheet of its
    /// preset, which is right for [`Sensor::Errors`] and far too wide for [`Sensor::Perfect`].
    Sensor ("sensor") {
        /// White noise and quantisation only: any correction is wrong.
        Perfect "perfect",
        /// All errors of the preset: the group `all` of `campaign`.
        Errors "errors",
        /// The same with thermal and non-linear errors three times as large: `all-x3`.
        ErrorsX3 "errors-x3",
        /// All errors of the preset `mems`. It does not find north, so the navigation computer
        /// begins with a known heading.
        Mems "mems",
        /// White noise and quantisation of the preset `mems` only.
        MemsPerfect "mems-perfect",
        /// All errors of the preset `icm-42688`, a consumer sensor, judged after a minute. It does
        /// not find north either.
        Consumer "consumer",
        /// White noise and quantisation of the preset `icm-42688` only.
        ConsumerPerfect "consumer-perfect",
    }
}

impl Sensor {
    /// The unit whose datasheet is configured.
    #[must_use]
    pub fn preset(self) -> &'static str {
        match self {
            Self::Mems | Self::MemsPerfect => "mems",
            Self::Consumer | Self::ConsumerPerfect => "icm-42688",
            Self::Perfect | Self::Errors | Self::ErrorsX3 => "medium",
        }
    }

    /// Whether a navigation computer finds its heading at a standstill.
    #[must_use]
    pub fn finds_north(self) -> bool {
        self.preset() == "medium"
    }

    /// Time without fixes after which a navigation computer is judged at the latest, s.
    pub(super) fn judged_s(self) -> u32 {
        match self {
            Self::Consumer | Self::ConsumerPerfect => 60,
            _ => u32::MAX,
        }
    }

    /// The group of simulated errors.
    #[must_use]
    pub fn group(self) -> ErrorModelName {
        match self {
            Self::Perfect | Self::MemsPerfect | Self::ConsumerPerfect => ErrorModelName::Noise,
            Self::Errors | Self::Mems | Self::Consumer => ErrorModelName::All,
            Self::ErrorsX3 => ErrorModelName::AllX3,
        }
    }
}

named! {
    /// The navigation computer behind the device.
    Computer ("computer") {
        /// Estimates attitude, velocity and position, without sensor errors.
        Plain "plain",
        /// Estimates six biases too: 15 states.
        Biases "biases",
        /// Estimates biases and scale factors as Gauss-Markov processes: 21 states, set up as
        /// KF-GINS is.
        GaussMarkov "gauss-markov",
    }
}

named! {
    /// When the learnt networks correct the samples.
    Activation ("activation") {
        /// In the drive in which they are learnt, faded in.
        Live "live",
        /// From the first sample of the next drive on, unchanged. That drive has no fixes after its
        /// standstill.
        NextPowerOn "next-power-on",
        /// The same, but the navigation computer has fixes for as long as in the drive before.
        NextPowerOnAided "next-power-on-aided",
        /// As [`Activation::NextPowerOn`], and the gyros' errors that the first rest shows. The
        /// device remembers the drive before.
        FirstRest "first-rest",
        /// The same with a device that remembers nothing.
        FirstRestNew "first-rest-new",
    }
}

impl Activation {
    /// Whether the first rest after power-on corrects.
    #[must_use]
    pub fn rests(self) -> bool {
        matches!(self, Self::FirstRest | Self::FirstRestNew)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_back<T>(all: &[T])
    where
        T: Copy + PartialEq + fmt::Debug + fmt::Display + Serialize + FromStr<Err = Error>,
    {
        for one in all {
            assert_eq!(one.to_string().parse::<T>().unwrap(), *one);
            assert_eq!(serde_json::to_string(one).unwrap(), format!("\"{one}\""));
        }
    }

    #[test]
    fn names_read_back_and_a_wrong_one_is_reported() {
        read_back(Sensor::ALL);
        read_back(Computer::ALL);
        read_back(Activation::ALL);
        let error = "perfekt".parse::<Sensor>().unwrap_err().to_string();
        assert!(error.contains("did you mean 'perfect'"), "{error}");
    }
}
