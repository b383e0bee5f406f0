//! Axes with sensible numbers, thinning of long curves, and dashes: the arithmetic of plotting, without any drawing.

/// One axis: its range, its kind, and its labelled ticks.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Value and text of each tick, ascending.
    pub ticks: Vec<(f64, String)>,
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// Linear from `low` to `high` with about `count` ticks.
    pub fn linear(label: impl Into<String>, (low, high): (f64, f64), count: usize) -> Self {
        let step = nice_step((high - low) / count.max(1) as f64);
        let digits = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let (first, last) = (
            (low / step).ceil() as i64,
            (high / step + 1e-9).floor() as i64,
        );
        let tick = |i: i64| {
            let value = i as f64 * step;
            (
                value,
                if step < 1e-6 {
                    format!("{value:.1e}")
                } else {
                    grouped(value, digits)
                },
            )
        };
        Self {
            label: label.into(),
            ticks: (first..=last).map(tick).collect(),
            low,
            high,
            log: false,
        }
    }

    /// Logarithmic over positive values; every power of ten, and 2 and 5 between them where there are few powers.
    pub fn log(label: impl Into<String>, (low, high): (f64, f64)) -> Self {
        let decades = (high / low).log10();
        let every = (decades / 6.0).ceil().max(1.0) as usize;
        let factors: &[f64] = match decades {
            d if d < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
            d if d < 2.5 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let powers = (low.log10().floor() as i32..=high.log10().ceil() as i32).step_by(every);
        let ticks = powers
            .flat_map(|power| {
                factors
                    .iter()
                    .map(move |factor| factor * 10_f64.powi(power))
            })
            .filter(|value| (low * 0.999_999..=high * 1.000_001).contains(value))
            .map(|value| (value, plain_or_scientific(value)))
            .collect();
        Self {
            label: label.into(),
            ticks,
            low,
            high,
            log: true,
        }
    }

    /// Where `value` lies, 0 at the low end and 1 at the high end; `None` off the axis or not a number.
    pub fn place(&self, value: f64) -> Option<f64> {
        let part = if self.log {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        (-1e-9..=1.0 + 1e-9).contains(&part).then_some(part)
    }
}

/// `range` with each end moved out to the next tick of [`Axis::linear`] where that is near: 29.99 ends at 30.
pub(super) fn snapped((low, high): (f64, f64), count: usize) -> (f64, f64) {
    let step = nice_step((high - low) / count.max(1) as f64);
    let near = 0.02 * (high - low);
    let (below, above) = ((low / step).floor() * step, (high / step).ceil() * step);
    (
        if low - below < near { below } else { low },
        if above - high < near { above } else { high },
    )
}

/// 1, 2 or 5 times a power of ten, the least that is not much below `rough`.
fn nice_step(rough: f64) -> f64 {
    let least = 0.7 * rough;
    let power = 10_f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|factor| factor * power >= least);
    factor.unwrap_or(10.0) * power
}

fn plain_or_scientific(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        format!("{}", (value * 1e6).round() / 1e6)
    } else {
        format!("{value:e}")
    }
    .replace('-', "\u{2212}")
}

/// `value` with `digits` decimals, a true minus sign, and narrow groups of thousands from 10 000 on.
pub(super) fn grouped(value: f64, digits: usize) -> String {
    let text = format!("{:.digits$}", value.abs());
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let sign = if value < 0.0 && text.bytes().any(|byte| (b'1'..=b'9').contains(&byte)) {
        "\u{2212}"
    } else {
        ""
    };
    let mut out = String::from(sign);
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && whole.len() > 4 && (whole.len() - i) % 3 == 0 {
            out.push('\u{a0}');
        }
        out.push(digit);
    }
    out + rest
}

/// Least and greatest finite value, or `None` where there is none.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |range, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// `range` wider by the part `margin` at both ends; a range of no width gets one.
pub(super) fn widened((low, high): (f64, f64), margin: f64) -> (f64, f64) {
    let width = high - low;
    if width > 1e-9 * low.abs().max(high.abs()) && width > 0.0 {
        (low - margin * width, high + margin * width)
    } else {
        let by = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low - by, high + by)
    }
}

/// At most about `limit` indices of a curve: all of a short one, else the least and the greatest of each stretch, in order, so
/// that no peak is lost. A stretch with a NaN keeps it, so gaps stay gaps.
pub(super) fn thinned(y: &[f64], limit: usize) -> Vec<usize> {
    if y.len() <= limit {
        return (0..y.len()).collect();
    }
    let stretch = y.len().div_ceil((limit / 2).max(1));
    let mut kept = Vec::with_capacity(limit + 2);
    for start in (0..y.len()).step_by(stretch) {
        let indices = start..(start + stretch).min(y.len());
        let least = indices
            .clone()
            .min_by(|&a, &b| y[a].total_cmp(&y[b]))
            .unwrap_or(start);
        let greatest = indices
            .max_by(|&a, &b| y[a].total_cmp(&y[b]))
            .unwrap_or(start); // NaN counts as greatest
        kept.extend([least.min(greatest), least.max(greatest)]);
    }
    kept.extend([0, y.len() - 1]);
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// Cuts `path` into strokes by `pattern` (stroke, gap, stroke, gap, ...), lengths in the path's own unit.
pub(super) fn dashed(path: &[(f64, f64)], pattern: &[f64]) -> Vec<Vec<(f64, f64)>> {
    if pattern.is_empty() {
        return vec![path.to_vec()];
    }
    let mut strokes = vec![];
    let mut stroke: Vec<(f64, f64)> = path.first().copied().into_iter().collect();
    let (mut phase, mut left) = (0, pattern[0]);
    for (&a, &b) in path.iter().zip(path.iter().skip(1)) {
        let length = (b.0 - a.0).hypot(b.1 - a.1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (
                a.0 + (b.0 - a.0) * done / length,
                a.1 + (b.1 - a.1) * done / length,
            );
            if phase % 2 == 0 {
                stroke.push(at);
                strokes.push(std::mem::take(&mut stroke));
            } else {
                stroke = vec![at];
            }
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
        }
        left -= length - done;
        if phase % 2 == 0 {
            stroke.push(b);
        }
    }
    if stroke.len() > 1 {
        strokes.push(stroke);
    }
    strokes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(axis: &Axis) -> Vec<&str> {
        axis.ticks.iter().map(|(_, text)| text.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_carry_the_digits_they_need() {
        assert_eq!(
            texts(&Axis::linear("", (0.0, 22.0), 6)),
            ["0", "5", "10", "15", "20"]
        );
        assert_eq!(
            texts(&Axis::linear("", (-0.11, 0.1), 2)),
            ["\u{2212}0.1", "0.0", "0.1"]
        );
        assert_eq!(
            texts(&Axis::linear("", (9990.0, 10011.0), 2)),
            ["9990", "10\u{a0}000", "10\u{a0}010"]
        );
        assert_eq!(
            texts(&Axis::linear("", (0.0, 0.0031), 3)),
            ["0.000", "0.001", "0.002", "0.003"]
        );
        assert_eq!(
            texts(&Axis::linear("", (0.0, 3e-9), 3)),
            ["0.0e0", "1.0e-9", "2.0e-9", "3.0e-9"]
        );
    }

    #[test]
    fn ends_snap_to_a_near_tick_only() {
        assert_eq!(snapped((0.01, 29.99), 5), (0.0, 30.0));
        assert_eq!(snapped((0.0, 22.0), 5), (0.0, 22.0));
        assert_eq!(snapped((0.0, 399.0), 10), (0.0, 400.0));
    }

    #[test]
    fn log_ticks_fit_the_span() {
        assert_eq!(
            texts(&Axis::log("", (1e-6, 1.0)))[..2],
            ["1e\u{2212}6", "1e\u{2212}5"]
        );
        assert_eq!(
            texts(&Axis::log("", (0.01, 1.0))),
            ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]
        );
        assert_eq!(texts(&Axis::log("", (0.31, 0.7))), ["0.4", "0.5", "0.6"]);
        assert!(Axis::log("", (1e-30, 1.0)).ticks.len() <= 8);
    }

    #[test]
    fn places_run_from_end_to_end_and_refuse_what_is_off() {
        let (linear, log) = (
            Axis::linear("", (-5.0, 15.0), 4),
            Axis::log("", (0.01, 100.0)),
        );
        assert_eq!(
            (linear.place(-5.0), linear.place(5.0), linear.place(15.0)),
            (Some(0.0), Some(0.5), Some(1.0))
        );
        assert_eq!(
            (log.place(1.0), log.place(0.0), log.place(-1.0)),
            (Some(0.5), None, None)
        );
        assert_eq!((linear.place(16.0), linear.place(f64::NAN)), (None, None));
    }

    #[test]
    fn numbers_are_grouped_and_zero_has_no_sign() {
        assert_eq!(grouped(-1_234_567.25, 1), "\u{2212}1\u{a0}234\u{a0}567.2");
        assert_eq!(
            (grouped(1234.0, 0).as_str(), grouped(-0.001, 2).as_str()),
            ("1234", "0.00")
        );
    }

    #[test]
    fn extents_skip_nan_and_widening_never_leaves_no_width() {
        assert_eq!(
            extent([f64::NAN, 3.0, -1.0, f64::INFINITY]),
            Some((-1.0, 3.0))
        );
        assert_eq!(extent([f64::NAN]), None);
        assert_eq!(widened((0.0, 10.0), 0.1), (-1.0, 11.0));
        for flat in [0.0, 5.0, -1e-12, 1e15] {
            let (low, high) = widened((flat, flat), 0.1);
            assert!(low < flat && flat < high);
        }
    }

    #[test]
    fn thinning_keeps_ends_peaks_and_gaps() {
        let mut y: Vec<f64> = (0..100_000).map(|i| f64::from(i % 97)).collect();
        (y[31_415], y[27_182], y[50_000]) = (1e6, -1e6, f64::NAN);
        let kept = thinned(&y, 1500);
        assert!(kept.len() <= 1502 && kept.is_sorted());
        for index in [0, 27_182, 31_415, 50_000, 99_999] {
            assert!(kept.contains(&index), "{index}");
        }
        assert_eq!(thinned(&y[..5], 1500), [0, 1, 2, 3, 4]);
        assert!(thinned(&[], 1500).is_empty());
    }

    #[test]
    fn dashes_go_round_corners_and_keep_their_share() {
        let path = [(0.0, 0.0), (10.0, 0.0), (10.0, 20.0)];
        let strokes = dashed(&path, &[6.0, 2.0]);
        assert_eq!(strokes[1], [(8.0, 0.0), (10.0, 0.0), (10.0, 4.0)]);
        let length = |s: &Vec<(f64, f64)>| {
            s.windows(2)
                .map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1))
                .sum::<f64>()
        };
        assert!((strokes.iter().map(length).sum::<f64>() - 24.0).abs() < 1e-9); // 3 whole periods of 8 and 6 more
        assert_eq!(dashed(&path, &[]), [path.to_vec()]);
        assert!(dashed(&[], &[1.0, 1.0]).is_empty());
    }
}
