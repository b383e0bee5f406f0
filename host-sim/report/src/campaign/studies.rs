//! The studies beside a campaign, on its page: the device's results in each of them.

use super::page::decided;
use super::{quotient, verdict};
use crate::document::{Part, Table};
use crate::text::counted;
use crate::verdict::DEVICE;
use host_chart::axis::grouped;
use host_core::simulator::imu::world::StartName;
use host_lab::campaign::{
    AgainstNone, Decided, Row, Topic, against_none, between, ratios, summarise,
};

/// A study with each scheme against none.
pub(super) struct Compared {
    topic: Topic,
    all: Vec<AgainstNone>,
}

/// Compares the rows of each study.
pub(super) fn compared(studies: &[(Topic, Vec<Row>)], start: StartName) -> Vec<Compared> {
    let of = |(topic, rows): &(Topic, Vec<Row>)| Compared {
        topic: *topic,
        all: against_none(rows, &ratios(rows, start), &summarise(rows, start)),
    };
    studies.iter().map(of).collect()
}

/// The device's results in all studies, and the groups with harm. `None` without studies.
pub(super) fn sentence(studies: &[Compared]) -> Option<String> {
    let device = |of: &Compared| -> Vec<AgainstNone> { of.device().cloned().collect() };
    let all: Vec<AgainstNone> = studies.iter().flat_map(device).collect();
    let harmed: Vec<String> = studies
        .iter()
        .flat_map(|study| {
            let worse = study.device().filter(|of| of.decided() == Decided::Worse);
            worse.map(|of| {
                let (name, ratio) = (named(of), quotient(of.ratio));
                format!("{}: {name} ({ratio} times)", study.title())
            })
        })
        .collect();
    let compared: usize = all.iter().map(|of| of.compared).sum();
    let worse: usize = all.iter().map(|of| of.worse).sum();
    let single = format!(
        "in single runs it is worse than no correction in {worse} of {compared} comparisons"
    );
    (!all.is_empty()).then(|| match harmed.is_empty() {
        true => format!(
            "In none of {} groups of errors of the studies below is it shown that the device does \
             harm in most runs; {single}.",
            all.len()
        ),
        false => format!(
            "Harm in the studies below: in {} of {} groups of errors the device makes it worse in \
             most runs, {}; {single}.",
            harmed.len(),
            all.len(),
            harmed.join(", ")
        ),
    })
}

/// A part of the page for each study.
pub(super) fn parts(studies: &[Compared]) -> impl Iterator<Item = Part> + '_ {
    studies.iter().map(|study| {
        let several = study.all.iter().any(|of| of.drives != study.all[0].drives);
        let each = study.all.chunk_by(|a, b| a.drives == b.drives);
        let sentences = each.flat_map(|of| {
            let drives = of[0].drives;
            let said = verdict::sentences(&of.iter().collect::<Vec<_>>());
            said.into_iter().map(move |text| match several {
                true => format!("After {}: {text}", counted(drives, "earlier drive")),
                false => text,
            })
        });
        Part {
            sentences: sentences.collect(),
            tables: vec![study.table(several)],
            ..Part::new(
                format!("study-{}", study.topic),
                &format!("Study: {}", study.title()),
            )
        }
    })
}

fn named(of: &AgainstNone) -> String {
    of.group.map_or_else(String::new, |group| group.to_string())
}

impl Compared {
    /// The device's results in each group of errors.
    fn device(&self) -> impl Iterator<Item = &AgainstNone> {
        let groups = self.all.iter().filter(|of| of.group.is_some());
        groups.filter(|of| of.scheme == DEVICE)
    }

    fn title(&self) -> String {
        match self.topic {
            Topic::Causes => "each cause of errors alone".into(),
            Topic::Start(name) => format!("{name} start"),
            Topic::Vehicle(name) => format!("vehicle {name}"),
            Topic::Drives => "earlier drives, and none of the judged drive's fixes".into(),
        }
    }

    /// A row for each group of errors, and for each number of earlier drives if there are several.
    fn table(&self, several: bool) -> Table {
        let row = |of: &AgainstNone| {
            let beside = self.all.iter().filter(|other| {
                (other.group, other.drives) == (of.group, of.drives)
                    && other.scheme != DEVICE
                    && !verdict::UNREACHABLE.contains(&other.scheme.as_str())
            });
            let others: Vec<&AgainstNone> = beside.collect();
            let harmed = others
                .iter()
                .filter(|of| of.decided() == Decided::Worse)
                .count();
            let name = match several {
                true => format!("{}, after {} drives", named(of), of.drives),
                false => named(of),
            };
            vec![
                name,
                decided(of).to_owned(),
                quotient(of.ratio),
                between(of.interval, quotient),
                format!("{} of {}", of.worse, of.compared),
                quotient(of.worst),
                of.median_m.map_or_else(String::new, |m| grouped(m, 0)),
                format!("{harmed} of {}", others.len()),
            ]
        };
        let head = [
            "errors",
            "the device against uncorrected",
            "ratio",
            "95 % interval",
            "worse than uncorrected in",
            "at worst, times uncorrected",
            "median error, m",
            "other schemes that do harm",
        ];
        Table {
            head: head.map(String::from).to_vec(),
            rows: self.device().map(row).collect(),
            text: 2,
            ..Table::default()
        }
    }
}
