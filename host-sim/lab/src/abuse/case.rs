//! Cases: rows of a table, combinations of them, and other values of their parameters.

use super::act::Act;
use super::motion::Motion;
use super::table;
use super::times::Span;
use host_core::error::Error;
use std::fmt;
use std::str::FromStr;

/// A number of a row: its key, its value, and its meaning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaseParameter {
    /// Key for `--set`, with its unit.
    pub key: &'static str,
    /// Value.
    pub value: f64,
}

/// A row of the table of cases.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
    /// When it acts.
    pub span: Span,
    /// Its numbers.
    pub given: &'static [CaseParameter],
    /// Its acts with these numbers.
    pub acts: fn(&[f64]) -> Vec<Act>,
}

/// One case: a row or several of them at once.
#[derive(Debug, Clone)]
pub struct Case {
    name: String,
    /// Its acts, and when each acts.
    pub acts: Vec<(Act, Span)>,
}

/// End of the name of a case whose disturbance ends ten minutes before the fixes do.
const ENDED: &str = ":ended";

impl Case {
    /// Name on the command line and in files.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Changes a value of the case: that with `key`, of a row of the case.
    ///
    /// # Errors
    /// A key that none of its rows has.
    pub fn set(&mut self, row: &str, key: &str, value: f64) -> Result<(), Error> {
        let rows = rows_of(&self.name)?;
        let mut acts = Vec::new();
        let mut found = false;
        for (of, span) in rows {
            let mut values: Vec<f64> = of.given.iter().map(|given| given.value).collect();
            let index = of.given.iter().position(|given| given.key == key);
            if let Some(index) = index.filter(|_| of.name == row) {
                values[index] = value;
                found = true;
            }
            acts.extend((of.acts)(&values).into_iter().map(|act| (act, span)));
        }
        if !found {
            let known: Vec<&str> = table::rows()
                .filter(|of| of.name == row)
                .flat_map(|of| of.given.iter().map(|given| given.key))
                .collect();
            return Err(Error::unknown("parameter", key, &known));
        }
        self.acts = acts;
        Ok(())
    }

    /// The motion of the vehicle.
    #[must_use]
    pub fn motion(&self) -> Motion {
        let mut motions = self.acts.iter().filter_map(|(act, _)| match act {
            Act::Motion(motion) => Some(*motion),
            _ => None,
        });
        motions.next().unwrap_or(Motion::Road)
    }

    /// Whether all of it happens before the standstill.
    #[must_use]
    pub fn only_begins(&self) -> bool {
        let before = |(act, span): &(Act, Span)| {
            matches!(act, Act::Motion(Motion::Begins(..))) || *span == Span::Before
        };
        self.acts.iter().all(before)
    }

    /// Whether the device can recover from it before the fixes end.
    #[must_use]
    pub fn ends(&self) -> bool {
        !self.acts.is_empty() && self.acts.iter().all(|(_, span)| span.ends())
    }
}

/// The rows of a name, and when each acts.
fn rows_of(name: &str) -> Result<Vec<(&'static Row, Span)>, Error> {
    let (names, ended) = match name.strip_suffix(ENDED) {
        Some(names) => (names, true),
        None => (name, false),
    };
    names
        .split('+')
        .map(|part| {
            let row = table::rows().find(|row| row.name == part).ok_or_else(|| {
                let known: Vec<&str> = table::rows().map(|row| row.name).collect();
                Error::unknown("case", part, &known)
            })?;
            Ok((row, if ended { Span::Ends } else { row.span }))
        })
        .collect()
}

impl FromStr for Case {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        let rows = rows_of(name)?;
        let acts = rows.iter().flat_map(|(row, span)| {
            let values: Vec<f64> = row.given.iter().map(|given| given.value).collect();
            let acts = (row.acts)(&values).into_iter();
            acts.map(|act| (act, *span))
        });
        let case = Self {
            name: name.to_owned(),
            acts: acts.collect(),
        };
        let motions = case
            .acts
            .iter()
            .filter(|(act, _)| matches!(act, Act::Motion(_)));
        if motions.count() > 1 {
            return Err(Error::Option {
                option: format!("--cases {name}"),
                problem: "a vehicle cannot move in two ways".into(),
                remedy: "leave all but one of the motions out".into(),
            });
        }
        Ok(case)
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.name)
    }
}

/// The cases with these names; without names all rows of the table and the combinations.
///
/// # Errors
/// The name of no case.
pub fn chosen(names: &[String]) -> Result<Vec<Case>, Error> {
    match names {
        [] => table::usual().map(str::parse).collect(),
        names => names.iter().map(|name| name.parse()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_case_reads_back_and_is_there_once() {
        let all = chosen(&[]).unwrap();
        let names: BTreeSet<&str> = all.iter().map(Case::name).collect();
        assert_eq!(names.len(), all.len());
        assert!(all.len() >= 60, "{}", all.len());
        for case in &all {
            let again: Case = case.name().parse().unwrap();
            assert_eq!(again.acts, case.acts, "{case}");
            assert_eq!(case.acts.is_empty(), case.name() == "none", "{case}");
        }
        for row in table::rows() {
            assert!(
                !row.about.is_empty() && !row.name.contains(['+', ':', ',']),
                "{}",
                row.name
            );
            let keys: BTreeSet<&str> = row.given.iter().map(|given| given.key).collect();
            assert_eq!(keys.len(), row.given.len(), "{}", row.name);
        }
    }

    #[test]
    fn cases_combine_end_and_take_other_values() {
        let mut case: Case = "late-0.5+lever-arm-5".parse().unwrap();
        assert_eq!(case.acts.len(), 2);
        assert!(!case.ends());
        let before = case.acts.clone();
        case.set("late-0.5", "delay_s", 0.7).unwrap();
        assert_ne!(case.acts[0], before[0]);
        assert_eq!(case.acts[1], before[1]);
        assert!(case.set("late-0.5", "delay", 0.7).is_err());
        assert!("late-0.5:ended".parse::<Case>().unwrap().ends());
        let error = "latte-0.5".parse::<Case>().unwrap_err().to_string();
        assert!(error.contains("did you mean 'late-0.5'"), "{error}");
        assert!("creep+ship".parse::<Case>().is_err());
    }
}
