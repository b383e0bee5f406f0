//! Reads the text of a unit file and finds all that is wrong or doubtful in it.

use super::finding::Finding;
use super::prior;
use super::{Unit, doubts, networks, schema};
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The unit that a text describes, unless something is wrong, and all that was found, sorted by
/// line.
#[must_use]
pub fn examine(text: &str) -> (Option<Unit>, Vec<Finding>) {
    let line_of = |at: usize| text[..at.min(text.len())].matches('\n').count() + 1;
    let parsed = DeTable::parse(text).and_then(|spans| Ok((spans, toml::from_str(text)?)));
    let (spans, table): (Spanned<DeTable<'_>>, toml::Table) = match parsed {
        Ok(parsed) => parsed,
        Err(e) => {
            let remedy = "correct the TOML: key = value, texts in quotes, tables in brackets";
            let fault = Finding::wrong("file", e.message().replace('\n', " "), remedy);
            let line = e.span().map(|span| line_of(span.start));
            return (None, vec![Finding { line, ..fault }]);
        }
    };
    let mut lines = BTreeMap::new();
    places(spans.get_ref(), "", &line_of, &mut lines);
    let mut found = Vec::new();
    schema::check(
        &schema::schema(),
        &toml::Value::Table(table),
        "",
        &mut found,
    );
    let mut unit = None;
    if found.is_empty() {
        match toml::from_str::<Unit>(text) {
            Ok(read) => {
                found.extend(read.faults());
                found.extend(doubts::of(&read));
                unit = Some(read);
            }
            Err(e) => {
                let remedy = "see `host-sim unit schema`";
                let fault = Finding::wrong("file", e.message().replace('\n', " "), remedy);
                let line = e.span().map(|span| line_of(span.start));
                found.push(Finding { line, ..fault });
            }
        }
    }
    for finding in &mut found {
        finding.line = finding.line.or_else(|| place(&lines, &finding.key));
    }
    found.sort_by_key(|finding| finding.line);
    let usable = found.iter().all(|finding| finding.doubt);
    (unit.filter(|_| usable), found)
}

/// The line of each key.
fn places(
    table: &DeTable<'_>,
    path: &str,
    line_of: &impl Fn(usize) -> usize,
    into: &mut BTreeMap<String, usize>,
) {
    for (name, value) in table.iter() {
        let key = match path {
            "" => name.get_ref().to_string(),
            path => format!("{path}.{}", name.get_ref()),
        };
        into.insert(key.clone(), line_of(name.span().start));
        if let DeValue::Table(inner) = value.get_ref() {
            places(inner, &key, line_of, into);
        }
    }
}

/// The line of a key, or of the table that it is missing in.
fn place(lines: &BTreeMap<String, usize>, key: &str) -> Option<usize> {
    let mut key = key;
    loop {
        if let Some(line) = lines.get(key) {
            return Some(*line);
        }
        key = key.rsplit_once('.')?.0;
    }
}

impl Unit {
    /// What no device takes, and what the simulator cannot simulate.
    fn faults(&self) -> Vec<Finding> {
        let mut found = match self.configuration() {
            Ok(told) => networks::not_given(self, &told),
            Err(finding) => vec![finding],
        };
        found.extend(prior::other_inputs(self));
        if let Some(need) = self.sensor.bits_per_second()
            && need > f64::from(self.sensor.baud)
        {
            let fits = BAUDS.iter().find(|baud| f64::from(**baud) >= need);
            let remedy = match fits {
                Some(baud) => format!("set the sensor and this file to {baud} bit/s or more"),
                None => "lower the rate".into(),
            };
            let problem = format!(
                "is {}, but the frames at {} Hz need {need:.0} bit/s",
                self.sensor.baud,
                self.sensor.rate()
            );
            found.push(Finding::wrong("sensor.baud", problem, remedy));
        }
        if let Some(Err(problem)) = self.simulation.as_ref().map(|spec| spec.check()) {
            let key = problem.split(' ').next().unwrap_or_default().to_owned();
            let problem = problem.trim_start_matches(&key).trim_start_matches(" = ");
            let problem = format!("is {problem}");
            found.push(Finding::wrong(
                format!("simulation.{key}"),
                problem,
                "correct the number",
            ));
        }
        found
    }
}

/// Bit rates that sensors have, bit/s.
const BAUDS: [u32; 13] = [
    9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 374_400, 460_800, 921_600, 1_000_000,
    1_843_200, 4_147_200, 12_000_000,
];
