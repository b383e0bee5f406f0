//! The studies beside a campaign's own groups: each single cause, each kind of start, each vehicle,
//! and earlier drives. Each is a campaign of its own, in a directory of its own.

use super::results::{header, metres, table};
use super::statistics::median;
use super::{Campaign, FixErrors, Group, Row};
use crate::experiment::run::TIMES_MIN;
use host_core::error::Error;
use host_core::simulator::imu::ErrorModelName;
use std::collections::BTreeMap;

/// Schemes of the tables.
const SCHEMES: [&str; 11] = [
    "uncorrected",
    "ekf6",
    "ekf12",
    "ekf24",
    "ekf-ramp",
    "ekf-exp",
    "ekf-temp",
    "ekf-inputs",
    "oracle",
    "device",
    "zupt",
];
/// The schemes in the tables of causes.
const OF_CAUSES: [&str; 8] = [
    "uncorrected",
    "ekf6",
    "ekf24",
    "ekf-exp",
    "ekf-temp",
    "ekf-inputs",
    "oracle",
    "device",
];
/// Schemes of the table of earlier drives.
const REMEMBERING: [&str; 7] = [
    "uncorrected",
    "ekf6-memory",
    "ekf-exp-memory",
    "ekf-temp-memory",
    "ekf-inputs-memory",
    "limit",
    "device",
];
/// Numbers of earlier drives.
const DRIVES: [u32; 5] = [0, 1, 2, 4, 8];
/// Vehicles that can stand before they drive.
const VEHICLES: [&str; 7] = [
    "road",
    "city",
    "traffic",
    "train",
    "hand-held",
    "standing",
    "aircraft",
];
/// Kinds of start.
const STARTS: [&str; 3] = ["cold", "warm", "hot"];
/// Time of the tables: the last.
const LAST: usize = TIMES_MIN.len() - 1;

/// The topic of a study.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topic {
    /// Each single cause of errors, known and unknown to the schemes.
    Causes,
    /// A kind of start.
    Start(&'static str),
    /// A vehicle.
    Vehicle(&'static str),
    /// Earlier drives, and a judged drive without fixes.
    Drives,
}

impl std::fmt::Display for Topic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Causes => f.write_str("causes"),
            Self::Start(name) => write!(f, "start-{name}"),
            Self::Vehicle(name) => write!(f, "vehicle-{name}"),
            Self::Drives => f.write_str("drives"),
        }
    }
}

/// A study, and its rows once it has run.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its topic.
    pub topic: Topic,
    /// Its campaign.
    pub campaign: Campaign,
}

/// All studies with the unit, location and receiver of `main`, on its first `runs` units each, in
/// directories within its own.
///
/// # Errors
/// A scenario that a vehicle does not fit.
pub fn studies(main: &Campaign, runs: u32) -> Result<Vec<Study>, Error> {
    let topics = [Topic::Causes].into_iter();
    let topics = topics.chain(STARTS.map(Topic::Start));
    let topics = topics
        .chain(VEHICLES.map(Topic::Vehicle))
        .chain([Topic::Drives]);
    let study = |topic: Topic| {
        let mut scenario = main.scenario.clone();
        let (models, schemes) = match topic {
            Topic::Causes => (causes(), &SCHEMES[..]),
            Topic::Start(start) => {
                scenario.set_start(start)?;
                let thermal = [ErrorModelName::Thermal, ErrorModelName::StretchedWarmUp];
                let thermal = thermal.into_iter().chain([ErrorModelName::All]);
                (thermal.map(Group::from).collect(), &SCHEMES[..])
            }
            Topic::Vehicle(vehicle) => {
                scenario.set_vehicle(vehicle)?;
                // the road does not shake a standing car
                scenario.city.calm_stops = true;
                let two = [ErrorModelName::Noise, ErrorModelName::Linear];
                (two.map(Group::from).to_vec(), &SCHEMES[..])
            }
            Topic::Drives => {
                scenario.set_start("mixed")?;
                (vec![ErrorModelName::All.into()], &REMEMBERING[..])
            }
        };
        let drives = topic == Topic::Drives;
        let campaign = Campaign {
            scenario,
            runs,
            models,
            out: main.out.join("studies").join(topic.to_string()),
            schemes: schemes.iter().map(|name| (*name).to_owned()).collect(),
            ablation: false,
            drives: if drives { DRIVES.to_vec() } else { vec![0] },
            fixes: !drives,
            ..main.clone()
        };
        Ok(Study { topic, campaign })
    };
    topics.map(study).collect()
}

/// The groups of the table of causes: those without a cause, then each cause, unknown and known to
/// the schemes.
fn causes() -> Vec<Group> {
    let both = |group: Group| {
        let known = group.can_be_known().then(|| group.with_known_cause());
        [group].into_iter().chain(known)
    };
    let mut out: Vec<Group> = [ErrorModelName::Linear, ErrorModelName::Noise]
        .map(Group::from)
        .to_vec();
    out.extend(
        ErrorModelName::CAUSES
            .map(Group::from)
            .into_iter()
            .flat_map(both),
    );
    for sensors in [ErrorModelName::Linear, ErrorModelName::Noise] {
        let with = FixErrors::CAUSES.map(|fixes| Group {
            fixes,
            ..sensors.into()
        });
        out.extend(with.into_iter().flat_map(both));
    }
    out
}

/// Errors of one scheme at the last time, by run.
type Errors = BTreeMap<u32, f64>;

fn errors(rows: &[Row], group: Group, scheme: &str, drives: u32) -> Errors {
    let of = |row: &&Row| (row.error_model, row.drives) == (group, drives) && row.scheme == scheme;
    let rows = rows.iter().filter(of);
    rows.map(|row| (row.run, row.horizontal_m[LAST])).collect()
}

fn middle(errors: &Errors) -> f64 {
    let mut all: Vec<f64> = errors.values().copied().collect();
    if all.is_empty() {
        f64::NAN
    } else {
        median(&mut all)
    }
}

/// Geometric mean of the ratios of the common runs.
fn ratio(of: &Errors, to: &Errors) -> f64 {
    let logs = of
        .iter()
        .filter_map(|(run, x)| Some((x / to.get(run)?).ln()));
    let (sum, n) = logs.fold((0.0, 0.0), |(sum, n), x| (sum + x, n + 1.0));
    (sum / n).exp()
}

/// The table of causes that the schemes are not given: the median error in m, how many times larger
/// that of `device` is than without the cause, and in how many runs `device` is worse than
/// `uncorrected`.
#[must_use]
pub fn of_causes(rows: &[Row], sensors: &str) -> String {
    let lines = causes_beside(rows, sensors, |group| !group.told);
    table(&header("cause", causes_head()), &lines)
}

/// All causes, given to the schemes or not: the file beside the page.
#[must_use]
pub fn causes_csv(rows: &[Row]) -> String {
    let both = ["linear", "noise"].map(|sensors| causes_beside(rows, sensors, |_| true));
    let head = header("cause", causes_head());
    let lines = std::iter::once(head).chain(both.into_iter().flatten());
    lines.map(|line| line.join(",") + "\n").collect()
}

fn causes_head() -> impl Iterator<Item = &'static str> {
    OF_CAUSES.into_iter().chain(["times", "worse"])
}

/// The lines of the causes beside these errors of the sensors.
fn causes_beside(rows: &[Row], sensors: &str, shown: fn(&Group) -> bool) -> Vec<Vec<String>> {
    let groups = Group::present(rows.iter().map(|row| row.error_model));
    let Ok(without) = sensors.parse::<Group>() else {
        return Vec::new();
    };
    let here = |group: &&Group| {
        let noise = group.sensors == ErrorModelName::Noise;
        noise == (without.sensors == ErrorModelName::Noise) && shown(group)
    };
    let line = |group: &Group| {
        let these = |scheme: &str| errors(rows, *group, scheme, 0);
        let cells = OF_CAUSES.map(|scheme| metres(middle(&these(scheme))));
        let mut row = vec![group.to_string()];
        row.extend(cells);
        let times = ratio(&these("device"), &errors(rows, without, "device", 0));
        row.push(format!("{times:.2}"));
        row.push(worse(&these("device"), &these("uncorrected")));
        row
    };
    groups.iter().filter(here).map(line).collect()
}

/// In how many runs an error is more than 2 % and 1 m larger than another.
fn worse(of: &Errors, than: &Errors) -> String {
    let worse =
        |(run, x): &(&u32, &f64)| than.get(run).is_some_and(|y| **x > y + (0.02 * y).max(1.0));
    format!("{} of {}", of.iter().filter(worse).count(), of.len())
}

/// A table of several studies, one row for each label: medians, m.
#[must_use]
pub fn of_labelled(first: &str, studies: &[(String, Vec<Row>)]) -> String {
    let mut lines = Vec::new();
    for (label, rows) in studies {
        for group in Group::present(rows.iter().map(|row| row.error_model)) {
            let of = |scheme: &str| errors(rows, group, scheme, 0);
            let mut line = vec![format!("{label}, {group}")];
            line.extend(SCHEMES.map(|scheme| metres(middle(&of(scheme)))));
            line.push(worse(&of("device"), &of("uncorrected")));
            lines.push(line);
        }
    }
    let head = SCHEMES.into_iter().chain(["worse"]);
    table(&header(first, head), &lines)
}

/// The table of earlier drives: medians, m.
#[must_use]
pub fn of_drives(rows: &[Row]) -> String {
    let group = ErrorModelName::All.into();
    let line = |drives: u32| {
        let mut line = vec![drives.to_string()];
        line.extend(REMEMBERING.map(|s| metres(middle(&errors(rows, group, s, drives)))));
        line
    };
    table(&header("earlier drives", REMEMBERING), &DRIVES.map(line))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_there_known_and_unknown() {
        let causes = causes();
        // 21 causes of the sensors twice, dither once, five of the fixes twice and gaps once, on
        // two sensors
        assert_eq!(causes.len(), 2 + 43 + 2 * 11);
        for group in &causes {
            assert_eq!(group.to_string().parse::<Group>().unwrap(), *group);
        }
    }

    #[test]
    fn ratios_are_those_of_the_same_scheme_without_the_cause() {
        let late: Group = FixErrors::Late.into();
        let mut rows = Vec::new();
        for run in 0..4 {
            let m = f64::from(run + 1);
            rows.push(Row::north(
                ErrorModelName::Linear,
                run,
                "uncorrected",
                100.0 * m,
            ));
            rows.push(Row::north(ErrorModelName::Linear, run, "device", 10.0 * m));
            rows.push(Row::north(late, run, "uncorrected", 100.0 * m));
            let error = if run == 0 { 500.0 } else { 20.0 * m };
            rows.push(Row::north(late, run, "device", error));
        }
        let text = of_causes(&rows, "linear");
        let line = text
            .lines()
            .find(|line| line.starts_with("| late-fixes |"))
            .unwrap();
        // 250 m in the middle of 100 .. 400; the ratios 50, 2, 2, 2
        let times = (50.0 * 8.0_f64).powf(0.25);
        assert!(line.contains("| 250 |"), "{line}");
        let end = format!("| 70 | {times:.2} | 1 of 4 |");
        assert!(line.ends_with(&end), "{line}");
        assert!(of_causes(&rows, "noise").lines().count() == 2);
    }
}
