//! What the sensor itself does or cannot do.

use super::*;

/// A sensor that holds its value while the vehicle turns, and positions without their last digits.
#[test]
fn a_stuck_sensor_and_cut_positions_are_reported_first() {
    let right = Record::from_session(&drive("tactical", 120));
    let mut stuck = right.clone();
    let mut at = 0;
    each_sample(&mut stuck, |mut s| {
        at += 1;
        if at > 20_000 {
            s.dtheta.z = 1e-6;
        }
        s
    });
    let mut cut = right.clone();
    each_fix(&mut cut, |f| {
        (f.lat_deg, f.lon_deg) = (
            (f.lat_deg * 1e3).round() / 1e3,
            (f.lon_deg * 1e3).round() / 1e3,
        );
    });
    for (record, field, problem, remedy) in [
        (
            stuck,
            "imu.gyro",
            "about the axis called down from 200.0 to",
            "check its column",
        ),
        (
            cut,
            "gnss.latitude",
            "repeats a position",
            "in steps of 0.001 deg, which are 111 m",
        ),
    ] {
        let found = doubts_of(&record);
        let first = &found[0];
        let hit = first.problem.contains(problem) && first.remedy.contains(remedy);
        assert!(first.field == field && hit, "{first}");
    }
}

/// The rest of a sensor that cannot find north gives no heading.
#[test]
fn a_standstill_without_a_heading_is_reported() {
    let record = Record::from_session(&drive("stim300", 120));
    let assumed = &class("stim300");
    let class = Class {
        assumed,
        given: true,
    };
    let found = |record: &Record| doubts(record, &says(), class, &contradicted);
    let standing = found(&record);
    let first = &standing[0];
    assert!(
        first
            .problem
            .contains("with a bias of 10.8 deg/h find not at all"),
        "{first}"
    );
    assert_eq!(
        (standing.len(), first.field.as_str()),
        (1, "start.standstill_s")
    );
    assert_eq!(found(&on_the_road(&drive("stim300", 150))), []);
}

/// The biases of consumer MEMS tilt a window so much that other signs of the gyros fit better. That
/// is no reason to doubt the right ones, nor is a drive of half a minute.
#[test]
fn biases_and_short_drives_are_no_wrong_signs() {
    let assumed = &class("icm-42688");
    let class = Class {
        assumed,
        given: true,
    };
    let road = on_the_road(&drive("tactical", 150));
    for (dps, seconds) in [(0.0, 25.0), (0.3, 60.0), (0.6, 150.0), (1.0, 300.0)] {
        for signs in [0u8, 1, 3, 6] {
            let mut biased = road.clone();
            let sign = |axis: u8| if signs >> axis & 1 == 0 { dps } else { -dps };
            let bias = Vector3::new(sign(0), sign(1), sign(2)) * DEG / biased.rate_hz as f64;
            let end = biased.time.start().unwrap() + seconds;
            let count = biased.time.partition_point(|time| *time < end);
            biased.time = biased.time.part(0..count);
            biased.samples = biased.samples.part(0..count);
            biased.fixes.retain(|fix| fix.time < end);
            each_sample(&mut biased, |sample| Increment {
                dtheta: sample.dtheta + bias,
                ..sample
            });
            let found = doubts(&biased, &says(), class, &contradicted);
            let turned = found
                .iter()
                .find(|of| of.problem.contains("by gravity and"));
            assert_eq!(turned, None, "{dps} deg/s, {seconds} s, signs {signs}");
        }
    }
}
