//! The sensor errors, as in the paper's figure 2.
//!
//! Each axis has a panel with the output of the network, the true error, and the teacher's error
//! estimates as faint dots.

use host_chart::axis::{Axis, extent, snapped, widened};
use host_chart::palette::{INK, Look, RNN, TEACHER};
use host_chart::picture::{Legend, Mark, Panel, Picture, WIDTH};
use host_lab::experiment::results::ErrorTrace;

/// Largest number of the teacher's dots in a panel: enough to show the spread, few enough to stay
/// faint.
const TEACHER_DOTS: usize = 250;
/// Radius of those dots.
const TEACHER_RADIUS: f64 = 1.75;
/// Panels in a row: x, y, z.
const COLUMNS: usize = 3;
const TRUTH: Look = Look::solid(INK, 1.4);
const NETWORK: Look = Look::solid(RNN, 1.8);
/// The sample of the dots in the legend.
const DOTS: Look = Look::dashed(TEACHER, 2.0 * TEACHER_RADIUS, (3.5, 3.5));

/// All panels, three in a row.
pub(super) fn sensor_errors(traces: &[ErrorTrace]) -> Picture {
    let size = (WIDTH, 560.0);
    if traces.is_empty() {
        return Picture::without_data(size, "this run has no sensor-error traces");
    }
    let known = traces.iter().any(|trace| !trace.truth.is_empty());
    let mut teachers = traces.iter().flat_map(|trace| &trace.teacher);
    let entries = [
        ("true sensor error", TRUTH, known),
        ("network", NETWORK, true),
        (
            "teacher, while learning",
            DOTS,
            teachers.any(|value| value.is_finite()),
        ),
    ];
    let shown = entries.into_iter().filter(|(.., there)| *there);
    let legend = Legend {
        at: (66.0, 18.0),
        width: size.0 - 66.0,
        entries: shown
            .map(|(name, look, _)| (name.to_owned(), look))
            .collect(),
    };
    let rows = traces.len().div_ceil(COLUMNS);
    let (column, row) = (size.0 / COLUMNS as f64, (size.1 - 76.0) / rows as f64);
    let position = |i: usize| {
        (
            (i % COLUMNS) as f64 * column + 66.0,
            (i / COLUMNS) as f64 * row + 62.0,
        )
    };
    let label = |i: usize| match i + COLUMNS >= traces.len() {
        true => "time since power-on, min",
        false => "",
    };
    let panel = |(i, trace): (usize, &ErrorTrace)| Panel {
        at: position(i),
        size: (column - 82.0, row - 52.0),
        title: [trace.axis.clone(), trace.unit.clone()],
        x: {
            let time = extent(trace.t_min.iter().copied()).unwrap_or_default();
            Axis::linear(label(i), snapped(widened(time, 0.0), 8), 8)
        },
        y: Axis::linear("", trace_range(trace), 6),
        marks: marks(trace),
    };
    Picture {
        size,
        legends: vec![legend],
        panels: traces.iter().enumerate().map(panel).collect(),
        notes: vec![],
    }
}

/// Range of a panel: truth and network, and the teacher without its farthest 2 % on each side.
fn trace_range(trace: &ErrorTrace) -> (f64, f64) {
    let mut teacher: Vec<f64> = trace
        .teacher
        .iter()
        .copied()
        .filter(|value| value.is_finite())
        .collect();
    teacher.sort_by(f64::total_cmp);
    let outside = teacher.len() / 50;
    let most = &teacher[outside..teacher.len() - outside];
    let shown = trace
        .truth
        .iter()
        .chain(&trace.network)
        .chain(most)
        .copied();
    widened(extent(shown).unwrap_or_default(), 0.06)
}

fn marks(trace: &ErrorTrace) -> Vec<Mark> {
    let taught = trace
        .t_min
        .iter()
        .copied()
        .zip(trace.teacher.iter().copied());
    let taught: Vec<_> = taught.filter(|(_, value)| value.is_finite()).collect();
    let stride = taught.len().div_ceil(TEACHER_DOTS).max(1);
    let dots = taught.into_iter().step_by(stride).collect();
    vec![
        Mark::Dots(dots, TEACHER_RADIUS, TEACHER),
        Mark::curve(&trace.t_min, &trace.truth, TRUTH),
        Mark::curve(&trace.t_min, &trace.network, NETWORK),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_takes_its_range_from_truth_and_network_and_not_from_a_wild_teacher() {
        let mut trace = ErrorTrace {
            truth: vec![1.0; 100],
            network: vec![0.0; 100],
            ..Default::default()
        };
        trace.teacher = vec![0.5; 100];
        trace.teacher[7] = 1e9;
        trace.teacher[8] = f64::NAN;
        let (low, high) = trace_range(&trace);
        assert!((low + 0.06).abs() < 1e-12 && (high - 1.06).abs() < 1e-12);
    }
}
