//! Which sessions a comparison of schemes may use.

use super::Row;
use std::collections::{BTreeMap, BTreeSet};

/// The rows of a phase that can be compared: at each horizon those of the sessions in which every
/// scheme has one. So all medians are over the same sessions, though a filter with a memory has
/// none before its first. A scheme that is missing in more than half of the sessions (a rest where
/// nothing rests) takes no part.
#[must_use]
pub fn shared<'a>(rows: &[&'a Row]) -> Vec<&'a Row> {
    // horizon, scheme, sessions; a horizon is positive, so its bits are in its order
    let mut had: BTreeMap<u64, BTreeMap<&str, BTreeSet<usize>>> = BTreeMap::new();
    for row in rows {
        let schemes = had.entry(row.horizon_s.to_bits()).or_default();
        let sessions = schemes.entry(&row.scheme).or_default();
        sessions.insert(row.session);
    }
    for schemes in had.values_mut() {
        let all: BTreeSet<usize> = schemes.values().flatten().copied().collect();
        schemes.retain(|_, own| 2 * own.len() >= all.len());
        let common = schemes.values().fold(all, |common, own| &common & own);
        schemes.values_mut().for_each(|own| own.clone_from(&common));
    }
    let counts = |row: &&'a Row| {
        let own = had
            .get(&row.horizon_s.to_bits())?
            .get(row.scheme.as_str())?;
        Some(own.contains(&row.session))
    };
    let of = rows.iter().copied();
    of.filter(|row| counts(row) == Some(true)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(session: usize, scheme: &str, horizon_s: f64) -> Row {
        Row {
            session,
            name: String::new(),
            scheme: scheme.into(),
            phase: "power-on".into(),
            horizon_s,
            coasts: 1,
            median_m: session as f64,
            worst_m: 0.0,
            attitude_deg: 0.0,
        }
    }

    #[test]
    fn all_schemes_are_compared_over_the_same_sessions() {
        let mut rows = Vec::new();
        for session in 1..=5 {
            rows.push(row(session, "device", 10.0));
            if session > 1 {
                rows.push(row(session, "memory", 10.0));
            }
            if session == 3 {
                rows.push(row(session, "rest", 10.0)); // one rest in five sessions
            }
            if session > 3 {
                rows.push(row(session, "device", 60.0)); // the others are shorter
                rows.push(row(session, "memory", 60.0));
            }
        }
        let all: Vec<&Row> = rows.iter().collect();
        let kept = shared(&all);
        let of = |scheme: &str, horizon: f64| -> Vec<usize> {
            let own = kept.iter();
            own.filter(|row| row.scheme == scheme && row.horizon_s == horizon)
                .map(|row| row.session)
                .collect()
        };
        assert_eq!(of("device", 10.0), [2, 3, 4, 5]);
        assert_eq!(of("memory", 10.0), [2, 3, 4, 5]);
        assert!(of("rest", 10.0).is_empty());
        assert_eq!(of("device", 60.0), [4, 5]);
        assert_eq!(of("memory", 60.0), [4, 5]);
        // of a single session all rows count
        let one: Vec<&Row> = all.into_iter().filter(|row| row.session == 3).collect();
        assert_eq!(shared(&one).len(), one.len());
    }
}
