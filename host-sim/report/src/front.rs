//! The first screen of a page: one sentence, one picture, three figures.

use super::figures::{length, length_unit};
use super::text::{prose, signed};
use super::verdict::{Device, is_device, times};
use host_chart::axis::{Axis, extent, snapped, widened};
use host_chart::palette::{self, Look};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_core::error::Error;
use host_lab::experiment::results::Curve;
use maud::{Markup, PreEscaped, html};

/// Sizes of the picture on a broad screen and on a telephone, CSS pixels.
pub(super) const SIZES: [(f64, f64); 2] = [(WIDTH, 400.0), (370.0, 330.0)];

/// The first screen.
#[derive(Debug, Default)]
pub(super) struct Front {
    /// What the picture shows.
    pub title: String,
    /// The picture in both of [`SIZES`].
    pub pictures: [Picture; 2],
    /// Figures with their units, and what each is.
    pub figures: Vec<(String, String)>,
}

impl Front {
    /// The first screen under the sentence of the verdict.
    ///
    /// # Errors
    /// [`Error::Drawing`].
    pub fn markup(&self, sentence: &str) -> Result<Markup, Error> {
        let [broad, narrow] = &self.pictures;
        let (broad, narrow) = (
            broad.svg("front", &self.title)?,
            narrow.svg("front", &self.title)?,
        );
        Ok(html! {
            (said(sentence))
            figure.front {
                div.broad { (PreEscaped(broad)) }
                div.narrow { (PreEscaped(narrow)) }
                figcaption { (self.title) }
            }
            ul.big {
                @for (figure, what) in &self.figures { li { b { (figure) } span { (prose(what)) } } }
            }
        })
    }
}

/// The verdict of a page.
pub(super) fn said(sentence: &str) -> Markup {
    html! { p.verdict { (prose(sentence)) } }
}

/// The look of a scheme on the first screen: the device and what it is compared with stand out.
pub(super) fn look(name: &str, beside: &str) -> Look {
    match name {
        name if is_device(name) => Look::solid(palette::DEVICE, 3.2),
        // over the device's where both are equal
        name if name == beside => Look::dashed(palette::RAW, 2.2, (9.0, 5.0)),
        _ => Look::solid(palette::REFERENCE, 1.2),
    }
}

/// Errors over time: the device and no correction, which are `highlit`, and the others in grey.
/// `unit`: that of the abscissae.
pub(super) fn over_time(
    curves: &[Curve],
    highlit: [&str; 2],
    unit: &str,
    size: (f64, f64),
) -> Picture {
    let [device, beside] = highlit;
    let range = |part: fn(&Curve) -> &Vec<f64>| {
        extent(curves.iter().flat_map(|curve| part(curve).iter().copied()))
    };
    let (Some(time), Some((_, worst))) = (range(|c| &c.x), range(|c| &c.y)) else {
        return Picture::without_data(size, "there are no error curves");
    };
    let (factor, metres) = length_unit(worst);
    let style = |name: &str| match name {
        name if name == device => Look::solid(palette::DEVICE, 3.2),
        name if is_device(name) => Look::solid(palette::REFERENCE, 1.2),
        name => look(name, beside),
    };
    let rank = |curve: &&Curve| highlit.iter().position(|name| *name == curve.name);
    let mut ordered: Vec<&Curve> = curves.iter().collect();
    ordered.sort_by_key(rank); // the grey ones below
    let (mut marks, mut ends) = (vec![], vec![]);
    for curve in ordered {
        let scaled: Vec<f64> = curve.y.iter().map(|error| factor * error).collect();
        marks.push(Mark::curve(&curve.x, &scaled, style(&curve.name)));
        if let (Some(&t), Some(&error)) = (curve.x.last(), curve.y.last()) {
            let name = match curve.name.as_str() {
                name if name == beside => "uncorrected",
                name => name,
            };
            let words = format!("{name} {}", length(error, worst));
            ends.push(((t, factor * error), words, style(&curve.name).colour));
        }
    }
    marks.push(Mark::Ends(ends));
    let (left, right) = (70.0, 138.0);
    let ticks = ((size.0 - left - right) / 60.0) as usize;
    let panel = Panel {
        at: (left, 14.0),
        size: (size.0 - left - right, size.1 - 62.0),
        title: Default::default(),
        x: Axis::linear(
            format!("time without fixes, {unit}"),
            snapped(widened(time, 0.0), ticks),
            ticks,
        ),
        y: Axis::linear(
            format!("horizontal error, {metres}"),
            (0.0, widened((0.0, worst * factor), 0.04).1),
            6,
        ),
        marks,
    };
    Picture {
        size,
        panels: vec![panel],
        ..Picture::default()
    }
}

/// Errors of schemes in each of several drives or sessions.
pub(super) struct Each<'a> {
    /// What is counted along the axis.
    pub of: &'a str,
    /// The device and no correction.
    pub highlit: [&'a str; 2],
    /// Number and error, m, of each scheme.
    pub curves: Vec<(&'a str, Vec<(f64, f64)>)>,
}

impl Each<'_> {
    /// The picture, on a logarithmic scale.
    pub fn picture(&self, size: (f64, f64)) -> Picture {
        let all = || self.curves.iter().flat_map(|(_, points)| points);
        let floor = 1e-2;
        let (Some(x), Some((low, high))) = (
            extent(all().map(|(x, _)| *x)),
            extent(all().map(|(_, y)| y.max(floor))),
        ) else {
            return Picture::without_data(size, "no session is long enough");
        };
        let stands_out = |of: &&(&str, Vec<(f64, f64)>)| self.highlit.contains(&of.0);
        let mut ordered: Vec<_> = self.curves.iter().collect();
        ordered.sort_by_key(|of| self.highlit.iter().position(|name| *name == of.0));
        let mut marks = vec![];
        for of in ordered {
            let (name, points) = of;
            let look = look(name, self.highlit[1]);
            let radius = if stands_out(&of) { 4.5 } else { 2.5 };
            let points: Vec<_> = points.iter().map(|(x, y)| (*x, y.max(floor))).collect();
            marks.push(Mark::Line(points.clone(), look));
            marks.push(Mark::Dots(points, radius, look.colour));
        }
        let others = self.curves.iter().any(|of| !stands_out(&of));
        let legend = [
            (true, self.highlit[0], self.highlit[0]),
            (true, self.highlit[1], "uncorrected"),
            (others, "others", "others"),
        ];
        let shown = legend.into_iter().filter(|(shown, ..)| *shown);
        let shown = shown.map(|(_, of, name)| (name.to_owned(), look(of, self.highlit[1])));
        let (left, top) = (62.0, 34.0);
        Picture {
            size,
            legends: vec![Legend {
                at: (left, 16.0),
                width: size.0 - left,
                entries: shown.collect(),
            }],
            panels: vec![Panel {
                at: (left, top),
                size: (size.0 - left - 16.0, size.1 - top - 48.0),
                title: Default::default(),
                x: Axis::whole(self.of, (x.0, x.1)),
                y: Axis::log("horizontal error, m", (low / 1.5, high * 1.5)),
                marks,
            }],
            notes: vec![],
        }
    }
}

/// The three figures of one drive.
pub(super) fn three(device: &Device, proof: Option<u8>) -> Vec<(String, String)> {
    let [with, without] = device.metres;
    let m = |metres| length(metres, metres);
    let third = match (&device.waits, proof, &device.several) {
        (Some(_), Some(proof), _) => (
            format!("{proof} of 100"),
            "proof of the nearest candidate; a correction needs 100".to_owned(),
        ),
        (_, _, Some(of)) => (
            format!("\u{d7}\u{a0}{}", times(of.ratio)),
            format!(
                "error with the device, of the uncorrected one: {}",
                of.between
            ),
        ),
        _ => (
            format!("{} %", signed(100.0 * (with / without - 1.0), 0)),
            "change of the error by the device".to_owned(),
        ),
    };
    vec![
        (m(with), format!("error with the device {}", device.after)),
        (
            m(without),
            format!("error without a correction {}", device.after),
        ),
        third,
    ]
}
