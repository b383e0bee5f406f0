use super::*;

fn rows(list: &[(u32, &'static str, f64)]) -> Vec<Ended<'static>> {
    let ended = |(after, scheme, metres): &(u32, &'static str, f64)| Ended {
        after: *after,
        scheme,
        metres: *metres,
    };
    list.iter().map(ended).collect()
}

fn outcome(case: &str, ends: &[(&str, f64)]) -> Outcome {
    let row = |(scheme, metres): &(&str, f64)| host_lab::experiment::results::Row {
        t_s: 60,
        scheme: (*scheme).to_owned(),
        d_north_m: *metres,
        d_east_m: 0.0,
        d_vn_mps: 0.0,
        d_ve_mps: 0.0,
        horizontal_m: *metres,
    };
    Outcome {
        schema: 3,
        recording: "r".into(),
        case: case.into(),
        start: String::new(),
        residual: None,
        rows: ends.iter().map(row).collect(),
        notes: vec![],
        warnings: vec![],
        curves: Default::default(),
        bench: None,
    }
}

#[test]
fn of_several_cases_harm_in_one_is_harm_and_the_device_is_separate() {
    let good = outcome("a", &[("raw", 90.0), ("rnn", 20.0), ("device", 90.0)]);
    let bad = outcome("b", &[("raw", 9.0), ("rnn", 50.0), ("device", 9.0)]);
    let both = of_outcomes(&[good.clone(), bad.clone()]);
    let headline = "Verdict: harm. At the end some corrections make it worse in 1 of 2 cases, \
                    though some help in 1.";
    assert_eq!(both.headline, headline);
    let device = both.device.clone().unwrap();
    assert!(device.contains("worse than no correction in 0, better in 0 and no different in 2"));
    assert!(
        both.others[1].starts_with("r, b: Verdict: harm."),
        "{both:?}"
    );
    let good = of_outcomes(&[good.clone(), good]).headline;
    assert!(
        good.contains("help in 2 of 2 cases, and none does harm"),
        "{good}"
    );
    let bad = of_outcomes(&[bad.clone(), bad]).headline;
    assert!(
        bad.contains("worse in 2 of 2 cases, and none helps"),
        "{bad}"
    );
    assert_eq!(of_outcomes(&[outcome("c", &[])]).headline, NO_RESULTS);
}

#[test]
fn harm_stands_first_with_the_worst_scheme_before_the_others() {
    let got = sentences(
        &rows(&[
            (40, "raw", 3.5),
            (40, "ekf24", 17.0),
            (50, "raw", 4.4),
            (50, "ls-bias", 26.0),
            (50, "ekf24", 30.0),
            (50, "device", 4.4),
        ]),
        "s",
    );
    assert!(
        got[0].contains("harm. At the end no correction helps"),
        "{got:?}"
    );
    assert!(
        got[1].contains("50 s") && got[1].contains("4.40 m"),
        "{got:?}"
    );
    let worse = "Worse than that: ekf24 30.0 m (6.8 times), ls-bias 26.0 m (5.9 times).";
    assert_eq!(got[2], worse);
    assert!(got[3].ends_with("device 4.40 m."), "{got:?}");
    assert_eq!(got.len(), 4);
}

#[test]
fn harm_at_an_earlier_time_is_reported_though_the_end_is_better() {
    let got = sentences(
        &rows(&[
            (5, "raw", 25.0),
            (5, "device-4", 38.0),
            (10, "raw", 190.0),
            (10, "device-4", 240.0),
            (22, "raw", 1720.0),
            (22, "device-4", 830.0),
        ]),
        "min",
    );
    assert!(got[0].contains("help, and none does harm"), "{got:?}");
    assert_eq!(got[2], "Better than that: device-4 830 m (-52 %).");
    assert_eq!(
        got[3],
        "Worse before the end: device-4 at 10 min (240 m against 190 m)."
    );
}

#[test]
fn what_an_aided_start_changes_is_no_merit_of_a_correction() {
    let ends = [
        ("raw", 233.0),
        ("ls-bias", 133.0),
        ("none", 222.0),
        ("device", 222.0),
        ("ekf6", 240.0),
    ];
    let one = of_outcomes(&[outcome("a", &ends)]);
    let device = one.device.expect("the device is among the rows");
    assert!(
        device.contains("no different from no correction"),
        "{device}"
    );
    let said = one.others.join(" ");
    for part in [
        "(none) they end 222 m off: device and ekf6, which start so",
        "Worse than that: ekf6 240 m (+8 %).",
        "Better than that: ls-bias 133 m (-43 %).",
        "no worse (within 1 m or 2 %): device 222 m.",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // without that row both are compared with the uncorrected samples
    let raw = of_outcomes(&[outcome("b", &[ends[0], ends[3]])]).device;
    assert!(raw.expect("a device").contains("better than no correction"));
    // and `none` alone is not enough
    let none = of_outcomes(&[outcome("c", &[ends[0], ends[2]])]).headline;
    assert_eq!(none, NO_RESULTS);
}

#[test]
fn what_is_small_says_nothing_and_no_baseline_no_verdict() {
    let small = sentences(&rows(&[(9, "raw", 2.0), (9, "rnn", 2.9)]), "s");
    assert!(
        small[0].contains("no correction makes a difference"),
        "{small:?}"
    );
    let share = sentences(&rows(&[(9, "raw", 900.0), (9, "rnn", 910.0)]), "s");
    assert!(
        share[0].contains("no correction makes a difference"),
        "{share:?}"
    );
    let mixed = sentences(
        &rows(&[(9, "raw", 9.0), (9, "a", 4.0), (9, "b", 12.0)]),
        "s",
    );
    assert!(mixed[0].contains("mixed"), "{mixed:?}");
    assert!(sentences(&rows(&[(9, "none", 2.0), (9, "rnn", 9.0)]), "s").is_empty());
    assert!(sentences(&rows(&[(9, "raw", 2.0)]), "s").is_empty());
    assert_eq!(sentences(&[], "s").len(), 1);
}
