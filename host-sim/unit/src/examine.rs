//! Reads the text of a unit file and finds all that is wrong or doubtful in it.

use super::finding::Finding;
use super::prior;
use super::sensor::FormatName;
use super::{Unit, doubts, networks, schema};
use std::collections::BTreeMap;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The unit that a text describes, `None` on a fault, and all findings, sorted by line.
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
    key_lines(spans.get_ref(), "", &line_of, &mut lines);
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
        finding.line = finding.line.or_else(|| nearest_line(&lines, &finding.key));
    }
    found.sort_by_key(|finding| finding.line);
    let usable = found.iter().all(|finding| finding.doubt);
    (unit.filter(|_| usable), found)
}

/// Collects the line of each key.
fn key_lines(
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
            key_lines(inner, &key, line_of, into);
        }
    }
}

/// The line of a key, or of the table that it is missing in.
fn nearest_line(lines: &BTreeMap<String, usize>, key: &str) -> Option<usize> {
    let mut key = key;
    loop {
        if let Some(line) = lines.get(key) {
            return Some(*line);
        }
        key = key.rsplit_once('.')?.0;
    }
}

impl Unit {
    /// Values that no device accepts, or that cannot be simulated.
    fn faults(&self) -> Vec<Finding> {
        let mut found = match self.configuration() {
            Ok(configuration) => networks::not_given(self, &configuration),
            Err(finding) => vec![finding],
        };
        found.extend(prior::other_inputs(self));
        found.extend(self.no_such_rate());
        found.extend(self.line_too_slow());
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

impl Unit {
    /// A rate that the board cannot set the sensor to.
    fn no_such_rate(&self) -> Option<Finding> {
        let at_spi = self.sensor.format == FormatName::AdisSpi;
        let adis = self.sensor.adis.as_ref().filter(|_| at_spi)?;
        adis.refused(self.sensor.rate())
    }

    /// A line that is too slow for the frames.
    fn line_too_slow(&self) -> Option<Finding> {
        let (baud, rate) = (self.sensor.baud, self.sensor.rate());
        let need = self.sensor.bits_per_second()?;
        if need <= f64::from(baud) {
            return None;
        }
        let at_spi = self.sensor.format == FormatName::AdisSpi;
        let (who, frames) = match at_spi {
            true => ("the navigation computer", "bursts on the navigation line"),
            false => ("the sensor", "frames"),
        };
        let fits = BAUDS.iter().find(|baud| f64::from(**baud) >= need);
        let remedy = match fits {
            Some(baud) if at_spi => {
                format!("set {who} and this file to {baud} bit/s or more, or lower sensor.rate_hz")
            }
            Some(baud) => format!("set {who} and this file to {baud} bit/s or more"),
            None => "lower the rate".into(),
        };
        let problem = format!("is {baud}, but the {frames} at {rate} Hz need {need:.0} bit/s");
        Some(Finding::wrong("sensor.baud", problem, remedy))
    }
}

/// Bit rates that sensors have, bit/s.
const BAUDS: [u32; 13] = [
    9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 374_400, 460_800, 921_600, 1_000_000,
    1_843_200, 4_147_200, 12_000_000,
];

#[cfg(test)]
mod tests {
    use super::super::presets;
    use super::*;

    /// Faults of a preset whose rates are replaced by these lines: field, problem, remedy.
    fn found(name: &str, lines: &str) -> Vec<(String, String, String)> {
        found_in(&presets::text(name).expect("a preset"), lines)
    }

    fn found_framed(name: &str, lines: &str) -> Vec<(String, String, String)> {
        let text = presets::text(name).expect("a preset");
        found_in(
            &text.replace("[sensor.adis]", "[sensor.adis]\nframed = true"),
            lines,
        )
    }

    fn found_in(text: &str, lines: &str) -> Vec<(String, String, String)> {
        let others = |line: &&str| !line.starts_with("rate_hz") && !line.starts_with("baud");
        let text: Vec<_> = text.lines().filter(others).collect();
        let text = text
            .join("\n")
            .replace("[sensor]", &format!("[sensor]\n{lines}"));
        let (_, all) = examine(&text);
        let all = all.into_iter().filter(|finding| !finding.doubt);
        all.map(|found| (found.key, found.problem, found.remedy))
            .collect()
    }

    #[test]
    fn an_adis_has_rates_of_its_own_and_a_line_that_carries_its_bursts() {
        let small = |lines| found("adis16505", lines);
        let large = |lines| found("adis16495", lines);
        // bursts of 32 and 40 bytes
        for good in [
            "",
            "rate_hz = 2000",
            "rate_hz = 666.67",
            "rate_hz = 100\nbaud = 38400",
        ] {
            assert_eq!(small(good), [], "{good}");
        }
        for good in ["", "rate_hz = 2125", "rate_hz = 4250\nbaud = 1843200"] {
            assert_eq!(large(good), [], "{good}");
        }
        let rate = |all: Vec<(String, String, String)>| match &all[..] {
            [(key, problem, remedy)] if key == "sensor.rate_hz" => {
                assert!(problem.contains("which an ADIS16"), "{problem}");
                remedy.clone()
            }
            other => panic!("{other:?}"),
        };
        assert_eq!(rate(small("rate_hz = 1500")), "give 1000 or 2000");
        assert_eq!(rate(small("rate_hz = 2500")), "give 2000 or less");
        assert_eq!(rate(large("rate_hz = 2000")), "give 1416.67 or 2125");
        let line = |all: Vec<(String, String, String)>| match &all[..] {
            [(key, problem, remedy)] if key == "sensor.baud" => format!("{problem}; {remedy}"),
            other => panic!("{other:?}"),
        };
        let message = line(large("rate_hz = 4250"));
        assert!(
            message.contains("the bursts on the navigation line at 4250 Hz need 1700000 bit/s")
                && message.contains("set the navigation computer and this file to 1843200 bit/s")
                && message.contains("or lower sensor.rate_hz"),
            "{message}"
        );
        let message = line(small("rate_hz = 2000\nbaud = 460800"));
        assert!(message.contains("need 640000 bit/s"), "{message}");
        // a frame has 12 bytes more
        let framed = found_framed("adis16505", "rate_hz = 2000\nbaud = 640000");
        assert!(line(framed).contains("need 880000 bit/s"));
    }
}
