//! The verdict of a campaign, in sentences, harm first.

use super::{T_MIN, quotient};
use crate::verdict::DEVICE;
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
    let mut out = match (runs < FEWEST, device.is_empty()) {
        (true, _) => vec![format!(
            "Verdict: none. With {runs} of at least {FEWEST} runs nothing can be decided."
        )],
        (_, true) => vec![of_schemes(&groups)],
        (_, false) => vec![of_the_device(&device)],
    };
    out.extend(harm_by_the_device(&device));
    let of_device = whole.iter().find(|of| of.scheme == DEVICE);
    out.extend(of_device.map(|of| over_all(of)));
    let others = groups.iter().copied().filter(|of| of.scheme != DEVICE);
    out.extend(harm_by_others(&others.collect::<Vec<_>>()));
    out.extend(ranks(&whole));
    out
}

fn times(ratio: f64) -> String {
    match ratio {
        r if (0.995..9.95).contains(&r) => format!("{r:.1}"),
        r => quotient(r),
    }
}

fn named(of: &AgainstNone) -> String {
    of.group.map_or_else(String::new, |group| group.to_string())
}

/// The rows with this decision.
fn decided<'a>(of: &[&'a AgainstNone], as_this: Decided) -> Vec<&'a AgainstNone> {
    let of = of.iter().copied();
    of.filter(|of| of.decided() == as_this).collect()
}

/// The device's results.
fn of_the_device(groups: &[&AgainstNone]) -> String {
    let [harmed, helped] = [Decided::Worse, Decided::Better].map(|d| decided(groups, d));
    let n = groups.len();
    let compared: usize = groups.iter().map(|of| of.compared).sum();
    let worse: usize = groups.iter().map(|of| of.worse).sum();
    let list = |of: &[&AgainstNone]| {
        let each = of
            .iter()
            .map(|of| format!("{} ({} times)", named(of), times(of.ratio)));
        each.collect::<Vec<_>>().join(", ")
    };
    match (harmed.is_empty(), helped.is_empty(), worse) {
        (false, ..) => format!(
            "Verdict: harm. In {} of {n} groups of errors the device makes it worse \
             than no correction (none): {}.",
            harmed.len(),
            list(&harmed)
        ),
        (_, false, 0) => format!(
            "Verdict: the device helps in {} of {n} groups of errors and does harm in \
             none of {compared} comparisons with no correction (none).",
            helped.len()
        ),
        (_, false, _) => format!(
            "Verdict: the device helps in {} of {n} groups of errors, and in none is it \
             shown to do harm in most runs. But it is worse than no correction (none) in {worse} \
             of {compared} comparisons.",
            helped.len()
        ),
        (_, true, 0) => format!(
            "Verdict: it is not shown that the device helps. It is worse than no \
             correction (none) in none of {compared} comparisons."
        ),
        _ => format!(
            "Verdict: it is not shown that the device helps, and it is worse than no \
             correction (none) in {worse} of {compared} comparisons."
        ),
    }
}

/// The groups with runs in which the device is worse than none.
fn harm_by_the_device(groups: &[&AgainstNone]) -> Option<String> {
    let harm = groups.iter().filter(|of| of.worse > 0).map(|of| {
        let (group, worse, all) = (named(of), of.worse, of.compared);
        let worst = times(of.worst);
        format!("{group} {worse} of {all} runs (at worst {worst} times none)")
    });
    let harm: Vec<String> = harm.collect();
    (!harm.is_empty()).then(|| format!("The device is worse than none in: {}.", harm.join("; ")))
}

/// The device over all groups.
fn over_all(whole: &AgainstNone) -> String {
    let interval = match whole.interval {
        Some((low, high)) => format!("95 % interval {} to {}", times(low), times(high)),
        None => "no interval: too few runs".to_owned(),
    };
    format!(
        "Over all groups its error after {T_MIN} min without fixes is {} times that of none in \
         the median run ({interval}).",
        times(whole.ratio)
    )
}

/// The schemes' results if the device does not take part.
fn of_schemes(groups: &[&AgainstNone]) -> String {
    let harmed = decided(groups, Decided::Worse);
    let compared: usize = groups.iter().map(|of| of.compared).sum();
    let worse: usize = groups.iter().map(|of| of.worse).sum();
    let counted = format!("worse than no correction (none) in {worse} of {compared} comparisons");
    match harmed.is_empty() {
        true => format!(
            "Verdict: of no scheme it is shown that it does harm in most runs. Single runs are \
             {counted}."
        ),
        false => format!(
            "Verdict: harm. In {} of {} pairs of a scheme and a group of errors the scheme makes \
             it worse in most runs, and single runs are {counted}.",
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
            "{group}: {} of {}, most of all {scheme} ({} times none, worse in {} of {} runs)",
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
    let best = best.map(|of| format!("{} ({} times none)", of.scheme, times(of.ratio)));
    let mut text = format!(
        "Of the schemes that can be built these have the least errors over all groups: {}.",
        best.collect::<Vec<_>>().join(", ")
    );
    if let Some(index) = sorted.iter().position(|of| of.scheme == DEVICE) {
        text += &format!(" The device is number {} of {}.", index + 1, sorted.len());
    }
    Some(text)
}
