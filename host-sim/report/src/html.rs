//! The HTML page of a run: one file with its style and its pictures inside.
//!
//! It has no script and fetches nothing.

use super::drawn::Drawn;
use super::front::{Front, SIZES, over_time, three};
use super::table::{blocks, change_percent, is_best, percent};
use super::terms::terms;
use super::text::{prose, signed};
use super::verdict::{beside, device_of_results, is_device, of_results};
use host_chart::axis::grouped;
use host_chart::palette::{self, Colour};
use host_core::error::Error;
use host_lab::experiment::results::{Report, Results, Row};
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Marks a page as written by this program, so that it may be replaced.
pub(super) const MARKER: &str = "<meta name=\"generator\" content=\"host-sim report\">";

/// The whole page.
///
/// # Errors
/// [`Error::Drawing`].
pub(super) fn page(report: &Report, figures: &[Drawn]) -> Result<String, Error> {
    let results = &report.results;
    let said = of_results(results);
    let (sentence, more) = said.split_first().map_or(("", &[][..]), |(a, b)| (a, b));
    let body = html! {
        (front(report).markup(sentence)?)
        p.sub {
            "scenario " b { (results.scenario) } ", seed " b { (results.seed) }
            " (the start of all random numbers)"
        }
        (fold("All schemes in words", &sentences(more)))
        @if !report.notes.is_empty() {
            (fold("Notes", &html! {
                ul.said { @for note in &report.notes { li { (prose(note)) } } }
            }))
        }
        h2 { "Errors against the reference" }
        (results_table(results))
        (fold("What the names mean", &terms(results.rows.iter().map(|row| row.scheme.as_str()))))
        @for (number, drawn) in figures.iter().enumerate() {
            section {
                h2 { (drawn.figure.heading()) }
                (picture(drawn, Some(number + 1), drawn.figure.file()))
            }
        }
        (fold("Set-up", &set_up(report)))
        (reproduce(report))
    };
    Ok(frame(&report.title, &body).into_string())
}

/// The first screen: the errors of the device, or of the networks if it does not take part.
fn front(report: &Report) -> Front {
    let results = &report.results;
    let names = || results.rows.iter().map(|row| row.scheme.as_str());
    let device = names().rfind(|name| is_device(name)).unwrap_or("rnn");
    let highlit = [device, beside(device, names())];
    let curves = &report.curves.error_over_time;
    let proof = results.device.as_ref().and_then(|of| of.nearest.as_ref());
    let known = device_of_results(results);
    Front {
        title: "Horizontal error since the last fix".into(),
        pictures: SIZES.map(|size| over_time(curves, highlit, "min", size)),
        figures: known.map_or(vec![], |of| three(&of, proof.map(|of| of.proof))),
    }
}

/// An explanation, folded until a reader or a printer opens it.
pub(super) fn fold(title: &str, body: &Markup) -> Markup {
    html! { details.fold { summary { h2 { (title) } } (body) } }
}

/// Paragraphs.
pub(super) fn sentences(all: &[String]) -> Markup {
    html! { @for sentence in all { p { (prose(sentence)) } } }
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
                (prose(&drawn.caption)) " " a href=(file) { (file) }
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
            (grouped(row.horizontal_m, 2))
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
        table.setup {
            tbody {
                @for (label, value) in shown { tr { th.text { (label) } td.text { (prose(value)) } } }
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
        page(report, &draw(&report.curves, "min").unwrap()).unwrap()
    }

    #[test]
    fn the_page_holds_everything_and_fetches_nothing() {
        let report = sample::report();
        let text = sample_page(&report).replace('\u{2011}', "-");
        assert!(text.starts_with("<!DOCTYPE html>") && text[..1024].contains(MARKER));
        for row in &report.results.rows {
            assert!(text.contains(&grouped(row.horizontal_m, 2)));
        }
        for part in report
            .notes
            .iter()
            .chain(report.set_up.iter().map(|(_, value)| value))
        {
            assert!(text.contains(part.as_str()), "{part}");
        }
        assert_eq!(
            text.matches("<svg").count(),
            2 + 4,
            "twice on the first screen"
        );
        let outside = ["<script", "<link", "<img", "url(", "@import", "src="];
        assert!(outside.iter().all(|tag| !text.contains(tag)));
        assert_eq!(
            text.matches("http").count(),
            6,
            "the names of the SVG name space only"
        );
        assert!(text.len() < 1_000_000, "{} bytes", text.len());
    }

    #[test]
    fn sentence_picture_and_figures_stand_before_everything_else() {
        let mut report = sample::report();
        for row in &mut report.results.rows {
            row.scheme = row.scheme.replace("rnn", "device-4");
        }
        let text = sample_page(&report).replace('\u{2011}', "-");
        let (_, body) = text.split_once("<h1>").unwrap();
        let parts = body.match_indices('<').map(|(at, _)| &body[at..]);
        let parts = parts.filter(|part| {
            let names = [
                "<p ", "<p>", "<svg", "<ul", "<table", "<details", "<aside", "<dl",
            ];
            names.iter().any(|name| part.starts_with(name))
        });
        let first: Vec<&str> = parts.take(4).map(|part| &part[..8]).collect();
        assert_eq!(first, ["<p class", "<svg rol", "<svg rol", "<ul clas"]);
        let big = body
            .split_once("<ul class=\"big\">")
            .unwrap()
            .1
            .split_once("</ul>")
            .unwrap()
            .0;
        assert_eq!(big.matches("<li>").count(), 3, "{big}");
        assert!(
            body.contains("<p class=\"verdict\">Verdict: the device helps by 6"),
            "{big}"
        );
        let nothing = Results {
            rows: vec![],
            ..report.results
        };
        assert_eq!(of_results(&nothing), ["There are no results."]);
    }

    #[test]
    fn what_stands_between_backticks_is_code() {
        let mut report = sample::report();
        report.notes = vec!["The row `device` is `a < b`.".into()];
        let text = sample_page(&report);
        assert!(text.contains("<code>device</code> is <code>a &lt; b</code>."));
        assert!(!text.contains('`'));
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
        assert!(sample_page(&report).contains("dashed on data held back"));
        report
            .curves
            .learning
            .retain(|curve| !curve.name.contains("held back"));
        assert!(!sample_page(&report).contains("dashed on data"));
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
