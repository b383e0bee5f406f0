//! The page of a campaign.

use super::verdict::{UNREACHABLE, sentences};
use super::{T_MIN, forest, groups, quotient, studies};
use crate::document::{Document, Figure, Part, Table};
use crate::front::Front;
use crate::terms::scheme;
use crate::text::{counted, thousands};
use crate::verdict::{DEVICE, times};
use host_chart::axis::grouped;
use host_core::error::Error;
use host_lab::campaign::{
    AgainstNone, Decided, FEWEST, Group, Merged, NONE, Ratio, Row, Summary, Topic, against_none,
    between, fingerprint, missing,
};

/// The origin of a campaign.
#[derive(Debug, Clone)]
pub struct Origin {
    /// The commands, without options that do not change the results.
    pub commands: Vec<String>,
}

/// The page, as `Document::page` writes it. `studied`: the rows of each study beside the campaign.
///
/// # Errors
/// [`Error::Option`] for a campaign without the scheme `uncorrected`.
pub fn document(
    campaign: &Merged,
    summary: &[Summary],
    ratios: &[Ratio],
    studied: &[(Topic, Vec<Row>)],
    made: &Origin,
) -> Result<Document, Error> {
    let all = against_none(&campaign.rows, ratios, summary);
    if all.is_empty() {
        return Err(Error::Option {
            option: "--report".into(),
            problem: "the campaign has no other scheme beside 'uncorrected', or not 'uncorrected' \
                      itself, which all others are compared with"
                .into(),
            remedy: "leave --schemes out, or name uncorrected and another one".into(),
        });
    }
    let setting = &campaign.tuning.setting;
    let several = setting.drives.len() > 1;
    let mut parts = vec![];
    let each = by_drives(&all);
    let front = each.first().map(|of| front(of));
    for of in each {
        let drives = of.first().map_or(0, |of| of.drives);
        let after = match several {
            true => format!(", after {}", counted(drives, "earlier drive")),
            false => String::new(),
        };
        let groups = of.chunk_by(|a, b| a.group == b.group);
        parts.extend(groups.map(|of| part(of, drives, &after)));
    }
    let studied = studies::compared(studied, setting.start);
    parts.extend(studies::parts(&studied));
    parts.push(measured(campaign, &all));
    parts.push(schemes(&all));
    parts.push(versions(campaign, made));
    let runs = all.iter().map(|of| of.runs).max().unwrap_or(0);
    Ok(Document {
        title: format!(
            "Campaign of {}: each scheme against no correction",
            counted(runs as u64, "run")
        ),
        verdict: said(campaign, &all, &studied),
        front,
        parts,
        ..Document::default()
    })
}

/// The rows by the number of earlier drives, the most first: the verdict is that after most drives.
fn by_drives(all: &[AgainstNone]) -> Vec<&[AgainstNone]> {
    let mut each: Vec<&[AgainstNone]> = all.chunk_by(|a, b| a.drives == b.drives).collect();
    each.reverse();
    each
}

/// The verdict of a campaign, the shortest answer first: the same sentences for terminal, JSON and
/// page. Empty where nothing is compared with the scheme `uncorrected`.
#[must_use]
pub fn verdict(
    campaign: &Merged,
    summary: &[Summary],
    ratios: &[Ratio],
    studied: &[(Topic, Vec<Row>)],
) -> Vec<String> {
    let all = against_none(&campaign.rows, ratios, summary);
    if all.is_empty() {
        return vec![];
    }
    let studied = studies::compared(studied, campaign.tuning.setting.start);
    said(campaign, &all, &studied)
}

fn said(campaign: &Merged, all: &[AgainstNone], studied: &[studies::Compared]) -> Vec<String> {
    let several = campaign.tuning.setting.drives.len() > 1;
    let mut all_said = vec![];
    for of in by_drives(all) {
        let drives = of.first().map_or(0, |of| of.drives);
        let earlier = counted(drives, "earlier drive");
        let of_drives = sentences(&of.iter().collect::<Vec<_>>());
        all_said.extend(of_drives.into_iter().map(|text| match several {
            true => match text.strip_prefix("Verdict: ") {
                Some(rest) => format!("Verdict after {earlier}: {rest}"),
                None => format!("After {earlier}: {text}"),
            },
            false => text,
        }));
    }
    all_said.extend(studies::sentence(studied));
    all_said.extend(gaps(campaign));
    all_said
}

/// Schemes in the picture of the first screen.
const SHOWN: usize = 10;

/// The first screen: the errors of the device and of the best schemes over all groups of errors.
fn front(all: &[AgainstNone]) -> Front {
    let group = all.iter().find(|of| of.scheme == DEVICE).or(all.first());
    let group = group.and_then(|of| of.group);
    let mut rows: Vec<AgainstNone> = all.iter().filter(|of| of.group == group).cloned().collect();
    rows.retain(|of| !UNREACHABLE.contains(&of.scheme.as_str()));
    rows.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    let rank = rows.iter().position(|of| of.scheme == DEVICE);
    let built = rows.len();
    rows.sort_by_key(|of| of.scheme != DEVICE);
    rows.truncate(SHOWN);
    let row = (230.0 / rows.len() as f64).clamp(23.0, 60.0);
    let figures = match (rank, rows.first()) {
        (Some(rank), Some(of)) => vec![
            (
                format!("\u{d7}\u{a0}{}", times(of.ratio)),
                format!(
                    "error with the device, of the uncorrected one: {}",
                    match of.interval {
                        Some((a, b)) => format!("95 % interval {} to {}", times(a), times(b)),
                        None => "too few runs for an interval".into(),
                    }
                ),
            ),
            (
                format!(
                    "{} of {}",
                    thousands(of.worse as u64),
                    thousands(of.compared as u64)
                ),
                "comparisons in which the device is worse than no correction".into(),
            ),
            (
                format!("{} of {built}", rank + 1),
                "its rank among the schemes that can be built".into(),
            ),
        ],
        _ => vec![],
    };
    Front {
        title: format!(
            "Error of each scheme divided by the uncorrected one, {}: the device, and the best of \
             {built} schemes that can be built",
            name(group)
        ),
        pictures: [false, true].map(|narrow| forest::sized(&rows, narrow, row)),
        figures,
    }
}

/// Runs that are missing.
fn gaps(campaign: &Merged) -> Option<String> {
    let runs: Vec<String> = missing(&campaign.rows).iter().map(u32::to_string).collect();
    (!runs.is_empty()).then(|| {
        format!(
            "Runs are missing, so this is not the whole campaign: {}. Start their shards again \
             with --resume.",
            runs.join(", ")
        )
    })
}

/// The part of the page for a group of errors, or for all of them.
fn part(rows: &[AgainstNone], drives: u32, after: &str) -> Part {
    /// Height of a row, CSS pixels.
    const ROW: f64 = 21.0;
    let group = rows.first().and_then(|of| of.group);
    let (id, title) = match group {
        Some(group) => (group.to_string(), format!("Errors: {group}{after}")),
        None => ("groups".into(), format!("All groups of errors{after}")),
    };
    let about = match group {
        Some(group) => groups::sentence(group),
        None => "Each run counts once for each group of errors. Of each run the ratio is the \
                 geometric mean over the groups."
            .into(),
    };
    Part {
        sentences: vec![harmed(rows)],
        explained: vec![about],
        figures: vec![Figure {
            name: "forest",
            title: format!(
                "Errors divided by the uncorrected ones: {}{after}",
                name(group)
            ),
            caption: format!(
                "After {T_MIN} min without fixes; left of the dotted line a scheme is better than no \
                 correction. The line of a scheme is its 95 % interval. Blue with a disc: smaller \
                 errors, the interval ends below 1. Orange with a triangle: larger errors, it \
                 begins above 1. Grey with a ring: equal in every run, or \
                 not decided. What lies beyond an end of the axis stands at that end."
            ),
            picture: forest::sized(rows, false, ROW),
            narrow: Some(forest::sized(rows, true, ROW)),
        }],
        tables: vec![table(rows)],
        ..Part::new(format!("{id}-{drives}"), &title)
    }
}

fn name(group: Option<Group>) -> String {
    group.map_or_else(|| "all groups".into(), |group| group.to_string())
}

/// The schemes that do harm here.
fn harmed(rows: &[AgainstNone]) -> String {
    let worse = rows.iter().filter(|of| of.decided() == Decided::Worse);
    let worse: Vec<String> = worse
        .map(|of| format!("{} in {} of {} runs", of.scheme, of.worse, of.compared))
        .collect();
    match worse.is_empty() {
        true => "No scheme is shown to be worse than no correction here in most runs; single runs \
                 are: see the table."
            .into(),
        false => format!(
            "Worse than no correction in most runs: {}.",
            worse.join(", ")
        ),
    }
}

/// The decision, with its mark.
pub(super) fn decided(of: &AgainstNone) -> &'static str {
    match of.decided() {
        Decided::Better => "\u{25cf} better",
        Decided::Worse => "\u{25b2} worse",
        Decided::Equal => "\u{25cb} equal",
        Decided::Nothing => "\u{25cb} not decided",
    }
}

fn table(rows: &[AgainstNone]) -> Table {
    let row = |of: &AgainstNone| {
        let mut cells = vec![
            of.scheme.clone(),
            decided(of).to_owned(),
            quotient(of.ratio),
            between(of.interval, quotient),
            format!("{} of {}", of.worse, of.compared),
            quotient(of.worst),
        ];
        cells.extend(of.median_m.map(|m| grouped(m, 0)));
        cells
    };
    let mut head = vec![
        "scheme",
        "against uncorrected",
        "ratio",
        "95 % interval",
        "worse than uncorrected in",
        "at worst, times uncorrected",
    ];
    if rows.iter().any(|of| of.median_m.is_some()) {
        head.push("median error, m");
    }
    let meaning = |of: &AgainstNone| scheme(&of.scheme).map(|words| format!("{words}."));
    Table {
        head: head.into_iter().map(String::from).collect(),
        rows: rows.iter().map(row).collect(),
        text: 2,
        meanings: rows.iter().map(meaning).collect(),
        ..Table::default()
    }
}

/// The part on the method of the campaign.
fn measured(campaign: &Merged, all: &[AgainstNone]) -> Part {
    let (tuning, setting) = (&campaign.tuning, &campaign.tuning.setting);
    let drive = match setting.fixes {
        true => "drives for 22 min with fixes, from which every scheme learns, ",
        false => "gets no fixes from then on, so only what is known before counts, ",
    };
    let groups = Group::present(all.iter().filter_map(|of| of.group));
    let groups: Vec<String> = groups.iter().map(Group::to_string).collect();
    let drives: Vec<String> = setting.drives.iter().map(u32::to_string).collect();
    let runs = all.iter().map(|of| of.runs).max().unwrap_or(0);
    let simulated = &tuning.simulated;
    let pair = |label: &str, value: String| (label.to_owned(), value);
    let mut pairs = vec![
        pair("runs", runs.to_string()),
        pair("groups of errors", groups.join(", ")),
    ];
    for (label, value) in [("unit", &simulated.unit), ("vehicle", &simulated.vehicle)] {
        if !value.is_empty() {
            pairs.push(pair(label, value.clone()));
        }
    }
    pairs.extend([
        pair("at power-on the unit is", setting.start.to_string()),
        pair("earlier drives of the unit", drives.join(", ")),
    ]);
    if tuning.units > 0 {
        pairs.push(pair(
            "other units that were tuned on",
            tuning.units.to_string(),
        ));
    }
    Part {
        folded: true,
        sentences: vec![
            format!(
                "Each run has a simulated unit of its own, with errors drawn at power-on, and a \
                 road of its own. It stands for 5 min, {drive}and then navigates for {T_MIN} min \
                 without fixes, by its sensors alone. There its horizontal error is measured. All \
                 schemes see the same samples, so they are compared run by run."
            ),
            "uncorrected corrects nothing. A ratio of 0.5 means half its error, one of 2 means \
             twice as much: harm."
                .into(),
            format!(
                "The ratio is the median over the runs. Its 95 % interval is that of the sign test, \
                 which holds for every distribution of the ratios. So larger or smaller means: in \
                 more than half of all runs that could be made. How large the harm in the others \
                 is, the columns on the right show. With fewer than {FEWEST} runs there is no \
                 interval, and nothing counts as decided. Of 100 schemes that make no difference \
                 at most five are expected to have an interval beside 1."
            ),
        ],
        tables: vec![Table::of_pairs(pairs)],
        ..Part::new("measured", "How it was measured")
    }
}

/// The part that explains each scheme.
fn schemes(all: &[AgainstNone]) -> Part {
    let mut names = vec![NONE];
    for of in all {
        if !names.contains(&of.scheme.as_str()) {
            names.push(&of.scheme);
        }
    }
    let pairs = names.into_iter().filter_map(|name| {
        let words = scheme(name)?;
        Some((name.to_owned(), format!("{words}.")))
    });
    Part {
        folded: true,
        tables: vec![Table::of_pairs(pairs)],
        ..Part::new("schemes", "The schemes")
    }
}

fn versions(campaign: &Merged, made: &Origin) -> Part {
    let pair = |label: &str, value: String| (label.to_owned(), value);
    Part {
        sentences: vec![
            "The same commands make this page again, byte for byte. What decides its numbers has \
             the fingerprint below, which campaign.csv has, too."
                .into(),
        ],
        tables: vec![Table::of_pairs([
            pair("host-sim", env!("CARGO_PKG_VERSION").to_owned()),
            pair("fingerprint", fingerprint(&campaign.fingerprint)),
        ])],
        commands: made.commands.clone(),
        folded: true,
        ..Part::new("made", "Version and commands")
    }
}
