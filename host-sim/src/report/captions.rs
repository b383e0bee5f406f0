//! Headings and captions of the pictures.

use super::figures::{Figure, length};
use crate::experiment::results::{Curve, Report};

/// Heading of a picture.
pub(super) fn heading(figure: Figure) -> &'static str {
    match figure {
        Figure::Error => "Horizontal error over time",
        Figure::Track => "Track",
        Figure::Errors => "Sensor errors and the output of the networks",
        Figure::Learning => "Learning",
    }
}

/// What a picture shows, with figures from its data.
pub(super) fn caption(figure: Figure, report: &Report) -> String {
    match figure {
        Figure::Error => error_caption(&report.error_over_time),
        Figure::Track => "Seen from above, with the same scale in both directions. The broad \
                          line is the reference; dots mark where the tracks end."
            .to_owned(),
        Figure::Errors => sensor_caption(report),
        Figure::Learning => learning_caption(&report.learning),
    }
}

fn error_caption(curves: &[Curve]) -> String {
    let worst = |curve: &Curve| {
        let finite = curve.y.iter().copied().filter(|error| error.is_finite());
        finite.fold(0.0, f64::max)
    };
    let span = curves.iter().map(worst).fold(0.0, f64::max);
    let part = |curve: &Curve| format!("{} {}", curve.name, length(worst(curve), span));
    let parts: Vec<String> = curves.iter().map(part).collect();
    format!(
        "Distance between each scheme's position and the reference. Largest: {}.",
        parts.join(", ")
    )
}

fn sensor_caption(report: &Report) -> String {
    let known = report.traces.iter().any(|trace| !trace.truth.is_empty());
    let taught = report
        .traces
        .iter()
        .any(|trace| trace.teacher.iter().any(|value| value.is_finite()));
    let mut text = String::from(if known {
        "Output of the networks and true error of each sensor, on the drive that was learnt from. \
         The true error is a median over one minute: in turns, scale factor and misalignment give \
         short peaks that would hide the rest."
    } else {
        "Output of the networks for each sensor; the true error of recorded data is unknown."
    });
    if taught {
        text += " Dots are some of the errors that the teacher gave while learning; dots beyond a \
                 panel's range are not drawn.";
    }
    text + " A flat line is a constant bias. Each panel has its own scale."
}

fn learning_caption(curves: &[Curve]) -> String {
    let ends: Vec<String> = curves
        .iter()
        .filter_map(|curve| {
            Some(format!(
                "{} {} to {}",
                curve.name,
                three_figures(*curve.y.first()?),
                three_figures(*curve.y.last()?)
            ))
        })
        .collect();
    if ends.is_empty() {
        return "No network was trained in this run.".to_owned();
    }
    format!(
        "The cost that learning makes smaller, mostly the squared difference from the teacher, \
         after each pass over the data; dashed on data held back from learning. First to last: {}.",
        ends.join("; ")
    )
}

fn three_figures(value: f64) -> String {
    let decimals = 2.0 - value.abs().max(1e-300).log10().floor();
    if (0.0..=5.0).contains(&decimals) {
        format!("{value:.0$}", decimals as usize)
    } else {
        format!("{value:.2e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_have_three_figures() {
        assert_eq!(
            [1.0023, 0.05017, 123.4, 1234.5, 1.5e-9].map(three_figures),
            ["1.00", "0.0502", "123", "1.23e3", "1.50e-9"]
        );
    }
}
