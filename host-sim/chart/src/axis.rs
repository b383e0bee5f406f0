//! Axes: ranges, ticks with sensible numbers, and the thinning of long curves.

use plotters::coord::ranged1d::{
    KeyPointHint, KeyPointWeight, NoDefaultFormatting, Ranged, ValueFormatter,
};
use plotters::coord::types::RangedCoordf64;
use std::ops::Range;

/// One axis of a panel: its range, its scale and its labelled ticks.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    low: f64,
    high: f64,
    log: bool,
    /// Value and text of each tick, ascending.
    ticks: Vec<(f64, String)>,
    /// Width for the names of an axis with names instead of a scale, CSS pixels.
    room: Option<f64>,
}

impl Axis {
    /// Linear from `low` to `high` with at most about `count` intervals between ticks.
    pub fn linear(label: impl Into<String>, (low, high): (f64, f64), count: usize) -> Self {
        let values = RangedCoordf64::from(low..high).key_points(count + 1);
        let digits = (-(step(&values).log10() + 1e-6).floor()).clamp(0.0, 12.0) as usize;
        let text = |value: f64| {
            if step(&values) < 1e-6 {
                format!("{value:.1e}")
            } else {
                grouped(value, digits)
            }
        };
        Self {
            label: label.into(),
            low,
            high,
            log: false,
            ticks: values.iter().map(|value| (*value, text(*value))).collect(),
            room: None,
        }
    }

    /// Over whole numbers, each of which has a tick if there are few.
    pub fn whole(label: impl Into<String>, (first, last): (f64, f64)) -> Self {
        let every = ((last - first) / 15.0).ceil().max(1.0) as usize;
        let ticks = (first as u32..=last as u32).step_by(every);
        Self {
            ticks: ticks.map(|n| (f64::from(n), n.to_string())).collect(),
            ..Self::linear(label, (first - 0.5, last + 0.5), 1)
        }
    }

    /// Names instead of a scale, from top to bottom. The first is at [`Self::row`] 0. `room` is the
    /// width for them, CSS pixels.
    pub fn names(names: Vec<String>, room: f64) -> Self {
        let rows = names.into_iter().enumerate();
        let mut ticks: Vec<(f64, String)> = rows.map(|(k, name)| (Self::row(k), name)).collect();
        ticks.reverse();
        Self {
            label: String::new(),
            low: Self::row(ticks.len()) + 0.5,
            high: 0.5,
            log: false,
            ticks,
            room: Some(room),
        }
    }

    /// Coordinate of the name number `index` of [`Self::names`].
    pub fn row(index: usize) -> f64 {
        -(index as f64)
    }

    /// The width for names. `None` for an axis with a scale.
    pub fn room(&self) -> Option<f64> {
        self.room
    }

    /// Logarithmic over positive values, with a tick at every power of ten.
    ///
    /// Where there are few powers of ten, round values between them get ticks as well.
    pub fn log(label: impl Into<String>, (low, high): (f64, f64)) -> Self {
        let decades = (high / low).log10();
        let every = (decades / 6.0).ceil().max(1.0) as usize;
        let factors: &[f64] = match decades {
            d if d < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0],
            d if d < 2.5 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let powers = (low.log10().floor() as i32..=high.log10().ceil() as i32).step_by(every);
        let values = powers.flat_map(|power| factors.iter().map(move |f| f * 10_f64.powi(power)));
        let shown = values.filter(|value| (low * 0.999_999..=high * 1.000_001).contains(value));
        let ticks = shown.map(|value| (value, plain_or_scientific(value)));
        Self {
            label: label.into(),
            ticks: ticks.collect(),
            low,
            high,
            log: true,
            room: None,
        }
    }

    /// Whole multiples of the powers of ten on a logarithmic axis, for fainter lines.
    fn between(&self) -> Vec<f64> {
        if !self.log || self.high / self.low > 1e9 {
            return vec![];
        }
        let powers = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let values =
            powers.flat_map(|power| (2..10).map(move |k| f64::from(k) * 10_f64.powi(power)));
        values.filter(|value| self.holds(*value)).collect()
    }

    /// Least and greatest value.
    pub fn ends(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Whether it is logarithmic.
    pub fn is_log(&self) -> bool {
        self.log
    }

    /// Whether `value` lies on the axis, which NaN does not.
    pub fn holds(&self, value: f64) -> bool {
        let margin = 1e-9 * (self.high - self.low);
        (self.low - margin..=self.high + margin).contains(&value) && (value > 0.0 || !self.log)
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let [low, high, value] = [self.low, self.high, *value].map(|v| match self.log {
            true => v.ln(),
            false => v,
        });
        RangedCoordf64::from(low..high).map(&value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match hint.weight() {
            KeyPointWeight::Bold => self.ticks.iter().map(|(value, _)| *value).collect(),
            KeyPointWeight::Any => self.between(),
        }
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        let tick = self.ticks.iter().find(|(at, _)| at == value);
        tick.map_or_else(String::new, |(_, text)| text.clone())
    }
}

/// Distance between ticks; 1 with fewer than two.
fn step(ticks: &[f64]) -> f64 {
    match ticks {
        [first, second, ..] => second - first,
        _ => 1.0,
    }
}

/// `range` with each end moved out to the next tick of [`Axis::linear`] where that is near.
///
/// So a curve that ends at 29.99 min gets an axis to 30.
pub fn snapped((low, high): (f64, f64), count: usize) -> (f64, f64) {
    let step = step(&RangedCoordf64::from(low..high).key_points(count + 1));
    let near = 0.02 * (high - low);
    let (below, above) = ((low / step).floor() * step, (high / step).ceil() * step);
    (
        if low - below < near { below } else { low },
        if above - high < near { above } else { high },
    )
}

fn plain_or_scientific(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        format!("{}", (value * 1e6).round() / 1e6)
    } else if (1e4..1e6).contains(&value) {
        grouped(value, 0)
    } else {
        format!("{value:e}")
    }
    .replace('-', "\u{2212}")
}

/// `value` with `digits` decimals, a true minus sign, and spaces between thousands from 10 000 on.
pub fn grouped(value: f64, digits: usize) -> String {
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
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |range, value| {
        let (low, high) = range.unwrap_or((value, value));
        Some((low.min(value), high.max(value)))
    })
}

/// `range` widened by the fraction `margin` of its width at both ends.
///
/// A range without width gets one.
pub fn widened((low, high): (f64, f64), margin: f64) -> (f64, f64) {
    let width = high - low;
    if width > 1e-9 * low.abs().max(high.abs()) && width > 0.0 {
        (low - margin * width, high + margin * width)
    } else {
        let by = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low - by, high + by)
    }
}

/// Indices of at most about `limit` points that represent a long curve, in order.
///
/// A short curve retains all its points. A long one retains the smallest and the largest value of
/// each interval, so that no peak is lost. NaN counts as largest, so that gaps stay gaps.
pub fn thinned(y: &[f64], limit: usize) -> Vec<usize> {
    if y.len() <= limit {
        return (0..y.len()).collect();
    }
    let stretch = y.len().div_ceil((limit / 2).max(1));
    let mut selected = Vec::with_capacity(limit + 2);
    for start in (0..y.len()).step_by(stretch) {
        let indices = start..(start + stretch).min(y.len());
        let least = indices
            .clone()
            .min_by(|&a, &b| y[a].total_cmp(&y[b]))
            .unwrap_or(start);
        let greatest = indices
            .max_by(|&a, &b| y[a].total_cmp(&y[b]))
            .unwrap_or(start);
        selected.extend([least.min(greatest), least.max(greatest)]);
    }
    selected.extend([0, y.len() - 1]);
    selected.sort_unstable();
    selected.dedup();
    selected
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
        assert!(texts(&Axis::log("", (900.0, 2e4))).contains(&"10\u{a0}000"));
        assert!(Axis::log("", (1e-30, 1.0)).ticks.len() <= 8);
        assert_eq!(Axis::log("", (0.75, 12.0)).between()[..3], [0.8, 0.9, 2.0]);
        assert!(Axis::linear("", (0.0, 9.0), 3).between().is_empty());
    }

    #[test]
    fn names_stand_one_below_the_other() {
        let axis = Axis::names(["first", "second"].map(String::from).to_vec(), 90.0);
        let at = |row: usize| axis.map(&Axis::row(row), (200, 0));
        assert_eq!((at(0), at(1), axis.room()), (50, 150, Some(90.0)));
        assert_eq!(axis.format_ext(&Axis::row(1)), "second");
        assert_eq!(
            axis.key_points(plotters::coord::ranged1d::BoldPoints(9))
                .len(),
            2
        );
    }

    #[test]
    fn values_map_from_end_to_end_and_what_is_beyond_is_refused() {
        let (linear, log) = (
            Axis::linear("", (-5.0, 15.0), 4),
            Axis::log("", (0.01, 100.0)),
        );
        let limit = (0, 1000);
        assert_eq!(
            [-5.0, 5.0, 15.0].map(|value| linear.map(&value, limit)),
            [0, 500, 1000]
        );
        assert_eq!(log.map(&1.0, limit), 500);
        assert!([-5.0, 5.0, 15.0].iter().all(|value| linear.holds(*value)));
        assert!([16.0, f64::NAN].iter().all(|value| !linear.holds(*value)));
        assert!(log.holds(1.0) && !log.holds(0.0) && !log.holds(-1.0));
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
        let selected = thinned(&y, 1500);
        assert!(selected.len() <= 1502 && selected.is_sorted());
        for index in [0, 27_182, 31_415, 50_000, 99_999] {
            assert!(selected.contains(&index), "{index}");
        }
        assert_eq!(thinned(&y[..5], 1500), [0, 1, 2, 3, 4]);
        assert!(thinned(&[], 1500).is_empty());
    }
}
