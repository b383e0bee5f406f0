//! The results as a printed table, in the layout of table 1 of the paper.
//!
//! Each time has a block, and each scheme a line in it.

use super::terminal::{MARK, fitted, named};
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, presets};
use host_lab::experiment::results::{Results, Row};

/// The scheme with which all others are compared: the samples without correction.
pub(super) const BASELINE: &str = "raw";

/// Change of the horizontal error against `raw` at the same time, per cent; negative is smaller.
///
/// `None` for `raw` itself, and where there is no `raw` or its error is zero.
#[must_use]
pub(super) fn change_percent(results: &Results, row: &Row) -> Option<f64> {
    let same_time = |other: &&Row| other.t_s == row.t_s && other.scheme == BASELINE;
    let raw = results.rows.iter().find(same_time)?.horizontal_m;
    (row.scheme != BASELINE && raw > 0.0).then(|| 100.0 * (row.horizontal_m / raw - 1.0))
}

/// Whether `row` has the least horizontal error of its time.
#[must_use]
pub(super) fn is_best(results: &Results, row: &Row) -> bool {
    let same_time = results.rows.iter().filter(|other| other.t_s == row.t_s);
    same_time.clone().count() > 1
        && same_time
            .map(|other| other.horizontal_m)
            .all(|other| row.horizontal_m <= other)
}

/// The rows of each time, times in their order.
pub(super) fn blocks(results: &Results) -> impl Iterator<Item = &[Row]> {
    results.rows.chunk_by(|a, b| a.t_s == b.t_s)
}

/// A change in whole per cent with its sign; `-` where there is none.
pub(super) fn percent(change: Option<f64>) -> String {
    match change {
        None => "-".to_owned(),
        Some(change) if change > 9999.0 => "> +9999 %".to_owned(),
        Some(change) => format!("{:+.0} %", change.round() + 0.0), // -0 becomes +0
    }
}

/// The rows of a time in the order of the errors at the last time, the least first.
fn sorted<'a>(results: &'a Results, block: &'a [Row]) -> Vec<&'a Row> {
    let last = blocks(results).last().unwrap_or_default();
    let end = |row: &&Row| {
        let same = last.iter().find(|of| of.scheme == row.scheme);
        same.map_or(f64::INFINITY, |of| of.horizontal_m)
    };
    let mut rows: Vec<&Row> = block.iter().collect();
    rows.sort_by(|a, b| end(a).total_cmp(&end(b)));
    rows
}

/// The table as text of at most `width` columns, without a final line break.
///
/// It has at most 103 columns as long as errors stay below 10 000 km.
#[must_use]
pub fn table(results: &Results, width: usize) -> String {
    let mut table = Table::new();
    table
        .load_preset(presets::UTF8_FULL)
        .set_content_arrangement(ContentArrangement::Disabled);
    let header = [
        "time\nmin",
        "scheme",
        "latitude\nerror, m",
        "longitude\nerror, m",
        "north vel.\nerror, m/s",
        "east vel.\nerror, m/s",
        "horizontal\nerror, m",
        "change\nagainst\nraw",
    ];
    let aligned = |text| match text {
        "scheme" => Cell::new(text),
        _ => Cell::new(text).set_alignment(CellAlignment::Right),
    };
    table.set_header(header.map(aligned));
    for block in blocks(results) {
        let rows = sorted(results, block);
        let column = |text: &dyn Fn(&Row) -> String| {
            let lines: Vec<String> = rows.iter().map(|row| text(row)).collect();
            Cell::new(lines.join("\n")).set_alignment(CellAlignment::Right)
        };
        table.add_row([
            Cell::new(block[0].t_s / 60).set_alignment(CellAlignment::Right),
            column(&|row| named(&row.scheme)).set_alignment(CellAlignment::Left),
            column(&|row| format!("{:+.2}", row.d_north_m)),
            column(&|row| format!("{:+.2}", row.d_east_m)),
            column(&|row| format!("{:+.3}", row.d_vn_mps)),
            column(&|row| format!("{:+.3}", row.d_ve_mps)),
            column(&|row| {
                format!(
                    "{}{:.2}",
                    if is_best(results, row) { "* " } else { "" },
                    row.horizontal_m
                )
            }),
            column(&|row| percent(change_percent(results, row))),
        ]);
    }
    let notes = "change: of the horizontal error against raw at the same time: - is a smaller \
                 error, + a larger one
*: least horizontal error of its time";
    let table = fitted(table, width, [5, 4, 3, 2]);
    format!("{table}\n{notes}\n{MARK}: the device; sorted by the errors at the last time")
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    fn row(scheme: &str, horizontal_m: f64) -> Row {
        Row {
            t_s: 300,
            scheme: scheme.into(),
            d_north_m: 0.0,
            d_east_m: 0.0,
            d_vn_mps: 0.0,
            d_ve_mps: 0.0,
            horizontal_m,
        }
    }

    fn results(rows: Vec<Row>) -> Results {
        Results {
            schema: 3,
            scenario: "test".into(),
            seed: 1,
            rows,
            device: None,
        }
    }

    #[test]
    fn change_is_negative_for_a_smaller_error_and_honest_about_a_larger_one() {
        let results = results(vec![
            row("raw", 200.0),
            row("ls-bias", 224.0),
            row("rnn", 92.0),
        ]);
        let texts: Vec<String> = results
            .rows
            .iter()
            .map(|row| percent(change_percent(&results, row)))
            .collect();
        assert_eq!(texts, ["-", "+12 %", "-54 %"]);
        assert_eq!(
            results
                .rows
                .iter()
                .map(|row| is_best(&results, row))
                .collect::<Vec<_>>(),
            [false, false, true]
        );
    }

    #[test]
    fn no_baseline_or_no_error_gives_no_percentage() {
        let alone = results(vec![row("rnn", 92.0)]);
        assert_eq!(
            (
                change_percent(&alone, &alone.rows[0]),
                is_best(&alone, &alone.rows[0])
            ),
            (None, false)
        );
        let zero = results(vec![row("raw", 0.0), row("rnn", 92.0)]);
        assert_eq!(change_percent(&zero, &zero.rows[1]), None);
        assert_eq!(percent(Some(-0.3)), "+0 %");
    }

    #[test]
    fn the_printed_table_fits_and_holds_every_row() {
        let report = sample::report();
        let text = table(&report.results, usize::MAX);
        println!("{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 103));
        let last = report.results.rows.last().unwrap();
        let (_, end) = text.rsplit_once(" 22 ").unwrap();
        let line = end.lines().find(|line| line.contains("rnn")).unwrap();
        let order = ["rnn", "ls-bias", "raw", "ls-3x3"].map(|name| end.find(name).unwrap());
        assert!(order.is_sorted(), "{end}");
        assert!(
            line.contains(&format!("{:+.2}", last.d_north_m))
                && line.contains(&format!("{:+.3}", last.d_ve_mps))
        );
        assert_eq!(text.matches("ls-3x3").count(), 5);
        assert_eq!(text.matches(" * ").count(), 5);
    }

    #[test]
    fn narrow_terminals_get_what_is_compared_and_the_device_is_marked() {
        let mut device = row("device-4", 802.9);
        device.scheme = "device-4".into();
        let results = results(vec![row("raw", 1720.55), device]);
        for width in [40, 80, 120] {
            let text = table(&results, width);
            let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("{part}: {text}"));
            assert!(at("device-4 \u{25c2}") < at("802.90"), "{text}");
            assert!(
                at("802.90") < at("1720.55") && at("horizontal") < at("change"),
                "{text}"
            );
            let rows = text.lines().take_while(|line| !line.starts_with('('));
            let mut rows = rows.take_while(|line| !line.starts_with("change: "));
            assert!(rows.all(|line| line.chars().count() <= width), "{text}");
        }
    }

    #[test]
    fn errors_of_a_thousand_kilometres_fit_too() {
        let mut worst = row("ls-bias", 1_200_000.123);
        (worst.t_s, worst.d_north_m, worst.d_east_m) = (60 * 1440, -1_058_132.32, -1_181_780.08);
        (worst.d_vn_mps, worst.d_ve_mps) = (-1234.5678, 1234.5678);
        let text = table(
            &results(vec![
                Row {
                    scheme: "raw".into(),
                    horizontal_m: 1.0,
                    ..worst.clone()
                },
                worst,
            ]),
            usize::MAX,
        );
        assert!(
            text.lines().next().unwrap().chars().count() <= 103,
            "{text}"
        );
    }
}
