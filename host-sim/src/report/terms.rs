//! The terms of the pages, each explained once at its first use.

use super::text::unbroken;
use maud::{Markup, html};

/// What a scheme is; `None` for a name that is not known.
fn scheme(name: &str) -> Option<&'static str> {
    Some(match name {
        "raw" => "the samples as the IMU gives them, without any correction",
        "none" => "no correction either, but its start comes from a filter aided by fixes",
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
        "rnn" => {
            "two small recurrent neural networks, one for the gyros and one for the \
             accelerometers, fitted to the teacher. Their output contains the constant bias, so \
             what they add to it is the difference from ls-bias"
        }
        "rnn-kalman" => {
            "several candidates, which learn from satellite fixes by Kalman filters: no \
             correction, constant biases, and networks. The one in force is the one that has \
             predicted the fixes best, and that can be the biases alone"
        }
        _ => return None,
    })
}

/// The terms of a comparison of schemes in free-inertial navigation, and what each scheme is.
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

/// The same of the schemes in sentences.
pub(super) fn sentences<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let known = known(names).into_iter();
    known
        .map(|(name, meaning)| format!("{name}: {meaning}."))
        .collect()
}

/// Each scheme once, with what it is.
fn known<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, &'static str)> {
    let mut known: Vec<(&str, &str)> = vec![];
    for (name, meaning) in names.filter_map(|name| Some((name, scheme(name)?))) {
        if known.iter().all(|(there, _)| *there != name) {
            known.push((name, meaning));
        }
    }
    known
}

/// What each of the schemes is.
pub(super) fn schemes<'a>(names: impl Iterator<Item = &'a str>) -> Markup {
    html! {
        dl.terms {
            @for (name, meaning) in known(names) {
                div { dt { (unbroken(name)) } dd { (unbroken(meaning)) "." } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_scheme_is_explained_once_and_an_unknown_one_left_out() {
        let text = terms(["raw", "rnn", "raw", "mine"].into_iter()).into_string();
        assert_eq!(text.matches("<dt>").count(), 2);
        assert!(text.contains("<dt>raw</dt>") && !text.contains("mine"));
    }
}
