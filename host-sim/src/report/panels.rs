//! The paper's figure 2: for each sensor, the network's output over the true error, with the teacher as faint dots.

use super::axes::{Axis, extent, snapped, widened};
use super::palette::{INK, Look, RNN, SOFT, TEACHER};
use super::sheet::{Align, Drawn, Plot, Sheet};
use crate::experiment::results::ErrorTrace;
use plotters::prelude::DrawingBackend;

/// Teacher's dots a panel: enough to see the spread, few enough to stay faint.
const TEACHER_DOTS: usize = 250;
/// Radius of those dots, CSS pixels.
const TEACHER_RADIUS: f64 = 1.75;
/// Columns of sensor-error panels: x, y, z.
const PANEL_COLUMNS: usize = 3;

/// All panels, three in a row.
pub(super) fn sensor_errors<DB: DrawingBackend>(
    sheet: &mut Sheet<DB>,
    size: (f64, f64),
    traces: &[ErrorTrace],
) -> Drawn<DB> {
    if traces.is_empty() {
        return sheet.nothing("this run has no sensor-error traces", size);
    }
    let mut entries = vec![("network".to_owned(), NETWORK)];
    if traces.iter().any(|trace| !trace.truth.is_empty()) {
        entries.insert(0, ("true sensor error".to_owned(), TRUTH));
    }
    let (x, y) = sheet.legend((66.0, 18.0), size.0 - 66.0, &entries)?;
    if traces
        .iter()
        .any(|trace| trace.teacher.iter().any(|value| value.is_finite()))
    {
        for (right, down) in [(0.0, 2.0), (8.0, -3.0), (16.0, 3.0), (24.0, -1.0)] {
            sheet.dot((x + right, y + down), TEACHER_RADIUS, TEACHER)?;
        }
        sheet.text("teacher, while learning", (x + 34.0, y), Align::Left, INK)?;
    }
    let rows = traces.len().div_ceil(PANEL_COLUMNS);
    let (column, row) = (size.0 / PANEL_COLUMNS as f64, (size.1 - 76.0) / rows as f64);
    for (i, trace) in traces.iter().enumerate() {
        let (left, top) = (
            (i % PANEL_COLUMNS) as f64 * column + 66.0,
            (i / PANEL_COLUMNS) as f64 * row + 62.0,
        );
        let last_row = i + PANEL_COLUMNS >= traces.len();
        let x_label = if last_row {
            "time since power-on, min"
        } else {
            ""
        };
        let time = widened(extent(trace.t_min.iter().copied()).unwrap_or_default(), 0.0);
        let plot = Plot {
            left,
            top,
            width: column - 82.0,
            height: row - 52.0,
            x: Axis::linear(x_label, snapped(time, 5), 5),
            y: Axis::linear("", trace_range(trace), 5),
        };
        panel(sheet, &plot, trace)?;
    }
    Ok(())
}

const TRUTH: Look = Look::solid(INK, 1.4);
const NETWORK: Look = Look::solid(RNN, 1.8);

/// Range of a panel: all of truth and network, and the teacher but for its farthest two in a hundred at either side.
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

fn panel<DB: DrawingBackend>(sheet: &mut Sheet<DB>, plot: &Plot, trace: &ErrorTrace) -> Drawn<DB> {
    sheet.axes(plot)?;
    sheet.text(&trace.axis, (plot.left, plot.top - 12.0), Align::Left, INK)?;
    sheet.text(
        &trace.unit,
        (plot.right(), plot.top - 12.0),
        Align::Right,
        SOFT,
    )?;
    let said: Vec<usize> = (0..trace.teacher.len())
        .filter(|&i| trace.teacher[i].is_finite())
        .collect();
    for &i in said
        .iter()
        .step_by(said.len().div_ceil(TEACHER_DOTS).max(1))
    {
        if let Some(at) = plot.at(trace.t_min[i], trace.teacher[i]) {
            sheet.dot(at, TEACHER_RADIUS, TEACHER)?;
        }
    }
    sheet.curve(plot, &trace.t_min, &trace.truth, TRUTH)?;
    sheet.curve(plot, &trace.t_min, &trace.network, NETWORK)
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
