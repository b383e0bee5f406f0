//! The terms of the pages, each explained once at its first use.

use super::text::unbroken;
use firmware::learn::bank::{KEYS, NAMES};
use maud::{Markup, html};
use std::borrow::Cow;

/// Explanation of a scheme. `None` for an unknown name.
pub(super) fn scheme(name: &str) -> Option<Cow<'static, str>> {
    if let Some(meaning) = of_name(name) {
        return Some(meaning.into());
    }
    if let Some(filter) = name.strip_suffix("-tuned") {
        let text = "with the random walk of its errors that was best on other units";
        return Some(format!("{filter} {text}").into());
    }
    if let Some(filter) = name.strip_suffix("-memory-frozen") {
        let text = "remembers, taken off the samples from power-on. Nothing of the judged drive \
                    teaches it";
        return Some(format!("what {filter}-memory {text}").into());
    }
    if let Some(filter) = name.strip_suffix("-memory") {
        let text = "that remembers over power-off what earlier drives of the unit have taught it";
        return Some(format!("{filter} {text}").into());
    }
    if let Some(filter) = name.strip_suffix("-tight") {
        let text = "that remembers a unit as real ones are: from one power-on to the next it hardly \
                    moves, unless the fixes show that it has stepped";
        return Some(format!("{filter} {text}").into());
    }
    part_of_the_bank(name)
        .or_else(|| after_drives(name))
        .map(Cow::from)
}

/// Explanation of the device of the paper's experiment.
fn after_drives(name: &str) -> Option<String> {
    let drives: u32 = name.strip_prefix("device-")?.parse().ok()?;
    let earlier = if drives == 1 { "drive" } else { "drives" };
    Some(format!(
        "the device after {drives} earlier {earlier} with fixes. What it has learnt there corrects \
         from power-on, as far as it has proved itself: in rehearsals, which are stretches of \
         navigation without fixes, it came closer to the fixes than no correction did. In the \
         judged drive it learns nothing"
    ))
}

/// Explanation of a scheme that is no variant of another.
fn of_name(name: &str) -> Option<&'static str> {
    Some(match name {
        "raw" => "the samples as the IMU gives them, without any correction",
        "uncorrected" => "no correction either, but its start comes from a filter aided by fixes",
        "ls-bias" => "a constant bias of each axis, fitted to the teacher by least squares",
        "ls-3x3" => {
            "the same, and with it a matrix of scale factors and misalignments for the gyros and \
             one for the accelerometers"
        }
        "ekf6" => "the classical filter: an extended Kalman filter that estimates six biases",
        "ekf12" => "the classical filter with six biases and six scale factors",
        "ekf24" => {
            "the classical filter with six biases and both matrices of scale factors and \
             misalignments"
        }
        "ekf-ramp" => "the classical filter with six biases that grow evenly with time",
        "ekf-exp" => {
            "four classical filters, of biases alone and of biases with exponentials of the time \
             since power-on. The one that has predicted the fixes best is used"
        }
        "ekf-temp" => {
            "classical filters of biases alone and of biases with laws of the temperature of the \
             sensor. The one that has predicted the fixes best is used"
        }
        "ekf-inputs" => "ekf-temp that also has a law of the vibration of the second before",
        "rnn" => {
            "two small recurrent neural networks, one for the gyros and one for the \
             accelerometers, fitted to the teacher. Their output contains the constant bias, so \
             what they add to it is the difference from ls-bias"
        }
        "rnn-window" => {
            "two small recurrent neural networks, fitted to the smoothed drive with fixes. They \
             are used only if they prove themselves on fixes that were held back"
        }
        "device" => {
            "the device: its firmware's own application, with the configuration of the unit. \
             Several candidates learn from satellite fixes by Kalman filters: constant biases, and \
             networks. One must prove itself: in rehearsals, which are stretches of navigation \
             without fixes, it came closer to the fixes than no correction did. What has proved \
             itself is stored, and corrects from the next power-on on. Until then \
             nothing is corrected"
        }
        "device-first-rest" => {
            "the device with activation first-rest: as device, and the gyros' errors that the \
             first rest after power-on shows as well"
        }
        "rest" => "the mean rate of the gyros over the standstill, less the Earth's, taken off",
        "last" => "the biases that ekf6 had at the end of the drive before, taken off",
        "zupt" => {
            "ekf6 that goes on as a filter without fixes and takes the velocity at the stops of \
             the drive as zero"
        }
        "limit" => {
            "cannot be built: it knows the errors that this unit has at every turn-on, and a \
             filter estimates what is new at this one"
        }
        "oracle" => {
            "cannot be built: a filter that knows which errors are simulated, their exact \
             statistics, and the exact temperature and magnetic field"
        }
        "floor" => "cannot be built: the scheme uncorrected on an IMU that has white noise only",
        _ => return None,
    })
}

/// Explanation of the learner with only some of its candidates, as in `campaign --ablation`.
fn part_of_the_bank(name: &str) -> Option<String> {
    const LEARNER: &str = "not the device, but its learner alone, whose result corrects at once,";
    let named = |key: &str| Some(NAMES[KEYS.iter().position(|known| *known == key)?]);
    if name == "learner" {
        return Some("the device's learner alone, whose result corrects at once".into());
    }
    if name == "no-networks" {
        return Some(format!("{LEARNER} without its networks"));
    }
    if let Some(key) = name.strip_prefix("only-") {
        let (text, of) = (
            "with one candidate, used whatever speaks for it",
            named(key)?,
        );
        return Some(format!("{LEARNER} {text}: {of}"));
    }
    let key = name.strip_prefix("no-")?;
    Some(format!("{LEARNER} without one candidate: {}", named(key)?))
}

/// Explanations of the terms of a comparison of schemes in free-inertial navigation, and of each
/// scheme.
pub(super) fn terms<'a>(names: impl Iterator<Item = &'a str>) -> Markup {
    html! {
        p {
            "A strapdown navigator adds up the rotation and the acceleration that an inertial "
            "measurement unit (IMU) gives. In " b { "free-inertial navigation" } " it has nothing "
            "else, no satellite fixes for instance, so the errors of the gyros and accelerometers "
            "grow into errors of position. Each " b { "scheme" } " corrects the samples of the IMU "
            "in its own way before they are added up. It has learnt the correction from a "
            b { "teacher" } ": a navigator aided by satellite fixes, which finds the errors of "
            "the sensors from the errors of its position. The " b { "reference" } " that the "
            "results are compared with is the true motion in a simulation, and the best solution "
            "at hand for a recording."
        }
        (schemes(names))
    }
}

/// The explanations of the schemes, as sentences.
pub(super) fn sentences<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let known = known(names).into_iter();
    known
        .map(|(name, meaning)| format!("{name}: {meaning}."))
        .collect()
}

/// Each known scheme once, with its explanation.
fn known<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, Cow<'static, str>)> {
    let mut known: Vec<(&str, Cow<'_, str>)> = vec![];
    for (name, meaning) in names.filter_map(|name| Some((name, scheme(name)?))) {
        if known.iter().all(|(there, _)| *there != name) {
            known.push((name, meaning));
        }
    }
    known
}

/// Explanations of the schemes.
pub(super) fn schemes<'a>(names: impl Iterator<Item = &'a str>) -> Markup {
    html! {
        dl.terms {
            @for (name, meaning) in known(names) {
                div { dt { (unbroken(name)) } dd { (unbroken(&meaning)) "." } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_lab::campaign::{SCHEMES, ablations};

    #[test]
    fn each_scheme_is_explained_once_and_an_unknown_one_left_out() {
        let text = terms(["raw", "rnn", "raw", "mine"].into_iter()).into_string();
        assert_eq!(text.matches("<dt>").count(), 2);
        assert!(text.contains("<dt>raw</dt>") && !text.contains("mine"));
    }

    #[test]
    fn each_scheme_of_a_campaign_is_explained_in_words_of_its_own() {
        let names = SCHEMES.iter().map(|(name, _)| (*name).to_owned());
        let names = names.chain(ablations().map(|(name, _)| name));
        let mut said: Vec<_> = names
            .chain(["floor".to_owned()])
            .map(|name| scheme(&name).unwrap_or_else(|| panic!("no words for {name}")))
            .collect();
        let all = said.len();
        said.sort();
        said.dedup();
        assert_eq!(said.len(), all);
        assert_eq!(scheme("only-nonsense"), None);
        let [one, four] = ["device-1", "device-4"].map(|name| scheme(name).unwrap());
        assert!(one.contains("after 1 earlier drive with") && four.contains("4 earlier drives"));
        assert_eq!(scheme("device-x"), None);
    }
}
