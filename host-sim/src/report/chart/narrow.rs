//! A picture for a narrow screen: its panels below one another, in the width of a phone.
//!
//! What is written at the ends of curves stands in the legend there.

use super::{Legend, Mark, Panel, Picture};
use crate::report::axis::thinned;

/// Width for a screen of 375 pixels, less the margins of the page.
pub(in crate::report) const NARROW: f64 = 335.0;
/// Left end of the axes, with the numbers and the name of the ordinate before it.
pub(in crate::report) const LEFT: f64 = 62.0;
/// Room at the right, where half of the last number stands.
pub(in crate::report) const RIGHT: f64 = 14.0;
/// Most height of the axes of a panel.
const HEIGHT: f64 = 260.0;
/// Most numbers at an abscissa.
const NUMBERS: usize = 6;
/// Most points of a curve.
const POINTS: usize = 400;
/// Height of a row of a legend, and the most that a letter of it takes.
const ROW: f64 = 18.0;
const LETTER: f64 = 7.8;

impl Picture {
    /// The same for a narrow screen. A plan view would lose its scale, so it has a picture of its
    /// own.
    pub fn narrow(&self) -> Self {
        let legend = self.one_legend();
        let mut y = 20.0 + ROW * legend.as_ref().map_or(0.0, |of| of.rows() as f64);
        let mut panels = vec![];
        for panel in &self.panels {
            y += if panel.title.iter().all(String::is_empty) {
                4.0
            } else {
                24.0
            };
            let height = panel.size.1.min(HEIGHT);
            panels.push(panel.narrow(y, height));
            y += height + if panel.x.label.is_empty() { 24.0 } else { 46.0 };
        }
        if panels.is_empty() {
            y += 40.0;
        }
        let notes = self.notes.iter();
        Self {
            size: (NARROW, y),
            legends: legend.into_iter().collect(),
            panels,
            notes: notes
                .map(|(_, words)| ((NARROW / 2.0, y / 2.0), words.clone()))
                .collect(),
        }
    }

    /// All legends as one, with what stands at the ends of curves in place of their names.
    pub(in crate::report) fn one_legend(&self) -> Option<Legend> {
        let mut entries = vec![];
        for entry in self.legends.iter().flat_map(|legend| &legend.entries) {
            if !entries.contains(entry) {
                entries.push(entry.clone());
            }
        }
        let marks = self.panels.iter().flat_map(|panel| &panel.marks);
        for mark in marks {
            let Mark::Ends(ends) = mark else { continue };
            for (_, words, _) in ends {
                let named = |name: &str| words.strip_prefix(name)?.strip_prefix(' ');
                if let Some((name, _)) = entries.iter_mut().find(|(name, _)| named(name).is_some())
                {
                    name.clone_from(words);
                }
            }
        }
        (!entries.is_empty()).then_some(Legend {
            at: (4.0, 14.0),
            width: NARROW - 8.0,
            entries,
        })
    }
}

impl Legend {
    /// Rows that it takes at most.
    pub(in crate::report) fn rows(&self) -> usize {
        let (mut rows, mut x) = (1, 0.0);
        for (name, _) in &self.entries {
            let length = 34.0 + LETTER * name.chars().count() as f64;
            if x > 0.0 && x + length > self.width {
                (rows, x) = (rows + 1, 0.0);
            }
            x += length + 22.0;
        }
        rows
    }
}

impl Panel {
    fn narrow(&self, top: f64, height: f64) -> Self {
        let few = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
            let y: Vec<f64> = points.iter().map(|point| point.1).collect();
            thinned(&y, POINTS).into_iter().map(|i| points[i]).collect()
        };
        let marks = self.marks.iter().map(|mark| match mark {
            Mark::Line(points, look) => Mark::Line(few(points), *look),
            // the names are in the legend
            Mark::Ends(ends) => Mark::Ends(
                ends.iter()
                    .map(|(at, _, colour)| (*at, String::new(), *colour))
                    .collect(),
            ),
            other => other.clone(),
        });
        Self {
            at: (LEFT, top),
            size: (NARROW - LEFT - RIGHT, height),
            title: self.title.clone(),
            x: self.x.clone().with_numbers(NUMBERS),
            y: self.y.clone(),
            marks: marks.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figures::Figure;
    use crate::report::sample;

    /// Everything lies within the width of a phone, and the pictures of single panels keep all
    /// their curves.
    #[test]
    fn the_pictures_of_a_run_fit_a_phone() {
        let curves = sample::report().curves;
        for figure in Figure::ALL {
            let (wide, narrow) = (figure.picture(&curves), figure.narrow(&curves));
            assert!(wide.size.0 > 900.0 && narrow.size.0 <= NARROW);
            assert_eq!(wide.panels.len(), narrow.panels.len(), "{figure:?}");
            let mut below = 0.0;
            for (of, panel) in wide.panels.iter().zip(&narrow.panels) {
                assert!(panel.at.0 + panel.size.0 <= NARROW - RIGHT + 0.1);
                assert!(panel.at.1 > below, "{figure:?}");
                below = panel.at.1 + panel.size.1;
                assert_eq!(of.marks.len(), panel.marks.len());
            }
            assert!(below + 20.0 < narrow.size.1);
        }
    }

    #[test]
    fn what_stands_at_the_end_of_a_curve_stands_in_the_legend() {
        let narrow = Figure::Error.narrow(&sample::report().curves);
        let names: Vec<&str> = narrow.legends[0]
            .entries
            .iter()
            .map(|(n, _)| n.as_str())
            .collect();
        assert!(names.iter().all(|name| name.ends_with("km")), "{names:?}");
        assert!(narrow.legends[0].rows() > 1);
        let svg = narrow.svg("", "").unwrap();
        assert_eq!(svg.matches(names[0]).count(), 1);
    }

    #[test]
    fn a_plan_view_keeps_its_scale() {
        let narrow = Figure::Track.narrow(&sample::report().curves);
        let panel = &narrow.panels[0];
        let scale = |(low, high): (f64, f64), length: f64| (high - low) / length;
        let [x, y] = [
            scale(panel.x.ends(), panel.size.0),
            scale(panel.y.ends(), panel.size.1),
        ];
        assert!((x / y - 1.0).abs() < 1e-9, "{x} {y}");
    }
}
