//! The verdict of a campaign, in sentences, harm first.

use super::T_MIN;
use crate::text::counted;
use crate::verdict::{DEVICE, Device, Effect, Several, times};
use host_lab::campaign::{AgainstNone, Decided, FEWEST};

/// Schemes with knowledge that is not available in practice.
pub(super) const UNREACHABLE: [&str; 3] = ["oracle", "limit", "floor"];

/// All sentences on the schemes after one number of earlier drives. The first is the shortest
/// answer.
pub(super) fn sentences(all: &[&AgainstNone]) -> Vec<String> {
    let Some(runs) = all.iter().map(|of| of.runs).max() else {
        return vec!["Verdict: there are no runs.".into()];
    };
    let real = |of: &&&AgainstNone| !UNREACHABLE.contains(&of.scheme.as_str());
    let (groups, whole): (Vec<&AgainstNone>, Vec<&AgainstNone>) =
        all.iter().filter(real).partition(|of| of.group.is_some());
    let of_device = groups.iter().copied().filter(|of| of.scheme == DEVICE);
    let device: Vec<&AgainstNone> = of_device.collect();
    let over_all = whole.iter().find(|of| of.scheme == DEVICE);
    let harmed = !decided(&device, Decided::Worse).is_empty();
    let mut out = match (runs < FEWEST, over_all.or(device.first())) {
        (true, _) => vec![format!(
            "Verdict: open. With {runs} of at least {FEWEST} runs nothing can be decided."
        )],
        (_, None) => vec![of_schemes(&groups)],
        (_, Some(of)) if harmed => {
            vec![
                of_the_device(&device),
                of_device_over_all(of)
                    .sentence()
                    .replace("Verdict: ", "Over all groups: "),
            ]
        }
        (_, Some(of)) => vec![of_device_over_all(of).sentence()],
    };
    out.extend(harm_by_the_device(&device));
    let others = groups.iter().copied().filter(|of| of.scheme != DEVICE);
    out.extend(harm_by_others(&others.collect::<Vec<_>>()));
    out.extend(ranks(&whole));
    out
}

fn named(of: &AgainstNone) -> String {
    of.group.map_or_else(String::new, |group| group.to_string())
}

/// The rows with this decision.
fn decided<'a>(of: &[&'a AgainstNone], as_this: Decided) -> Vec<&'a AgainstNone> {
    let of = of.iter().copied();
    of.filter(|of| of.decided() == as_this).collect()
}

/// The groups of errors in which the device harms.
fn of_the_device(groups: &[&AgainstNone]) -> String {
    let harmed = decided(groups, Decided::Worse);
    let each = harmed
        .iter()
        .map(|of| format!("{} ({} times the error)", named(of), times(of.ratio)));
    format!(
        "Verdict: the device harms in {} of {}: {}.",
        harmed.len(),
        match groups.len() {
            1 => "1 group of errors".to_owned(),
            n => format!("{n} groups of errors"),
        },
        each.collect::<Vec<_>>().join(", ")
    )
}

/// The device over all groups of errors, or in the only one.
pub(super) fn of_device_over_all(of: &AgainstNone) -> Device {
    let interval = match of.interval {
        Some((low, high)) => format!("95 % interval {} to {}", times(low), times(high)),
        None => "no interval: too few runs".to_owned(),
    };
    let why = match of.drives {
        0 => "what it learns acts from the next power-on, and no drive went before",
        _ => "nothing that it learnt in the earlier drives was proved",
    };
    Device {
        after: format!("after {T_MIN} min without fixes"),
        metres: [of.ratio, 1.0],
        several: Some(Several {
            ratio: of.ratio,
            between: format!(
                "median of {}, {interval}; worse in {} of {}",
                counted(of.runs as u64, "run"),
                of.worse,
                counted(of.compared as u64, "comparison")
            ),
            decided: match of.decided() {
                Decided::Better => Effect::Helps,
                Decided::Worse => Effect::Harms,
                Decided::Equal | Decided::Nothing => Effect::Open,
            },
        }),
        waits: (of.decided() == Decided::Equal).then(|| why.to_owned()),
        earlier: vec![],
    }
}

/// The groups with runs in which the device is worse than none.
fn harm_by_the_device(groups: &[&AgainstNone]) -> Option<String> {
    let harm = groups.iter().filter(|of| of.worse > 0).map(|of| {
        let (group, worse, all) = (named(of), of.worse, of.compared);
        let worst = times(of.worst);
        format!("{group} {worse} of {all} runs (at worst {worst} times the uncorrected error)")
    });
    let harm: Vec<String> = harm.collect();
    (!harm.is_empty()).then(|| {
        format!(
            "The device is worse than no correction in: {}.",
            harm.join("; ")
        )
    })
}

/// The schemes' results if the device does not take part.
fn of_schemes(groups: &[&AgainstNone]) -> String {
    let harmed = decided(groups, Decided::Worse);
    let compared: usize = groups.iter().map(|of| of.compared).sum();
    let worse: usize = groups.iter().map(|of| of.worse).sum();
    let counted = format!("worse than no correction in {worse} of {compared} comparisons");
    match harmed.is_empty() {
        true => format!(
            "Verdict: the device does not take part. No other scheme is shown to harm in most runs; \
             single runs are {counted}."
        ),
        false => format!(
            "Verdict: the device does not take part. In {} of {} pairs of a scheme and a group of \
             errors the scheme harms in most runs, and single runs are {counted}.",
            harmed.len(),
            groups.len()
        ),
    }
}

/// Number of other schemes that do harm in each group, and the worst of them.
fn harm_by_others(others: &[&AgainstNone]) -> Option<String> {
    let groups = others.chunk_by(|a, b| a.group == b.group);
    let of_group = |of: &[&AgainstNone]| {
        let harmed = decided(of, Decided::Worse);
        let worst = harmed.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio))?;
        let (group, scheme) = (named(worst), &worst.scheme);
        Some(format!(
            "{group}: {} of {}, most of all {scheme} ({} times the uncorrected error, worse in {} of {} runs)",
            harmed.len(),
            of.len(),
            times(worst.ratio),
            worst.worse,
            worst.compared
        ))
    };
    let each: Vec<String> = groups.filter_map(of_group).collect();
    (!each.is_empty()).then(|| {
        format!(
            "Other schemes that make it worse in most runs, by group of errors: {}.",
            each.join("; ")
        )
    })
}

/// The three best schemes over all groups, and the rank of the device.
fn ranks(whole: &[&AgainstNone]) -> Option<String> {
    let mut sorted = whole.to_vec();
    sorted.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    if sorted.len() < 2 {
        return None;
    }
    let best = sorted.iter().take(3);
    let best = best.map(|of| format!("{} ({} times)", of.scheme, times(of.ratio)));
    let mut text = format!(
        "Of the schemes that can be built these have the least errors over all groups, as multiples of the uncorrected error: {}.",
        best.collect::<Vec<_>>().join(", ")
    );
    if let Some(index) = sorted.iter().position(|of| of.scheme == DEVICE) {
        text += &format!(" The device is number {} of {}.", index + 1, sorted.len());
    }
    Some(text)
}
