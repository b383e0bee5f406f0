//! The HTML page of a run: one file with its style and its pictures inside.
//!
//! It has no script and fetches nothing.

use super::drawn::Drawn;
use super::palette::{self, Colour};
use super::table::{blocks, change_percent, is_best, percent};
use super::terms::terms;
use super::text::{signed, unbroken};
use super::verdict::of_results;
use host_lab::experiment::results::{Report, Results, Row};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Marks a page as written by this program, so that it may be replaced.
pub(super) const MARKER: &str = "<meta name=\"generator\" content=\"host-sim report\">";

/// The whole page.
pub(super) fn page(report: &Report, figures: &[Drawn]) -> String {
    let results = &report.results;
    let body = html! {
        p.sub {
            "scenario " b { (results.scenario) } ", seed " b { (results.seed) }
            " (the start of all random numbers)"
        }
        (verdict(&of_results(results)))
        (terms(results.rows.iter().map(|row| row.scheme.as_str())))
        @if !report.notes.is_empty() {
            aside { h2 { "Read this first" } ul { @for note in &report.notes { li { (note) } } } }
        }
        h2 { "Errors against the reference" }
        (results_table(results))
        @for (number, drawn) in figures.iter().enumerate() {
            section {
                h2 { (drawn.figure.heading()) }
                (picture(drawn, Some(number + 1), drawn.figure.file()))
            }
        }
        (set_up(report))
        (reproduce(report))
    };
    frame(&report.title, &body).into_string()
}

/// A whole page: its head, its title, and `body` below them.
pub(super) fn frame(title: &str, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                (PreEscaped(MARKER))
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(style())) }
            }
            body {
                main {
                    h1 { (title) }
                    (body)
                }
            }
        }
    }
}

/// A picture with its caption and the name of its file.
pub(super) fn picture(drawn: &Drawn, number: Option<usize>, file: &str) -> Markup {
    html! {
        figure {
            div.wide { (PreEscaped(&drawn.svg)) }
            figcaption {
                @if let Some(number) = number { b { "Figure " (number) ". " } }
                (unbroken(&drawn.caption)) " " a href=(file) { (file) }
            }
        }
    }
}

/// The verdict, its headline marked.
pub(super) fn verdict(sentences: &[String]) -> Markup {
    html! {
        @for (k, sentence) in sentences.iter().enumerate() {
            p.finding {
                @if k == 0 { b { (unbroken(sentence)) } } @else { (unbroken(sentence)) }
            }
        }
    }
}

fn results_table(results: &Results) -> Markup {
    html! {
        div.wide {
            table.results {
                thead {
                    tr {
                        th { "time" br; "min" } th.text { "scheme" }
                        th { "horizontal" br; "error, m" } th { "change" br; "against raw" }
                        th { "latitude" br; "error, m" } th { "longitude" br; "error, m" }
                        th { "north velocity" br; "error, m/s" }
                        th { "east velocity" br; "error, m/s" }
                    }
                }
                @for block in blocks(results) {
                    tbody {
                        @for (line, row) in block.iter().enumerate() {
                            tr.best[is_best(results, row)] {
                                @if line == 0 { th rowspan=(block.len()) { (row.t_s / 60) } }
                                (results_row(results, row))
                            }
                        }
                    }
                }
            }
        }
        p.legend {
            "Time is that since the start of free-inertial navigation. Latitude error is positive "
            "north, longitude error positive east. The change is that of the horizontal error "
            "against " i { "raw" } " at the same time: \u{2212} is a smaller error, "
            span.worse { "+ a larger one" } ". " span.star { "\u{2605}" }
            " marks the least horizontal error of its time."
        }
    }
}

/// Name of a scheme with the colour of its curves.
pub(super) fn scheme_cell(scheme: &str) -> Markup {
    let colour = palette::scheme(scheme).colour.name;
    html! {
        td.text { span.chip style={ "background:var(--" (colour) ")" } {} (scheme) }
    }
}

fn results_row(results: &Results, row: &Row) -> Markup {
    let change = change_percent(results, row);
    html! {
        (scheme_cell(&row.scheme))
        td.main {
            @if is_best(results, row) { span.star title="least of its time" { "\u{2605} " } }
            (format!("{:.2}", row.horizontal_m))
        }
        td.worse[change.is_some_and(|change| change >= 0.5)] {
            @if change.is_some() { (percent(change).replace('-', "\u{2212}")) }
            @else { "\u{2013}" }
        }
        td { (signed(row.d_north_m, 2)) } td { (signed(row.d_east_m, 2)) }
        td { (signed(row.d_vn_mps, 3)) } td { (signed(row.d_ve_mps, 3)) }
    }
}

fn set_up(report: &Report) -> Markup {
    let shown = report.set_up.iter().filter(|(label, _)| label != "command");
    html! {
        h2 { "Set-up" }
        table.setup {
            tbody {
                @for (label, value) in shown { tr { th.text { (label) } td.text { (value) } } }
            }
        }
    }
}

fn reproduce(report: &Report) -> Markup {
    let command = report.set_up.iter().find(|(label, _)| label == "command");
    html! {
        h2 { "How to reproduce" }
        @if let Some((_, command)) = command {
            pre { (command) }
            p { "The same command gives the same numbers, because all random numbers follow from the seed." }
        } @else {
            p {
                "Run scenario " b { (report.results.scenario) } " with seed "
                b { (report.results.seed) } ". All random numbers follow from the seed."
            }
        }
    }
}

/// The style sheet: the colours as variables, and the colours of the pictures mapped onto them, so
/// that the pictures adapt to a dark screen.
pub(super) fn style() -> String {
    let variables = |pick: fn(Colour) -> &'static str| -> String {
        let variable = |colour: Colour| format!("--{}:{};", colour.name, pick(colour));
        palette::all().map(variable).concat()
    };
    let mapped = palette::all().map(|c| {
        format!(
            "svg [stroke=\"{0}\"]{{stroke:var(--{1})}}svg [fill=\"{0}\"]{{fill:var(--{1})}}\n",
            c.light, c.name
        )
    });
    let mapped = mapped.concat();
    let light = variables(|colour| colour.light);
    let dark = variables(|colour| colour.dark);
    format!(
        ":root{{{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{mapped}{}",
        include_str!("page.css")
    )
}

#[cfg(test)]
mod tests {
    use super::super::drawn::draw;
    use super::super::sample;
    use super::*;

    fn sample_page(report: &Report) -> String {
        page(report, &draw(&report.curves).unwrap())
    }

    #[test]
    fn the_page_holds_everything_and_fetches_nothing() {
        let report = sample::report();
        let text = sample_page(&report);
        assert!(text.starts_with("<!DOCTYPE html>") && text[..1024].contains(MARKER));
        for row in &report.results.rows {
            assert!(text.contains(&format!("{:.2}", row.horizontal_m)));
        }
        for part in report
            .notes
            .iter()
            .chain(report.set_up.iter().map(|(_, value)| value))
        {
            assert!(text.contains(part.as_str()), "{part}");
        }
        assert_eq!(text.matches("<svg").count(), 4);
        let outside = ["<script", "<link", "<img", "url(", "@import", "src="];
        assert!(outside.iter().all(|tag| !text.contains(tag)));
        assert_eq!(
            text.matches("http").count(),
            4,
            "the names of the SVG name space only"
        );
        assert!(text.len() < 1_000_000, "{} bytes", text.len());
    }

    #[test]
    fn the_verdict_stands_before_everything_else() {
        let text = sample_page(&sample::report()).replace('\u{2011}', "-");
        let at = |part: &str| text.find(part).unwrap_or_else(|| panic!("no '{part}'"));
        assert!(at("<b>Verdict: mixed.") < at("strapdown navigator adds up"));
        assert!(text.contains("Worse than that: ls-3x3") && text.contains("Better than that: rnn"));
        let nothing = Results {
            schema: 3,
            scenario: "x".into(),
            seed: 0,
            rows: vec![],
        };
        assert_eq!(of_results(&nothing), ["There are no results."]);
    }

    #[test]
    fn a_larger_error_is_marked_as_such() {
        let report = sample::report();
        let larger = report
            .results
            .rows
            .iter()
            .filter(|row| change_percent(&report.results, row) >= Some(0.5))
            .count();
        assert!(larger > 0);
        assert_eq!(
            sample_page(&report)
                .matches("<td class=\"worse\">+")
                .count(),
            larger
        );
    }

    #[test]
    fn text_from_outside_is_escaped() {
        let mut report = sample::report();
        report.title = "<script>alert(1)</script>".into();
        report.notes = vec!["a < b & c".into()];
        report.curves.track[1].name = "<b>".into();
        let text = sample_page(&report);
        assert!(
            !text.contains("<script")
                && text.contains("a &lt; b &amp; c")
                && !text.contains("<b></text>")
        );
    }

    #[test]
    fn without_truth_and_learning_the_captions_say_so() {
        let mut report = sample::report();
        report.curves.learning.clear();
        for trace in &mut report.curves.traces {
            trace.truth.clear();
        }
        let text = sample_page(&report);
        assert!(
            text.contains("No network was trained")
                && text.contains("the true error of recorded data is unknown")
        );
    }
}
