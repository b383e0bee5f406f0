//! The contents of the four pictures of a run or a replay. [`host_chart::picture`] draws them.

use super::sensor_errors::sensor_errors;
use host_chart::axis::{Axis, extent, grouped, snapped, widened};
use host_chart::palette::{self, Look};
use host_chart::picture::{Legend, MOST_POINTS, Mark, Panel, Picture, WIDTH};
use host_lab::experiment::results::{Curve, Curves};

/// A picture of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Figure {
    /// Plan view of the reference and of every scheme.
    Track,
    /// Horizontal error over time.
    Error,
    /// Cost over passes.
    Learning,
    /// Network against true sensor error, six panels.
    Errors,
}

impl Figure {
    /// All, in the order of the page.
    pub const ALL: [Self; 4] = [Self::Error, Self::Track, Self::Errors, Self::Learning];

    /// Heading of the picture.
    pub fn heading(self) -> &'static str {
        match self {
            Self::Error => "Horizontal error over time",
            Self::Track => "Track",
            Self::Errors => "Sensor errors and the output of the networks",
            Self::Learning => "Learning",
        }
    }

    /// Name of the PNG.
    pub fn file(self) -> &'static str {
        match self {
            Self::Track => "track.png",
            Self::Error => "error.png",
            Self::Learning => "learning.png",
            Self::Errors => "errors.png",
        }
    }

    /// The picture with its contents. `unit`: that of the times of the errors.
    pub fn picture(self, curves: &Curves, unit: &str) -> Picture {
        match self {
            Self::Track => track(&curves.track),
            Self::Error => error_over_time(&curves.error_over_time, unit),
            Self::Learning => learning(&curves.learning),
            Self::Errors => sensor_errors(&curves.traces),
        }
    }
}

/// Left end of the axes of a picture with one panel.
const LEFT: f64 = 76.0;

/// Metres or kilometres: factor and unit for a length of about `span` metres.
pub(super) fn length_unit(span: f64) -> (f64, &'static str) {
    if span >= 5000.0 {
        (1e-3, "km")
    } else {
        (1.0, "m")
    }
}

/// A length in metres as text of about three figures, in the unit that suits lengths up to `span`.
pub(super) fn length(metres: f64, span: f64) -> String {
    let (factor, unit) = length_unit(span);
    let value = metres * factor;
    let digits = match value.abs() {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{}\u{a0}{unit}", grouped(value, digits))
}

/// A picture of one panel under its legend.
fn single(size: (f64, f64), entries: Vec<(String, Look)>, panel: Panel) -> Picture {
    let legend = Legend {
        at: (LEFT, 20.0),
        width: size.0 - LEFT - 14.0,
        entries,
    };
    Picture {
        size,
        legends: vec![legend],
        panels: vec![panel],
        notes: vec![],
    }
}

fn schemes(curves: &[Curve]) -> Vec<(String, Look)> {
    let look = |curve: &Curve| (curve.name.clone(), palette::scheme(&curve.name));
    curves.iter().map(look).collect()
}

/// Range of one part of all curves.
fn range(curves: &[Curve], part: fn(&Curve) -> &Vec<f64>) -> Option<(f64, f64)> {
    extent(curves.iter().flat_map(|curve| part(curve).iter().copied()))
}

fn track(curves: &[Curve]) -> Picture {
    let (size, [left, top, right, below]) = ((WIDTH, 620.0), [LEFT, 44.0, 24.0, 52.0]);
    let (Some(east), Some(north)) = (range(curves, |c| &c.x), range(curves, |c| &c.y)) else {
        return Picture::without_data(size, "this run has no track");
    };
    let (east, north) = (widened(east, 0.04), widened(north, 0.04));
    let (width, height) = (size.0 - left - right, size.1 - top - below);
    // Both axes have the same scale, so that directions are true.
    let scale = ((east.1 - east.0) / width).max((north.1 - north.0) / height);
    let (factor, unit) = length_unit(scale * width);
    let around = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = ((low + high) / 2.0, scale * pixels / 2.0);
        (factor * (middle - half), factor * (middle + half))
    };
    let at = |x: f64, y: f64| (factor * x, factor * y);
    let mut marks = vec![];
    for curve in curves {
        let last = curve.x.len().saturating_sub(1);
        let stride = curve.x.len().div_ceil(MOST_POINTS).max(1);
        let indices = (0..curve.x.len()).filter(|i| i % stride == 0 || *i == last);
        let points: Vec<_> = indices.map(|i| at(curve.x[i], curve.y[i])).collect();
        let look = palette::scheme(&curve.name);
        let end = points.last().copied().into_iter().collect();
        marks.push(Mark::Line(points, look));
        marks.push(Mark::Dots(end, 4.0, look.colour));
    }
    let first = curves.first().map(|c| (c.x.first(), c.y.first()));
    if let Some((Some(x), Some(y))) = first {
        // On the side without the track.
        let below = if north.0 + north.1 > 2.0 * y {
            16.0
        } else {
            -16.0
        };
        marks.push(Mark::Text(at(*x, *y), below, "start".to_owned()));
    }
    let panel = Panel {
        at: (left, top),
        size: (width, height),
        title: Default::default(),
        x: Axis::linear(format!("east, {unit}"), around(east, width), 12),
        y: Axis::linear(format!("north, {unit}"), around(north, height), 8),
        marks,
    };
    single(size, schemes(curves), panel)
}

fn error_over_time(curves: &[Curve], unit: &str) -> Picture {
    let size = (WIDTH, 460.0);
    let (Some(time), Some((_, worst))) = (range(curves, |c| &c.x), range(curves, |c| &c.y)) else {
        return Picture::without_data(size, "this run has no error curves");
    };
    let (factor, metres) = length_unit(worst);
    let mut marks = vec![];
    let mut ends = vec![];
    for curve in curves {
        let look = palette::scheme(&curve.name);
        let scaled: Vec<f64> = curve.y.iter().map(|error| factor * error).collect();
        marks.push(Mark::curve(&curve.x, &scaled, look));
        if let (Some(&t), Some(&error)) = (curve.x.last(), curve.y.last()) {
            let words = format!("{} {}", curve.name, length(error, worst));
            ends.push(((t, factor * error), words, look.colour));
        }
    }
    marks.push(Mark::Ends(ends));
    let panel = Panel {
        at: (LEFT, 44.0),
        size: (size.0 - 216.0, size.1 - 96.0),
        title: Default::default(),
        x: Axis::linear(
            format!("time of free-inertial navigation, {unit}"),
            snapped(widened(time, 0.0), 12),
            12,
        ),
        y: Axis::linear(
            format!("horizontal position error, {metres}"),
            (0.0, widened((0.0, worst * factor), 0.04).1),
            8,
        ),
        marks,
    };
    single(size, schemes(curves), panel)
}

fn learning(curves: &[Curve]) -> Picture {
    let size = (WIDTH, 400.0);
    let costs = curves.iter().flat_map(|curve| curve.y.iter().copied());
    let cost = extent(costs.filter(|cost| *cost > 0.0));
    let (Some(passes), Some(cost)) = (range(curves, |c| &c.x), cost) else {
        return Picture::without_data(size, "nothing was learned in this run");
    };
    let looks = learning_looks(curves);
    let lines = curves.iter().zip(&looks);
    let (low, high) = widened((cost.0.ln(), cost.1.ln()), 0.05);
    let panel = Panel {
        at: (LEFT, 54.0),
        size: (size.0 - 100.0, size.1 - 106.0),
        title: Default::default(),
        x: Axis::linear(
            "passes over the data",
            snapped(widened(passes, 0.0), 10),
            10,
        ),
        y: Axis::log("cost", (low.exp(), high.exp())),
        marks: lines
            .map(|(curve, (_, look))| Mark::curve(&curve.x, &curve.y, *look))
            .collect(),
    };
    single(size, looks, panel)
}

/// A colour for each network, in the order of their first curves.
fn learning_looks(curves: &[Curve]) -> Vec<(String, Look)> {
    let mut networks: Vec<&str> = vec![];
    let mut entries = vec![];
    for curve in curves {
        let network = curve.name.split(':').next().unwrap_or_default();
        let known = networks.iter().position(|known| *known == network);
        let index = known.unwrap_or(networks.len());
        if known.is_none() {
            networks.push(network);
        }
        entries.push((curve.name.clone(), palette::learning(&curve.name, index)));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_share_the_unit_of_the_greatest() {
        let text = |metres, span| length(metres, span).replace('\u{a0}', " ");
        let alone = [4.21, 42.1, 421.0, 4210.0, 42_100.0].map(|metres| text(metres, metres));
        assert_eq!(alone, ["4.21 m", "42.1 m", "421 m", "4210 m", "42.1 km"]);
        assert_eq!(
            (text(421.0, 9000.0).as_str(), text(-3.0, 5.0).as_str()),
            ("0.42 km", "\u{2212}3.00 m")
        );
    }
}
