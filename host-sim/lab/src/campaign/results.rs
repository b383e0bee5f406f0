//! `docs/RESULTS.md`: prose of `assets/results.md` around generated tables.

use super::memory::without_memory;
use super::schemes::{FILTERS, LEARNER, TUNED};
use super::statistics::{Summary, between};
use super::studies::{Topic, of_causes, of_drives, of_labelled};
use super::tuning::{factor_text, walk_text};
use super::{Group, Merged, Ratio, Row, SCHEMES};
use std::fmt::Write;

const TEMPLATE: &str = include_str!("../../../assets/results.md");
const STUDIES: &str = include_str!("../../../assets/studies.md");
/// Time of free-inertial navigation in the tables, min.
const T_MIN: u32 = 22;
const FLOOR: &str = "floor";

/// The whole file. `command` regenerates it.
#[must_use]
pub fn results(
    command: &str,
    campaign: &Merged,
    summary: &[Summary],
    ratios: &[Ratio],
    studies: &[(Topic, Vec<Row>)],
) -> String {
    let shown = |scheme: &str| without_memory(scheme).is_none();
    let last = summary.iter();
    let last: Vec<&Summary> = last
        .filter(|s| s.t_min == T_MIN && shown(&s.scheme))
        .collect();
    let ratios: Vec<&Ratio> = ratios.iter().filter(|r| r.t_min == T_MIN).collect();
    let runs = last.iter().map(|s| s.n).max().unwrap_or(0);
    ["ekf6", "ekf-exp", "ekf-temp"]
        .into_iter()
        .fold(TEMPLATE.to_owned(), |text, other| {
            text.replace(&format!("{{of {other}}}"), &over_all(&ratios, other))
        })
        .replace("{command}", command)
        .replace("{runs}", &runs.to_string())
        .replace("{version}", &crate::version())
        .replace("{fingerprint}", &super::fingerprint(&campaign.fingerprint))
        .replace("{medians}", &medians(&last))
        .replace("{goals}", &goals(&last))
        .replace("{tuning}", &tuning(campaign, &last))
        .replace("{studies}", &of_studies(studies))
        .replace("{ratios device}", &against_all(&ratios))
}

/// The part of the file about the studies: prose of `assets/studies.md` around their tables.
fn of_studies(studies: &[(Topic, Vec<Row>)]) -> String {
    if studies.is_empty() {
        return "The campaign ran without `--studies`.".to_owned();
    }
    let rows = |topic: Topic| {
        let found = studies.iter().find(|(of, _)| *of == topic);
        found.map_or(&[][..], |(_, rows)| rows)
    };
    let labelled = |name: &dyn Fn(Topic) -> Option<&'static str>| -> Vec<(String, Vec<Row>)> {
        let all = studies.iter();
        all.filter_map(|(topic, rows)| Some((name(*topic)?.to_owned(), rows.clone())))
            .collect()
    };
    let starts = labelled(&|topic| match topic {
        Topic::Start(name) => Some(name),
        _ => None,
    });
    let vehicles = labelled(&|topic| match topic {
        Topic::Vehicle(name) => Some(name),
        _ => None,
    });
    let causes = rows(Topic::Causes);
    let runs = causes.iter().map(|row| row.run + 1).max().unwrap_or(0);
    STUDIES
        .trim_end()
        .replace("{study runs}", &runs.to_string())
        .replace("{causes}", &of_causes(causes, "linear"))
        .replace("{causes alone}", &of_causes(causes, "noise"))
        .replace("{starts}", &of_labelled("start, errors", &starts))
        .replace("{vehicles}", &of_labelled("vehicle, errors", &vehicles))
        .replace("{drives}", &of_drives(rows(Topic::Drives)))
}

pub(super) fn metres(x: f64) -> String {
    format!("{x:.0}")
}

fn interval(r: &Ratio) -> String {
    let ends = between(r.interval(), |x| format!("{x:.2}"));
    format!("{:.2} ({ends})", r.ratio)
}

fn models(last: &[&Summary]) -> Vec<Group> {
    Group::present(last.iter().map(|s| s.error_model))
}

/// Names of the schemes, the floor last. Filters with a memory are left out, since theirs is empty
/// here.
fn names() -> Vec<&'static str> {
    let names = SCHEMES.iter().map(|(name, _)| *name);
    let shown = names.filter(|name| without_memory(name).is_none());
    shown.chain([FLOOR]).collect()
}

pub(super) fn table(head: &[String], rows: &[Vec<String>]) -> String {
    let mut out = String::new();
    let rule = vec!["---".to_string(); head.len()];
    for row in [head, &rule]
        .into_iter()
        .chain(rows.iter().map(Vec::as_slice))
    {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out.trim_end().to_string()
}

pub(super) fn header<'a>(first: &'a str, rest: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    [first].into_iter().chain(rest).map(String::from).collect()
}

/// Median and worst error of each scheme by group of errors. The schemes of an ablation come before
/// the floor.
fn medians(last: &[&Summary]) -> String {
    let mut schemes = names();
    let floor = schemes.pop();
    for summary in last {
        let name = summary.scheme.as_str();
        if !schemes.contains(&name) && name != FLOOR {
            schemes.push(name);
        }
    }
    let models = models(last);
    let is_there = |scheme: &&str| last.iter().any(|s| s.scheme == *scheme);
    let rows: Vec<Vec<String>> = schemes
        .into_iter()
        .chain(floor)
        .filter(is_there)
        .map(|scheme| {
            let cell = |model: &Group| {
                last.iter()
                    .find(|s| s.error_model == *model && s.scheme == scheme)
                    .map_or_else(String::new, |s| {
                        format!("{} / {}", metres(s.median_m), metres(s.max_m))
                    })
            };
            let row = [scheme.to_owned()].into_iter();
            row.chain(models.iter().map(cell)).collect()
        })
        .collect();
    let groups: Vec<String> = models.iter().map(ToString::to_string).collect();
    table(&header("scheme", groups.iter().map(String::as_str)), &rows)
}

/// The classical filters, which could be used instead.
fn classical() -> impl Iterator<Item = &'static str> {
    names().into_iter().filter(|name| name.starts_with("ekf"))
}

/// The learner from fixes divided by the best classical filter, the oracle, no model and the floor.
fn goals(last: &[&Summary]) -> String {
    let groups = models(last);
    let of = |by: Measure, name: &str, model: Group| {
        let found = last
            .iter()
            .find(|s| s.error_model == model && s.scheme == name);
        found.map_or(f64::NAN, |s| by(s))
    };
    let measures: [Measure; 2] = [|s| s.median_m, |s| s.mean_m];
    let least = |by: &dyn Fn(&str) -> f64| {
        let all = classical().map(|name| (name, by(name)));
        all.min_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or(("", f64::NAN))
    };
    let line = |label: String, value: &dyn Fn(Measure, &str) -> f64| {
        let mut row = vec![label];
        for by in measures {
            let (name, best) = least(&|name| value(by, name));
            row.push(format!("{:.2} ({name})", value(by, LEARNER) / best));
        }
        for other in ["oracle", "uncorrected", FLOOR] {
            let [a, b] = measures.map(|by| value(by, LEARNER) / value(by, other));
            row.push(format!("{a:.2} / {b:.2}"));
        }
        row
    };
    let mut rows: Vec<Vec<String>> = groups
        .iter()
        .map(|&model| line(model.to_string(), &|by, name| of(by, name, model)))
        .collect();
    rows.push(line("geometric mean".into(), &|by, name| {
        let sum: f64 = groups.iter().map(|&m| of(by, name, m).ln()).sum();
        (sum / groups.len() as f64).exp()
    }));
    let head = [
        "best classical, median",
        "mean",
        "oracle, median / mean",
        "uncorrected",
        "floor",
    ];
    table(&header("errors", head), &rows)
}

type Measure = fn(&Summary) -> f64;

/// The learner against another scheme over all groups of errors.
fn of_all<'a>(ratios: &[&'a Ratio], other: &str) -> Option<&'a Ratio> {
    let of = |r: &&&Ratio| r.error_model.is_none() && r.scheme == LEARNER && r.baseline == other;
    ratios.iter().find(of).copied()
}

/// The same as words of a sentence.
fn over_all(ratios: &[&Ratio], other: &str) -> String {
    of_all(ratios, other).map_or_else(|| "(not run)".into(), |r| format!("{:.2}", r.ratio))
}

/// The learner against each of the others over all groups of errors.
fn against_all(ratios: &[&Ratio]) -> String {
    let row = |other: &str| {
        let r = of_all(ratios, other)?;
        Some(vec![
            other.to_owned(),
            interval(r),
            format!("{} of {}", r.better, r.n),
        ])
    };
    let rows: Vec<Vec<String>> = names().into_iter().filter_map(row).collect();
    table(&header("against", ["ratio", "better"]), &rows)
}

/// Every scheme against every other after the whole time, one pair a line: the file beside the
/// page.
#[must_use]
pub fn ratios_csv(ratios: &[Ratio]) -> String {
    let mut out = "errors,scheme,baseline,ratio,lo95,hi95,better,runs\n".to_owned();
    for r in ratios.iter().filter(|r| r.t_min == T_MIN) {
        let errors = r
            .error_model
            .map_or("all groups".to_owned(), |g| g.to_string());
        let end = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.2}"));
        let _ = writeln!(
            out,
            "{errors},{},{},{:.2},{},{},{},{}",
            r.scheme,
            r.baseline,
            r.ratio,
            end(r.lo95),
            end(r.hi95),
            r.better,
            r.n
        );
    }
    out
}

fn tuning(campaign: &Merged, last: &[&Summary]) -> String {
    let rows: Vec<Vec<String>> = models(last)
        .into_iter()
        .map(|model| {
            let t = campaign.tuning.of(model);
            let walks = t.walks.map(walk_text);
            let factors = [t.none_factor, t.rnn_factor].map(factor_text);
            let name = [model.to_string()];
            name.into_iter().chain(walks).chain(factors).collect()
        })
        .collect();
    let filters = FILTERS.map(|name| format!("walk of `{name}{TUNED}`"));
    let factors = ["noise factor of `uncorrected`", "of `rnn-window`"].map(str::to_owned);
    let head = filters.iter().chain(&factors).map(String::as_str);
    table(&header("errors", head), &rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Row, Tuning, ratios, summarise};
    use host_core::simulator::imu::ErrorModelName;
    use host_core::simulator::imu::world::StartName;

    #[test]
    fn every_place_in_the_text_is_filled() {
        let mut rows = Vec::new();
        for run in 0..3_u32 {
            for (i, name) in names().into_iter().enumerate() {
                let h = f64::from(run + 1) * (i + 1) as f64 * 100.0;
                rows.push(Row::north(ErrorModelName::All, run, name, h));
                if name == "device" {
                    rows.push(Row::north(ErrorModelName::All, run, LEARNER, h));
                }
            }
        }
        let merged = Merged {
            rows: rows.clone(),
            tuning: Tuning::default(),
            fingerprint: "x".into(),
        };
        let cold = StartName::Cold;
        let text = results(
            "the command",
            &merged,
            &summarise(&rows, cold),
            &ratios(&rows, cold),
            &[
                (Topic::Causes, rows.clone()),
                (Topic::Start("hot"), rows.clone()),
            ],
        );
        assert!(!text.contains(['{', '}']), "{text}");
        assert!(
            text.contains("leaves 9.50 of the error of six biases"),
            "{text}"
        );
        assert!(text.contains("| hot, all | 200 |"), "{text}");
        assert!(text.contains("the command") && text.contains("| uncorrected | 200 / 300 |"));
        let pairs = ratios_csv(&ratios(&rows, cold));
        assert!(
            pairs.contains("\nall,device,uncorrected,19.00,,,0,3\n"),
            "{pairs}"
        );
        // device is the nineteenth scheme, ekf6 the second and the best classical one, the
        // oracle the seventeenth
        assert!(
            text.contains("| all | 9.50 (ekf6) | 9.50 (ekf6) | 1.12 / 1.12 |"),
            "{text}"
        );
        assert!(
            text.contains("| uncorrected | 19.00 (too few runs) | 0 of 3 |"),
            "{text}"
        );
    }
}
