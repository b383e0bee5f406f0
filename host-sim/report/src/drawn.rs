//! The pictures of an experiment, drawn, with their captions.

use super::figures::{Figure, length};
use host_core::error::Error;
use host_lab::experiment::results::{Curve, Curves, ErrorTrace};
use rayon::prelude::*;

/// A figure for the page and the directory.
#[derive(Debug, Clone)]
pub(super) struct Drawn {
    pub figure: Figure,
    pub caption: String,
    /// An `<svg>` element.
    pub svg: String,
    /// A PNG file.
    pub png: Vec<u8>,
}

/// All figures of an experiment, in the order of the page. `unit`: that of the times of the errors.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn draw(curves: &Curves, unit: &str) -> Result<Vec<Drawn>, Error> {
    let figures = Figure::ALL.into_par_iter();
    figures.map(|figure| one(figure, curves, unit)).collect()
}

fn one(figure: Figure, curves: &Curves, unit: &str) -> Result<Drawn, Error> {
    let picture = figure.picture(curves, unit);
    let (svg, png) = rayon::join(
        || picture.svg(figure.file(), figure.heading()),
        || picture.png(figure.file()),
    );
    Ok(Drawn {
        figure,
        caption: caption(figure, curves),
        svg: svg?,
        png: png?,
    })
}

/// The caption of a picture, with numbers from its data.
pub(super) fn caption(figure: Figure, curves: &Curves) -> String {
    match figure {
        Figure::Error => error_caption(&curves.error_over_time),
        Figure::Track => "Seen from above, with the same scale in both directions. The broad \
                          line is the reference; dots mark where the tracks end."
            .to_owned(),
        Figure::Errors => sensor_caption(&curves.traces),
        Figure::Learning => learning_caption(&curves.learning),
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

fn sensor_caption(traces: &[ErrorTrace]) -> String {
    let known = traces.iter().any(|trace| !trace.truth.is_empty());
    let taught = traces
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
    let held_back = curves.iter().any(|curve| curve.name.contains("held back"));
    let dashed = match held_back {
        true => "; dashed on data held back from learning",
        false => "",
    };
    format!(
        "The cost that learning makes smaller, mostly the squared difference from the teacher, \
         after each pass over the data{dashed}. First to last: {}.",
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
    use super::super::sample;
    use super::*;

    #[test]
    fn costs_have_three_figures() {
        assert_eq!(
            [1.0023, 0.05017, 123.4, 1234.5, 1.5e-9].map(three_figures),
            ["1.00", "0.0502", "123", "1.23e3", "1.50e-9"]
        );
    }

    #[test]
    fn every_picture_draws_as_svg_and_png() {
        for Drawn {
            figure, svg, png, ..
        } in draw(&sample::report().curves, "min").unwrap()
        {
            let title = format!("<title>{}</title>", figure.heading());
            assert!(svg.contains(&title) && svg.trim_end().ends_with("</svg>"));
            assert!(svg.contains("<polyline") && svg.contains("</text>"));
            assert!(
                svg.len() < 400_000,
                "{}: {} bytes",
                figure.file(),
                svg.len()
            );
            assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
        }
    }

    #[test]
    fn runs_without_data_say_so_and_odd_data_does_not_break_a_picture() {
        let mut curves = sample::report().curves;
        curves.learning.clear();
        curves.traces.clear();
        curves.track = vec![Curve {
            name: "reference".into(),
            x: vec![0.0; 9],
            y: vec![0.0; 9],
        }];
        curves.error_over_time = vec![Curve {
            name: "raw".into(),
            x: vec![0.0, 1.0, 2.0],
            y: vec![0.0, f64::NAN, 0.0],
        }];
        let drawn = draw(&curves, "min").unwrap();
        let svg = |figure| &drawn.iter().find(|d| d.figure == figure).unwrap().svg;
        assert!(svg(Figure::Learning).contains("nothing was learned"));
        assert!(svg(Figure::Errors).contains("no sensor-error traces"));
    }
}
