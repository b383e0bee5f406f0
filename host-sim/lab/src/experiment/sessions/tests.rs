use super::*;
use host_core::inertial::earth::Geodetic;
use host_core::simulator::gnss::GnssSpec;
use host_core::simulator::session::{SessionConfig, simulate};
use host_io::recordings::record::Record;
use host_unit::Unit as OfUnit;

/// A session of a consumer MEMS, as a file would have it: no attitude, positions alone.
fn recorded(turn_on: u64) -> (Record, host_core::inertial::session::Session) {
    recorded_by(turn_on, 0.0)
}

/// The same of a unit of whose biases this share repeats at every power-on.
fn recorded_by(turn_on: u64, repeats: f64) -> (Record, host_core::inertial::session::Session) {
    let unit = OfUnit::preset("icm-42688").unwrap();
    let mut imu = unit.simulated();
    let new = (1.0 - repeats * repeats).sqrt();
    imu.gyro.bias_unit_dph = repeats * imu.gyro.bias_turn_on_dph;
    imu.accel.bias_unit_ug = repeats * imu.accel.bias_turn_on_ug;
    imu.gyro.bias_turn_on_dph *= new;
    imu.accel.bias_turn_on_ug *= new;
    let config = SessionConfig {
        gnss: &GnssSpec {
            horizontal_m: 0.1,
            vertical_m: 0.2,
            ..GnssSpec::default()
        },
        start: Geodetic {
            lat: 0.8,
            lon: 0.2,
            h: 100.0,
        },
        ..SessionConfig::new(&imu, [10.0, 140.0], [3, turn_on, turn_on + 100])
    };
    let (session, _) = simulate(&config);
    let mut record = Record::from_session(&session);
    record.initial_attitude = None;
    for fix in &mut record.fixes {
        fix.sigmas[3..].fill(f64::INFINITY);
    }
    (record, session)
}

fn plan() -> Plan {
    let unit = OfUnit::preset("icm-42688").unwrap();
    Plan {
        assumptions: Assumptions::of(&unit),
        configuration: unit.configuration().unwrap(),
        horizons: vec![10.0, 30.0],
        no_fixes: false,
        own_start: false,
    }
}

/// The reference is that of the simulator, which it does not know: positions, attitudes, and the
/// time by which the fixes were moved.
#[test]
fn the_reference_finds_attitude_and_time_offset() {
    let (mut record, session) = recorded(1);
    record.move_fixes(0.3);
    let mut timeline = Timeline::of("s", &record).unwrap();
    let begin = timeline.begin_s;
    let found = reference(&mut timeline).unwrap();
    let [offset, x, y] = found.between;
    assert!((offset + 0.3).abs() < 0.06, "{offset}");
    assert!(x.abs() < 1.0 && y.abs() < 1.0, "{x} {y}");
    let later = found
        .states
        .iter()
        .filter(|(step, _)| *step > timeline.step_at(40.0));
    let mut errors: Vec<[f64; 2]> = Vec::new();
    for (step, nav) in later {
        let second = begin + *step as f64 * timeline.step_s;
        let off = second - second.round();
        if off.abs() < 0.11 {
            let truth = &session.reference[second.round() as usize];
            let then = truth.position.displaced(&(truth.velocity * off));
            let position = nav.position.ned_from(&then).xy().norm();
            errors.push([position, nav.q_bn.angle_to(&truth.q_bn).to_degrees()]);
        }
    }
    assert!(errors.len() > 50, "{}", errors.len());
    let worst = |k: usize| errors.iter().map(|of| of[k]).fold(0.0, f64::max);
    assert!(
        worst(0) < 3.0 && worst(1) < 3.0,
        "{} m {} deg",
        worst(0),
        worst(1)
    );
}

fn median_m(judged: &Judged, phase: &str, scheme: &str, horizon: f64) -> Option<f64> {
    let of = |row: &&Row| row.phase == phase && row.scheme == scheme && row.horizon_s == horizon;
    judged.rows.iter().find(of).map(|row| row.median_m)
}

/// Sessions of one unit, of whose biases this share repeats.
fn sessions(count: u64, repeats: f64) -> Vec<Judged> {
    let mut unit = Unit::new(plan(), None);
    let each = (1..=count).map(|turn_on| {
        let (record, _) = recorded_by(turn_on, repeats);
        let timeline = Timeline::of(&format!("s{turn_on}"), &record).unwrap();
        unit.next(timeline).unwrap()
    });
    each.collect()
}

/// Error of the device as a share of that of the uncorrected samples, from power-on.
fn left(judged: &Judged) -> f64 {
    let of = |scheme| median_m(judged, "power-on", scheme, 30.0).unwrap();
    of("device") / of("uncorrected")
}

/// What does not repeat is remembered once: the memory is refuted in the session in which it does
/// harm, and does not act again.
#[test]
fn what_never_repeats_harms_once() {
    let left: Vec<f64> = sessions(6, 0.0).iter().map(left).collect();
    assert_eq!(left[0], 1.0);
    let harmed = left.iter().filter(|left| **left > 1.02);
    assert!(harmed.count() <= 1, "{left:?}");
}

/// What repeats over power-ons is remembered, and the device corrects from the second one on; every
/// phase has rows.
#[test]
fn sessions_build_on_one_another() {
    let all = sessions(3, 0.999);
    assert_eq!(median_m(&all[0], "power-on", "ekf6-memory", 30.0), None);
    for (k, judged) in all.iter().enumerate() {
        assert_eq!(judged.session, k + 1);
        let acts = judged.device.in_force_since_s == Some(0);
        assert_eq!(acts, k > 0);
        let limit = if acts { 0.25 } else { 1.0 };
        assert!(left(judged) <= limit, "{}", left(judged));
        let of = |phase, scheme| median_m(judged, phase, scheme, 30.0).unwrap();
        for phase in PHASES {
            assert!(
                of(phase, "device") <= limit * of(phase, "uncorrected"),
                "{phase}"
            );
        }
        assert!(of("end", "ekf6") < 0.5 * of("end", "uncorrected"));
    }
    let remembered = all[2].remembered.as_ref().unwrap();
    assert!(remembered.sigma.iter().all(|sigma| *sigma > 0.0));
}

/// Without fixes no scheme learns, and the coasts are judged by the same states.
#[test]
fn without_fixes_nothing_is_learnt() {
    let (record, _) = recorded(1);
    let timeline = || Timeline::of("s", &record).unwrap();
    let with = Unit::new(plan(), None).next(timeline()).unwrap();
    let mut blind = Unit::new(
        Plan {
            no_fixes: true,
            ..plan()
        },
        None,
    );
    let judged = blind.next(timeline()).unwrap();
    assert!(judged.remembered.is_none() && judged.device.fixes == [0, 0]);
    let phases: Vec<&str> = PHASES
        .into_iter()
        .filter(|phase| median_m(&judged, phase, "device", 10.0).is_some())
        .collect();
    assert_eq!(phases, ["power-on", "end"]);
    for scheme in ["uncorrected", "device", "ekf6"] {
        assert_eq!(
            median_m(&judged, "power-on", scheme, 10.0),
            median_m(&with, "power-on", "uncorrected", 10.0)
        );
    }
}

/// The start of coasts does not depend on the unit file: neither do the errors of what nothing
/// corrects, although biases and noise of the file are wrong by a factor of 30.
#[test]
fn what_nothing_corrects_does_not_depend_on_the_unit_file() {
    let (record, _) = recorded(2);
    let errors = [0.03, 1.0, 30.0].map(|factor| {
        let mut plan = plan();
        let Assumptions { prior, noise, .. } = &mut plan.assumptions;
        for sigma in [&mut prior.gyro_bias, &mut prior.accel_bias] {
            *sigma *= factor;
        }
        for sigma in [&mut noise.gyro, &mut noise.accel] {
            *sigma *= factor;
        }
        let mut unit = Unit::new(plan, None);
        let judged = unit.next(Timeline::of("s", &record).unwrap()).unwrap();
        let of = |horizon| median_m(&judged, "power-on", "uncorrected", horizon).unwrap();
        [10.0, 30.0].map(of)
    });
    for other in [errors[0], errors[2]] {
        for (a, b) in errors[1].iter().zip(other) {
            assert!((b / a - 1.0).abs() < 0.02, "{errors:?}");
        }
    }
}

/// From its own aided state a row has one coast in each phase with fixes, and none at power-on. A
/// navigator without sensor errors in its state starts worse than the smoothed state.
#[test]
fn each_may_start_from_its_own_state() {
    let (record, _) = recorded(1);
    let timeline = || Timeline::of("s", &record).unwrap();
    let own_start = true;
    let judged = Unit::new(
        Plan {
            own_start,
            ..plan()
        },
        None,
    )
    .next(timeline())
    .unwrap();
    let common = Unit::new(plan(), None).next(timeline()).unwrap();
    assert!(
        judged
            .rows
            .iter()
            .all(|row| row.phase != "power-on" && row.coasts == 1)
    );
    for phase in &PHASES[1..] {
        for scheme in ["uncorrected", "ekf6", "device"] {
            assert!(
                median_m(&judged, phase, scheme, 10.0).is_some(),
                "{phase} {scheme}"
            );
        }
    }
    let errors = [&judged, &common].map(|of| median_m(of, "end", "uncorrected", 10.0).unwrap());
    assert!((errors[0] / errors[1] - 1.0).abs() > 0.02, "{errors:?}");
}
