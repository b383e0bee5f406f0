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
fn of_several_cases_harm_is_named_and_counted_first() {
    let idle = outcome("a", &[("raw", 90.0), ("rnn", 20.0), ("device", 90.0)]);
    let bad = outcome("b", &[("raw", 9.0), ("rnn", 50.0), ("device", 12.0)]);
    let good = outcome("c", &[("raw", 90.0), ("device", 9.0)]);
    let all = of_outcomes(&[idle.clone(), bad, good]);
    let headline = "Verdict: of 3 cases the device harms in 1 (r, b: 12.0 m instead of 9.00 m), \
                    helps in 1, and makes no difference in 1. The error at the end is 1.00 times \
                    the uncorrected one in the median case (0.10 to 1.33).";
    assert_eq!(all.headline, headline);
    assert!(
        all.others[1].starts_with("r, b: Verdict: the device harms by 33 %:"),
        "{all:?}"
    );
    let idle = of_outcomes(&[idle.clone(), idle]).headline;
    assert!(
        idle.starts_with("Verdict: the device does nothing in any of 2 cases; "),
        "{idle}"
    );
    assert_eq!(of_outcomes(&[outcome("c", &[])]).headline, NO_RESULTS);
}

fn course(nearest: Option<(u8, Option<f64>)>) -> Course {
    let nearest = nearest.map(|(proof, takes_s)| host_device::device::proof::Nearest {
        name: "biases",
        proof,
        takes_s,
        paced_s: 300.0,
    });
    Course {
        correction: [[0.0; 6]; 2],
        in_force_since_s: None,
        navigates: true,
        contradicted: 0,
        fixes: [100, 0],
        proved: vec![],
        nearest,
        stored_s: vec![],
        says: "corrects nothing; has proved nothing".into(),
    }
}

/// A device that changes nothing is not said to help, and what it waits for is said.
#[test]
fn a_device_that_does_nothing_says_what_it_waits_for() {
    let rows = rows(&[(60, "raw", 9.0), (60, "rnn", 2.0), (60, "device", 9.0)]);
    let said = |of: Option<&Course>| sentences(&rows, "s", of).remove(0);
    assert_eq!(
        said(Some(&course(Some((34, Some(340.0)))))),
        "Verdict: the device does nothing, because nothing is proved yet: \"biases\" is nearest, \
         proof 34 of 100, about 6 more minutes like the last. The error after 60 s without fixes \
         is 9.00 m with it and without."
    );
    let one = said(Some(&course(Some((99, Some(30.0))))));
    assert!(one.contains("about 1 more minute like the last."), "{one}");
    let never = said(Some(&course(Some((2, None)))));
    assert!(
        never.contains("proof 2 of 100, and it does not come nearer"),
        "{never}"
    );
    assert!(said(Some(&course(None))).contains("because it has proved nothing."));
    assert!(said(None).contains("because no correction is in force."));
}

/// Over several drives the interval decides, not the median.
#[test]
fn over_several_drives_the_interval_decides() {
    let said = |decided, ratio| {
        let several = Several {
            ratio,
            between: "95 % interval 0.3 to 0.6 over 20 runs".into(),
            decided,
        };
        let device = Device {
            after: "after 22 min without fixes".into(),
            metres: [ratio, 1.0],
            several: Some(several),
            ..Device::default()
        };
        device.sentence()
    };
    assert_eq!(
        said(Effect::Helps, 0.4),
        "Verdict: the device helps by 60 %: the error after 22 min without fixes is 0.40 times the \
         uncorrected one (95 % interval 0.3 to 0.6 over 20 runs)."
    );
    assert!(said(Effect::Harms, 3.0).starts_with("Verdict: the device harms by a factor of 3.00:"));
    assert!(said(Effect::Open, 0.4).starts_with("Verdict: it is not shown that the device helps"));
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
        None,
    );
    let nothing = "Verdict: the device does nothing, because no correction is in force.";
    assert!(got[0].starts_with(nothing), "{got:?}");
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
        None,
    );
    let said = "Verdict: the device helps by 52 %: the error after 22 min without fixes is 830 m \
                instead of 1720 m. Before the end it was worse: at 5 min (38.0 m instead of 25.0 \
                m), at 10 min (240 m instead of 190 m).";
    assert_eq!(got[0], said);
    assert_eq!(got[2], "Better than that: device-4 830 m (\u{2212}52 %).");
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
        ("uncorrected", 222.0),
        ("device", 222.0),
        ("ekf6", 240.0),
    ];
    let one = of_outcomes(&[outcome("a", &ends)]);
    assert!(one.headline.contains("the device does nothing"), "{one:?}");
    let said = one.others.join(" ");
    for part in [
        "(uncorrected) they end 222 m off: device and ekf6, which start so",
        "Worse than that: ekf6 240 m (+8 %).",
        "Better than that: ls-bias 133 m (\u{2212}43 %).",
        "no worse (within 1 m or 2 %): device 222 m.",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    // without that row both are compared with the uncorrected samples
    let raw = of_outcomes(&[outcome("b", &[ends[0], ends[3]])]).headline;
    assert!(raw.contains("the device helps by 5 %"), "{raw}");
    // and `uncorrected` alone is not enough
    let none = of_outcomes(&[outcome("c", &[ends[0], ends[2]])]).headline;
    assert_eq!(none, NO_RESULTS);
}

#[test]
fn what_is_small_says_nothing_and_no_baseline_no_verdict() {
    let of = |list: &[(u32, &'static str, f64)]| sentences(&rows(list), "s", None);
    let small = of(&[(9, "raw", 2.0), (9, "device", 2.9)]).remove(0);
    let said = "Verdict: the device makes no difference that counts: ";
    assert!(small.starts_with(said), "{small}");
    let share = of(&[(9, "raw", 900.0), (9, "device", 910.0)]).remove(0);
    assert!(share.starts_with(said), "{share}");
    let without = of(&[(9, "raw", 9.0), (9, "a", 4.0), (9, "b", 12.0)]).remove(0);
    assert!(
        without.contains("does not take part. Of the other schemes, at the end some help and some")
    );
    assert!(of(&[(9, "uncorrected", 2.0), (9, "rnn", 9.0)]).is_empty());
    assert!(of(&[(9, "raw", 2.0)]).is_empty());
    assert_eq!(of(&[]).len(), 1);
}
