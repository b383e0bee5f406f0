//! The sentence on the noise at rest, and the figures of the first screen.

use super::figures;
use host_estimation::analysis::allan::findings::Findings;
use host_estimation::analysis::allan::{Analysis, Coefficient, Kind};

/// Ratio of the noise to the datasheet's from which on the verdict reports it.
const WORSE: f64 = 1.3;
const KINDS: [(Kind, &str); 2] = [(Kind::Gyro, "gyros"), (Kind::Accel, "accelerometers")];

/// The white noise of the worst axis of a kind, and the datasheet's.
fn white(findings: &Findings, kind: Kind) -> Option<(&Coefficient, Option<f64>)> {
    let of = findings.analyses.iter().filter(|a| a.kind == kind);
    let seen = of
        .filter_map(|a| a.coefficients.get(1))
        .filter(|n| n.is_seen());
    let worst = seen.max_by(|a, b| a.low.total_cmp(&b.low))?;
    let sheet = findings
        .configured
        .and_then(|c| c[usize::from(kind == Kind::Accel)][1]);
    Some((worst, sheet.filter(|sheet| *sheet > 0.0)))
}

/// The verdict: the white noise of both kinds of sensors, beside the datasheet if it is known.
#[must_use]
pub fn verdict(findings: &Findings) -> String {
    let there = |kind| findings.analyses.iter().any(|a| a.kind == kind);
    let each = KINDS
        .iter()
        .filter(|(kind, _)| there(*kind))
        .map(|(kind, name)| {
            let noise = format!("the white noise of the {name} is");
            let Some((worst, sheet)) = white(findings, *kind) else {
                return format!("{noise} hidden by other noise or sway");
            };
            let (value, unit) = (figures(worst.value), worst.unit);
            match sheet {
                None => format!("{noise} {value} {unit}"),
                Some(sheet) if worst.low > WORSE * sheet => format!(
                    "{noise} {:.1} times the datasheet's ({value} {unit}, datasheet {})",
                    worst.value / sheet,
                    figures(sheet)
                ),
                Some(sheet) if worst.high <= sheet => format!(
                    "{noise} as in the datasheet or less ({value} {unit}, datasheet {})",
                    figures(sheet)
                ),
                Some(sheet) => format!(
                    "{noise} about that of the datasheet ({value} {unit}, datasheet {})",
                    figures(sheet)
                ),
            }
        });
    match each.collect::<Vec<_>>().join("; ") {
        none if none.is_empty() => "Verdict: no sensor was analysed.".into(),
        all => format!("Verdict: {all}."),
    }
}

/// The figures of the first screen.
pub(super) fn three(findings: &Findings) -> Vec<(String, String)> {
    let mut out = vec![];
    for (kind, name) in KINDS {
        if let Some((worst, _)) = white(findings, kind) {
            let what = format!("white noise of the {name}, worst axis");
            out.push((format!("{} {}", figures(worst.value), worst.unit), what));
        }
    }
    let of = findings.analyses.iter().filter(|a| a.kind == Kind::Gyro);
    let points = of.flat_map(|a| a.curve.iter().map(move |p| (p, a)));
    let least = points.min_by(|a, b| a.0.deviation.total_cmp(&b.0.deviation));
    out.extend(least.map(|(p, a)| {
        let what = format!("least deviation of a gyro, at {} s", figures(p.tau_s));
        (format!("{} {}", figures(p.deviation), a.unit), what)
    }));
    out
}

/// Compares the white noise of each axis with the datasheet, in sentences.
pub(crate) fn against(findings: &Findings) -> Vec<String> {
    let mut out = vec![];
    for (kind, name) in [(Kind::Gyro, "gyros"), (Kind::Accel, "accelerometers")] {
        let stated = findings
            .configured
            .and_then(|c| c[usize::from(kind == Kind::Accel)][1]);
        let of = findings.analyses.iter().filter(|a| a.kind == kind);
        let visible: Vec<(&Analysis, &Coefficient)> = of
            .filter_map(|a| Some((a, a.coefficients.get(1)?)))
            .filter(|(_, n)| n.is_seen())
            .collect();
        if visible.is_empty() && findings.analyses.iter().any(|a| a.kind == kind) {
            out.push(format!(
                "White noise of the {name}: not compared with the datasheet, because other \
                 noise or sway hides it."
            ));
        }
        let Some(stated) = stated.filter(|stated| *stated > 0.0 && !visible.is_empty()) else {
            continue;
        };
        let worse = visible.iter().filter(|(_, n)| n.low > WORSE * stated);
        let worse: Vec<String> = worse
            .map(|(a, n)| format!("{} {:.1} times", a.column, n.value / stated))
            .collect();
        let unit = visible[0].1.unit;
        let names: Vec<&str> = visible.iter().map(|(a, _)| a.column.as_str()).collect();
        let sheet = format!("the {} {unit} of the datasheet", figures(stated));
        out.push(match worse.is_empty() {
            true => format!(
                "White noise of the {name} (seen in {}): not above {sheet}, by its 95 % intervals.",
                names.join(", ")
            ),
            false => format!(
                "White noise of the {name}: above {sheet}: {}.",
                worse.join(", ")
            ),
        });
    }
    out
}
