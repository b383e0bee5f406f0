//! Campaigns with earlier drives, on short drives and few runs.

use super::*;

fn campaign(drives: &[u32], fixes: bool, schemes: &[&str]) -> Campaign {
    Campaign {
        scenario: Scenario::load("medium").unwrap(),
        runs: 1,
        shard: (0, 1),
        models: vec![ErrorModelName::Thermal.into()],
        out: PathBuf::new(),
        resume: false,
        schemes: schemes.iter().map(|name| (*name).to_owned()).collect(),
        ablation: false,
        tuning_units: 1,
        drives: drives.to_vec(),
        fixes,
    }
}

fn row<'a>(rows: &'a [Row], scheme: &str, drives: u32) -> &'a Row {
    let mut found = rows.iter();
    found
        .find(|row| row.scheme == scheme && row.drives == drives)
        .unwrap()
}

/// Without earlier drives a memory is empty; schemes without one have the same row after each number
/// of drives, that of a campaign without drives; memories have others.
#[test]
fn a_memory_without_drives_is_the_filter_without_memory() {
    let names = ["ekf6", "ekf6-memory", "ekf-exp", "ekf-exp-memory"];
    let both = campaign(&[0, 1], true, &names);
    let rows = both.run(&Tuning::default(), 3).unwrap();
    let today = campaign(&[0], true, &names);
    let today = today.run(&Tuning::default(), 3).unwrap();
    assert_eq!((rows.len(), today.len()), (2 * 5, 5));
    for old in &today {
        assert_eq!(old, row(&rows, &old.scheme, 0));
    }
    for name in ["ekf6", "ekf-exp"] {
        let memory = format!("{name}-memory");
        let of = |scheme: &str, drives| row(&rows, scheme, drives).north_m;
        assert_eq!(of(name, 0), of(&memory, 0), "{name}");
        assert_eq!(of(name, 0), of(name, 1), "{name}");
        assert_ne!(of(&memory, 0), of(&memory, 1), "{name}");
    }
    assert_eq!(
        row(&rows, "floor", 0).north_m,
        row(&rows, "floor", 1).north_m
    );
    // computed, not copied: the scheme itself has no memory to begin with
    let imu = both.imu();
    let mut compared = 0;
    both.sessions(&imu, 3, |_, case| {
        let of = |name: &str| SCHEMES.iter().find(|(n, _)| *n == name).unwrap().1;
        for name in ["ekf6", "ekf-exp", "ekf-temp"] {
            let [a, b] = [name.to_owned(), format!("{name}-memory")]
                .map(|name| of(&name)(case).unwrap().position);
            assert_eq!(a, b, "{name}");
            compared += 1;
        }
        Ok(())
    })
    .unwrap();
    assert_eq!(compared, 6);
}

/// Without fixes the device has nothing before its first drive, and after it what it has stored. A
/// unit whose errors are known from earlier drives is better than one that is not: the errors of
/// this unit are biases that stay.
#[test]
fn without_fixes_only_memory_helps() {
    let names = ["none", "ekf6", "ekf6-memory", "limit", "rnn-kalman"];
    let mut campaign = campaign(&[0, 1, 2], false, &names);
    campaign.models = vec![ErrorModelName::Linear.into()];
    let rows = campaign.run(&Tuning::default(), 14).unwrap();
    let end = |scheme: &str, drives| row(&rows, scheme, drives).horizontal_m[4];
    assert_eq!(end("rnn-kalman", 0), end("none", 0));
    assert_eq!(end("ekf6-memory", 0), end("ekf6", 0));
    for drives in [1, 2] {
        assert_eq!(end("none", drives), end("none", 0));
        assert_eq!(end("limit", drives), end("limit", 0));
        for scheme in ["ekf6-memory", "rnn-kalman"] {
            let (with, without) = (end(scheme, drives), end(scheme, 0));
            assert!(with < 0.5 * without, "{scheme}: {with} of {without} m");
        }
    }
    assert!(end("limit", 0) < 0.5 * end("none", 0));
    assert_ne!(end("rnn-kalman", 1), end("rnn-kalman", 2));
}
