//! The sentence on the device. Terminal, JSON and pages share it.

use super::{Against, against, metres};
use host_estimation::learning::device::Course;

/// The device beside no correction, after one drive or several.
#[derive(Debug, Clone, Default)]
pub(crate) struct Device {
    /// Where the errors are taken: `after 22 min without fixes`.
    pub after: String,
    /// Its error and that without a correction, m; medians of several.
    pub metres: [f64; 2],
    /// Several drives.
    pub several: Option<Several>,
    /// Why it corrects nothing. `None`: it corrects.
    pub waits: Option<String>,
    /// Earlier times at which it was worse, and both errors then, m.
    pub earlier: Vec<(String, [f64; 2])>,
}

/// The quotient of both errors over several drives.
#[derive(Debug, Clone)]
pub(crate) struct Several {
    /// Its median.
    pub ratio: f64,
    /// What is known of it, as `95 % interval 0.3 to 0.6 over 20 runs`.
    pub between: String,
    /// What is decided.
    pub decided: Effect,
}

/// Effect of a correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effect {
    Helps,
    Harms,
    /// The difference does not count, or is not decided.
    Open,
}

impl Device {
    /// Whether the corrections help or harm.
    pub fn effect(&self) -> Effect {
        let [with, without] = self.metres;
        match (&self.several, against(with, without)) {
            (Some(several), _) => several.decided,
            (None, Against::Better) => Effect::Helps,
            (None, Against::Worse) => Effect::Harms,
            (None, Against::Same) => Effect::Open,
        }
    }

    /// The sentence.
    pub fn sentence(&self) -> String {
        let (after, [with, without]) = (&self.after, self.metres);
        let [with_m, without_m] = [with, without].map(metres);
        if let Some(why) = &self.waits {
            let error = match self.several {
                Some(_) => "the same",
                None => &without_m,
            };
            return format!(
                "Verdict: the device does nothing, because {why}. The error {after} is {error} \
                 with it and without."
            );
        }
        let (ratio, errors) = match &self.several {
            Some(of) => (
                of.ratio,
                format!(
                    "the error {after} is {} times the uncorrected one ({})",
                    times(of.ratio),
                    of.between
                ),
            ),
            None => (
                with / without,
                format!("the error {after} is {with_m} instead of {without_m}"),
            ),
        };
        let verdict = match (self.effect(), self.several.is_some()) {
            (Effect::Helps, _) => format!("the device helps by {}", by(ratio)),
            (Effect::Harms, _) => format!("the device harms by {}", by(ratio)),
            (Effect::Open, false) => "the device makes no difference that counts".to_owned(),
            (Effect::Open, true) => "it is not shown that the device helps or harms".to_owned(),
        };
        format!("Verdict: {verdict}: {errors}.{}", self.before())
    }

    fn before(&self) -> String {
        let each = self.earlier.iter().map(|(at, [with, without])| {
            format!("{at} ({} instead of {})", metres(*with), metres(*without))
        });
        match each.collect::<Vec<_>>().as_slice() {
            [] => String::new(),
            all => format!(" Before the end it was worse: at {}.", all.join(", at ")),
        }
    }
}

/// A quotient of two errors.
pub(crate) fn times(ratio: f64) -> String {
    match ratio {
        r if r > 0.0 && r < 0.1 => format!("{r:.3}"),
        r if r < 10.0 => format!("{r:.2}"),
        r => format!("{r:.0}"),
    }
}

/// How far a quotient is from one.
fn by(ratio: f64) -> String {
    match 100.0 * (ratio - 1.0) {
        percent if percent > 100.0 => format!("a factor of {}", times(ratio)),
        percent => format!("{:.0} %", percent.abs()),
    }
}

/// Why a device corrected nothing, and what it waits for.
pub(crate) fn waits(course: Option<&Course>) -> String {
    let Some(course) = course else {
        return "no correction is in force".to_owned();
    };
    if let Some(nearest) = course.nearest.as_ref().filter(|_| course.is_proving()) {
        return format!(
            "nothing is proved yet: \"{}\" is nearest, proof {} of 100, {}",
            nearest.name,
            nearest.proof,
            nearest.pace()
        );
    }
    let learnt = course.says.split_once("; ").map_or("", |(_, rest)| rest);
    match learnt {
        "" => "no correction is in force".to_owned(),
        learnt => format!("it {learnt}"),
    }
}
