//! Why the clocks of two files differ: the differences that are known by name.

use crate::recordings::{DAY_S, WEEK_S};
use host_core::words::{agrees, counted};

/// GPS time less UTC, and TAI less GPS time, s.
const LEAPS: [(f64, &str); 3] = [
    (18.0, "GPS time is 18 s ahead of UTC since 2017"),
    (17.0, "GPS time was 17 s ahead of UTC until 2016"),
    (19.0, "TAI is 19 s ahead of GPS time"),
];
/// Start of GPS time in UTC, s since 1970.
const GPS_START_S: f64 = 315_964_800.0;
/// A difference so near to a known one is that one, s.
const NEAR_S: f64 = 0.45;
const HOUR_S: f64 = 3600.0;
/// Time zones lie so far from UTC at most, half hours.
const ZONES: i32 = 28;

/// The name of a difference of two clocks, s, as a sentence without a full stop.
#[must_use]
pub fn named(offset_s: f64) -> Option<String> {
    let size = offset_s.abs();
    let leap = |left: f64| LEAPS.iter().find(|(leap, _)| (left - leap).abs() < NEAR_S);
    if let Some((_, name)) = leap(size) {
        return Some((*name).to_owned());
    }
    let zone = (1..=ZONES).map(f64::from).find_map(|half| {
        let left = size - half * 0.5 * HOUR_S;
        let with = leap(left.abs()).map(|(_, name)| format!(", and {name}"));
        let with = with.or((left.abs() < NEAR_S).then(String::new))?;
        Some(format!(
            "{} h is the difference of a time zone{with}",
            0.5 * half
        ))
    });
    zone.or_else(|| {
        let whole = |unit: f64| {
            let count = (size / unit).round();
            let left = (size - count * unit).abs();
            (count > 0.0 && (left < NEAR_S || leap(left).is_some())).then_some(count)
        };
        let past = (size - GPS_START_S).rem_euclid(WEEK_S);
        let is_epoch = !(20.0..=WEEK_S - 20.0).contains(&past);
        match (whole(DAY_S), whole(WEEK_S)) {
            (_, Some(weeks)) if weeks < 10.0 => {
                Some(format!("{} between them", lie(weeks, "week")))
            }
            (Some(days), _) if days < 7.0 => Some(format!(
                "{} between them, as where seconds of the day meet seconds of the week",
                lie(days, "day")
            )),
            _ if is_epoch && size > GPS_START_S / 2.0 => Some(
                "one file counts from 1970 (UTC), the other in GPS time or in seconds of the week"
                    .into(),
            ),
            _ => None,
        }
    })
}

/// `1 week lies`, `2 weeks lie`.
fn lie(count: f64, unit: &str) -> String {
    format!(
        "{} {}",
        counted(count, unit),
        agrees(count as usize, "lies", "lie")
    )
}

/// The likeliest reason why samples and fixes with these first and last times do not overlap, and
/// the remedy.
#[must_use]
pub fn apart(samples: [f64; 2], fixes: [f64; 2]) -> String {
    let long = |[first, last]: [f64; 2]| last - first;
    let overlaps = |[first, last]: [f64; 2]| {
        let common = last.min(samples[1]) - first.max(samples[0]);
        common > 0.5 * (last - first).min(long(samples))
    };
    for (factor, name) in [(1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")] {
        // a recording and its fixes are about as long
        let alike = |ratio: f64| (0.5..2.0).contains(&ratio);
        if alike(long(fixes) * factor / long(samples)) {
            return format!(
                "the times of the fixes seem to be in {name}, those of the samples in s"
            );
        }
        if alike(long(samples) * factor / long(fixes)) {
            return format!(
                "the times of the samples seem to be in {name}, those of the fixes in s"
            );
        }
    }
    let half = (1..=ZONES).flat_map(|k| [f64::from(k), -f64::from(k)]);
    let zones = half.map(|k| k * 0.5 * HOUR_S);
    let weeks = [1.0, -1.0].map(|k| k * WEEK_S);
    let days = (1..7).flat_map(|k| [f64::from(k) * DAY_S, -f64::from(k) * DAY_S]);
    let epoch = [GPS_START_S - 18.0, 18.0 - GPS_START_S]
        .into_iter()
        .flat_map(|epoch| {
            let week = ((samples[0] - fixes[0] - epoch) / WEEK_S).round() * WEEK_S;
            [epoch, epoch + week]
        });
    let mut known = zones.chain(weeks).chain(days).chain(epoch);
    let shift = known.find(|by| overlaps(fixes.map(|t| t + by)));
    let (by, why) = match shift.and_then(|by| Some((by, named(by)?))) {
        Some(known) => known,
        None => {
            let why = "they would begin together then, as where one file counts from its start";
            (samples[0] - fixes[0], why.to_owned())
        }
    };
    format!(
        "give {by:.0} s as time offset of the fixes ({why}), or times of the same clock; a wrong \
         unit of the times looks like this, too"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_differences_have_their_names() {
        for (offset, part) in [
            (18.02, "18 s ahead of UTC"),
            (-17.1, "17 s ahead of UTC"),
            (19.0, "TAI"),
            (-28_800.1, "8 h is the difference of a time zone"),
            (
                19_782.0,
                "5.5 h is the difference of a time zone, and GPS time is 18 s",
            ),
            (604_800.0, "1 week lies"),
            (172_800.0, "2 days"),
        ] {
            let name = named(offset).unwrap_or_default();
            assert!(name.contains(part), "{offset}: '{name}'");
        }
        for offset in [0.0, 0.1, 2.9, 16.0, 25.0, 1700.0, 40_000.5] {
            assert_eq!(named(offset), None, "{offset}");
        }
    }

    #[test]
    fn clocks_that_do_not_meet_are_explained() {
        let samples = [400_000.0, 400_300.0];
        for (fixes, part) in [
            (
                [428_800.0, 429_100.0],
                "give -28800 s as time offset of the fixes (8 h",
            ),
            ([400_000_000.0, 400_300_000.0], "the fixes seem to be in ms"),
            (
                [315_964_800.0 + 2000.0 * 604_800.0 + 400_000.0 - 18.0; 2],
                "counts from 1970",
            ),
            ([5.0, 300.0], "they would begin together"),
        ] {
            let fixes = match fixes {
                [a, b] if a == b => [a, b + 300.0],
                other => other,
            };
            let why = apart(samples, fixes);
            assert!(why.contains(part), "{fixes:?}: {why}");
        }
        let why = apart([400_000_000.0, 400_300_000.0], [400_000.0, 400_290.0]);
        assert!(why.contains("the samples seem to be in ms"), "{why}");
    }
}
