//! The forest plot of a group of errors: the ratio of each scheme to none with its interval.

use crate::front::SIZES;
use host_chart::axis::{Axis, extent};
use host_chart::palette::{BETTER, INK, Look, UNDECIDED, WORSE};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_lab::campaign::{AgainstNone, Decided};

/// Width for the longest name of a scheme, CSS pixels.
const NAMES: f64 = 190.0;
/// Ratios beyond these are drawn at the end of the axis.
const LEAST: f64 = 0.03;
const GREATEST: f64 = 30.0;
/// Line style of the ratio 1, where a scheme is as good as none.
const EVEN: Look = Look::dashed(INK, 1.4, (2.0, 3.0));

/// Line style of a decision.
fn look(decided: Decided) -> Look {
    match decided {
        Decided::Better => BETTER,
        Decided::Worse => WORSE,
        Decided::Equal | Decided::Nothing => UNDECIDED,
    }
}

/// The picture, with the names at the left, or a narrow one for a telephone. `row`: height of a
/// row.
pub(super) fn sized(rows: &[AgainstNone], narrow: bool, row: f64) -> Picture {
    let (width, room, top) = match narrow {
        true => (SIZES[1].0, 130.0, 84.0),
        false => (WIDTH, NAMES, 62.0),
    };
    let names = rows.iter().map(|of| of.scheme.clone()).collect();
    let left = room + 8.0;
    let panel = Panel {
        at: (left, top),
        size: (width - left - 24.0, row * rows.len() as f64),
        title: sides(),
        x: ratios(rows, narrow),
        y: Axis::names(names, room),
        marks: marks(rows),
    };
    let legend = if narrow { 8.0 } else { left };
    picture(panel, (legend, 20.0), width)
}

fn picture(panel: Panel, legend: (f64, f64), width: f64) -> Picture {
    let entry = |(words, look): (&str, Look)| (words.to_owned(), look);
    let entries = [
        ("better", BETTER),
        ("worse", WORSE),
        ("equal, or not decided", UNDECIDED),
    ];
    Picture {
        size: (width, panel.at.1 + panel.size.1 + 48.0),
        legends: vec![Legend {
            at: legend,
            width: width - legend.0,
            entries: entries.map(entry).to_vec(),
        }],
        panels: vec![panel],
        notes: vec![],
    }
}

/// The meaning of the two sides of the line.
fn sides() -> [String; 2] {
    ["smaller errors", "larger errors"].map(String::from)
}

fn shown(ratio: f64) -> f64 {
    ratio.clamp(LEAST, GREATEST)
}

/// The axis over all intervals and 1.
fn ratios(rows: &[AgainstNone], narrow: bool) -> Axis {
    let ends = rows.iter().flat_map(|of| {
        let (low, high) = of.interval.unwrap_or((of.ratio, of.ratio));
        [low, high]
    });
    let (low, high) = extent(ends.map(shown).chain([0.8, 1.25])).unwrap_or((0.8, 1.25));
    let label = match narrow {
        true => "error / uncorrected error",
        false => "error divided by the uncorrected one (median of the runs, 95 %)",
    };
    Axis::log(label, (low / 1.08, high * 1.08))
}

fn marks(rows: &[AgainstNone]) -> Vec<Mark> {
    let bottom = Axis::row(rows.len()) + 0.5;
    let mut marks = vec![Mark::Line(vec![(1.0, 0.5), (1.0, bottom)], EVEN)];
    for (row, of) in rows.iter().enumerate() {
        let (y, look) = (Axis::row(row), look(of.decided()));
        let at = |ratio: f64| (shown(ratio), y);
        if let Some((low, high)) = of.interval {
            marks.push(Mark::Line(vec![at(low), at(high)], look));
        }
        marks.push(Mark::Signs(vec![at(of.ratio)], look));
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_chart::palette::RNN;

    fn row(scheme: &str, ratio: f64, width: f64) -> AgainstNone {
        AgainstNone {
            group: None,
            drives: 0,
            scheme: scheme.into(),
            runs: 20,
            compared: 20,
            worse: 3,
            better: 17,
            worst: 2.0,
            ratio,
            interval: Some((ratio / width, ratio * width)),
            median_m: None,
        }
    }

    /// Each decision has a different sign and colour.
    #[test]
    fn decisions_differ_in_sign_and_colour() {
        let rows = [
            row("a", 0.3, 1.2),
            row("b", 3.0, 1.2),
            row("c", 1.0, 1.2),
            row("d", 0.2, 1.3),
        ];
        let svg = sized(&rows, false, 21.0).svg("", "").unwrap();
        // one in the legend, two rows
        let disc = format!("r=\"18\" opacity=\"1\" fill=\"{}\"", RNN.light);
        assert_eq!(svg.matches(&disc).count(), 3, "{svg}");
        assert_eq!(svg.matches("<polygon").count(), 2, "{svg}");
        for name in ["\na\n", "\nb\n", "worse"] {
            assert!(svg.contains(name), "{name}");
        }
    }

    #[test]
    fn nothing_lies_beyond_the_axes_and_long_names_fit() {
        let name = "ekf-inputs-memory-frozen";
        let rows = [row(name, 1e-9, 10.0), row("b", 1e9, 1.0)];
        let picture = sized(&rows, false, 21.0);
        let axis = &picture.panels[0].x;
        assert!(
            [LEAST, 1.0, GREATEST]
                .iter()
                .all(|ratio| axis.holds(*ratio))
        );
        let signs = picture.panels[0].marks.iter();
        let signs = signs.filter_map(|mark| match mark {
            Mark::Signs(at, _) => Some(at),
            _ => None,
        });
        for (x, y) in signs.flatten() {
            assert!(axis.holds(*x) && picture.panels[0].y.holds(*y));
        }
        let svg = picture.svg("", "").unwrap();
        assert!(svg.contains(name) && !picture.has_scales());
        // 7 pixels a letter of 12 pixels at most
        assert!(7.2 * name.len() as f64 <= NAMES);
    }
}
