//! Recordings with the defects that people's recordings have, made from simulated drives. Each must
//! replay, and its figures must agree with those of the same drive without the defect.

use super::*;
use crate::experiment::outcome::Outcome;
use crate::experiment::protocol::Begins;
use crate::experiment::user_recording::Plan;
use host_core::inertial::earth::Geodetic;
use host_core::inertial::session::EPOCH_S;
use host_estimation::analysis::time_offset::{contradicted, settle};
use host_estimation::learning::device::Device;
use host_io::recordings::record::Record;
use host_io::recordings::track::Track;
use host_unit::Unit;
use host_unit::around::Kind;
use nalgebra::Vector3;
use test_bench::recordings::simulated;

/// Length of the drives, s: standstill, then road.
const DRIVE_S: [f64; 2] = [20.0, 700.0];
/// When the figures are compared, s after the fixes end.
const AT_S: u32 = 300;
/// Schemes that are compared.
const SCHEMES: [&str; 3] = ["raw", "ekf6", "device"];
/// Drives whose root mean squares are compared.
const SEEDS: [u64; 3] = [1, 2, 3];

/// A drive and the attitude at its start.
fn drive(seed: u64) -> (Record, Session) {
    let mut session = simulated(DRIVE_S[0], DRIVE_S[1], seed);
    session.standstill = 0;
    (Record::from_session(&session), session)
}

fn wishes() -> Wishes {
    Wishes {
        known: VehicleKnowledge {
            vehicle: Kind::Land,
            forward: true,
            heading: None,
        },
        attitude_sigma: [0.05 * DEG, 0.1 * DEG],
        part: None,
    }
}

fn assumptions() -> Assumptions {
    Assumptions::of(&Unit::default())
}

fn started(record: &Record) -> Started {
    let prepared = record.prepare().unwrap();
    start(prepared, &wishes(), &assumptions(), Path::new("in")).unwrap()
}

fn replayed(record: &Record) -> Outcome {
    let started = started(record);
    let plan = Plan {
        begins: match record.truth {
            Some(_) => Begins::Reference,
            None => Begins::Smoothed,
        },
        assumptions: assumptions(),
        device: Device::of_unit(&Unit::default()).unwrap(),
        learn: None,
    };
    let split = plan.split(&started.session).unwrap();
    let outcome = plan.replay("made", &started.session, &split);
    let mut outcome = outcome.unwrap().unwrap();
    outcome.notes.extend(started.notes);
    outcome
}

/// Root mean squares of the horizontal errors over the seeds, m.
fn figures(spoil: impl Fn(&mut Record, &Session)) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for seed in SEEDS {
        let (mut record, session) = drive(seed);
        spoil(&mut record, &session);
        let outcome = replayed(&record);
        for (sum, scheme) in sums.iter_mut().zip(SCHEMES) {
            *sum += outcome.horizontal(scheme, AT_S).unwrap().powi(2);
        }
    }
    sums.map(|sum| (sum / SEEDS.len() as f64).sqrt())
}

/// The figures with a defect are those without, up to `factor` and a few metres of noise.
fn agree(name: &str, factor: f64, spoil: impl Fn(&mut Record, &Session)) {
    let (whole, spoilt) = (figures(|_, _| {}), figures(spoil));
    println!("{name}: {spoilt:.1?} m, without it {whole:.1?} m");
    for ((scheme, a), b) in SCHEMES.iter().zip(whole).zip(spoilt) {
        let far = b > factor * a + 5.0 || a > factor * b + 5.0;
        assert!(!far, "{name}, {scheme}: {b:.1} m instead of {a:.1} m");
    }
}

/// The vehicle is moving when the recording begins, and no attitude is given.
#[test]
fn without_attitude_and_standstill() {
    agree("no attitude", 3.0, |record, _| {
        record.initial_attitude = None;
        let from = record.time.iter().position(|t| *t > 60.0).unwrap();
        record.time = record.time.part(from..usize::MAX);
        record.samples = record.samples.part(from..usize::MAX);
    });
    let (mut record, session) = drive(1);
    record.initial_attitude = None;
    let started = started(&record);
    let note = started
        .notes
        .iter()
        .find(|n| n.starts_with("Aligned in motion"));
    assert!(
        note.is_some_and(|n| n.contains("deg of heading, residual")),
        "{:?}",
        started.notes
    );
    let at = started.begin as usize;
    let start = started.session.start.unwrap();
    let error = (start.nav.q_bn * session.reference[at].q_bn.inverse()).scaled_axis();
    assert!(error.z.abs() < 4.0 * start.sigma.heading, "{error}");
}

#[test]
fn a_gap_of_fixes_of_a_minute() {
    agree("gap of fixes", 2.0, |record, _| {
        record.fixes.retain(|f| !(150.0..210.0).contains(&f.time));
    });
    let (mut record, _) = drive(1);
    record.fixes.retain(|f| !(500.5..560.5).contains(&f.time));
    let outcome = replayed(&record);
    assert!(
        outcome.notes.iter().any(|n| n.contains("60 of")),
        "{:?}",
        outcome.notes
    );
    assert!(
        outcome.notes.iter().any(|n| n.contains("left out")),
        "{:?}",
        outcome.notes
    );
}

fn without_samples(record: &mut Record, from: f64, to: f64) {
    let all = record.time.each().zip(record.samples.each());
    let (time, samples) = all.filter(|(t, _)| !(from..to).contains(t)).unzip();
    let (time, samples): (Vec<_>, Vec<_>) = (time, samples);
    (record.time, record.samples) = (time.into(), samples.into());
}

#[test]
fn a_gap_of_samples_of_a_minute() {
    agree("gap of samples", 3.0, |record, _| {
        without_samples(record, 150.0, 210.0);
    });
    let (mut record, session) = drive(1);
    without_samples(&mut record, 150.0, 210.0);
    let joined = started(&record).session;
    assert_eq!((joined.epochs(), joined.outages.len()), (720, 1));
    let outage = &joined.outages[0];
    assert!(outage.epochs.start == 149 && (211..300).contains(&outage.epochs.end));
    let truth = &session.reference[outage.epochs.end];
    let error = (outage.resume.nav.q_bn * truth.q_bn.inverse()).scaled_axis();
    assert!(error.z.abs() < 4.0 * outage.resume.sigma.heading, "{error}");
    // one part alone
    let part = |number| {
        let wishes = Wishes {
            part: Some(number),
            ..wishes()
        };
        start(
            record.prepare().unwrap(),
            &wishes,
            &assumptions(),
            Path::new("in"),
        )
    };
    assert_eq!(part(1).unwrap().session.epochs(), 149);
    assert!(part(2).unwrap().begin > 210.0);
    let why = part(3).map(|s| s.begin).unwrap_err().to_string();
    assert!(why.starts_with("--part: is 3, and in has 2 parts"), "{why}");
    // a gap in the part that would be judged ends it
    let (mut record, _) = drive(1);
    without_samples(&mut record, 500.0, 560.0);
    let outcome = replayed(&record);
    assert!(outcome.case.contains("judge 360-499 s"), "{}", outcome.case);
    // short gaps are bridged
    let (mut record, _) = drive(1);
    without_samples(&mut record, 300.0, 300.05);
    let started = started(&record);
    assert!(started.session.outages.is_empty());
    assert!(
        started.notes[0].starts_with("1 gap of samples, of at most 0.05"),
        "{:?}",
        started.notes
    );
}

#[test]
fn fixes_off_by_2_9_s() {
    agree("fixes 2.9 s off", 2.0, |record, _| {
        record.move_fixes(-2.9);
        let note = settle(record, true);
        assert!(note.unwrap().contains("estimated"));
        assert!((record.given_offset_s.unwrap() - 2.9).abs() < 0.1);
    });
    let (mut record, _) = drive(1);
    assert_eq!(settle(&mut record, false), None);
    assert_eq!(contradicted(&record), None);
    record.move_fixes(-2.9);
    let doubt = contradicted(&record).unwrap();
    assert!((doubt.best_s - 2.9).abs() < 0.1, "{doubt:?}");
}

/// The antenna is 2 m behind the IMU and 1 m above it.
#[test]
fn a_lever_arm_of_two_metres() {
    let arm = Vector3::new(-2.0, 0.3, -1.0);
    agree("lever arm", 2.0, |record, session| {
        let n = session.samples_per_epoch();
        for fix in &mut record.fixes {
            let epoch = fix.time.round() as usize;
            let truth = &session.reference[epoch];
            let first = (epoch * n).saturating_sub(3).min(session.counts.len() - 6);
            let near = session.increments()[first..][..6].to_vec();
            let rate: Vector3<f64> =
                near.iter().map(|w| w.dtheta).sum::<Vector3<f64>>() / (6.0 * session.dt);
            let at = Geodetic {
                lat: fix.lat_deg * DEG,
                lon: fix.lon_deg * DEG,
                h: fix.height_m,
            };
            let moved = at.displaced(&(truth.q_bn * arm));
            (fix.lat_deg, fix.lon_deg, fix.height_m) = (moved.lat / DEG, moved.lon / DEG, moved.h);
            let v = truth.q_bn * rate.cross(&arm);
            for (axis, speed) in fix.velocity.iter_mut().enumerate() {
                *speed += v[axis];
            }
        }
        record.lever_arm_m = Some(arm.into());
    });
}

/// Fixes with individual accuracies: half of them are ten times worse, with matching accuracies.
#[test]
fn sigmas_of_each_fix() {
    agree("sigmas of each fix", 2.0, |record, _| {
        for (k, fix) in record
            .fixes
            .iter_mut()
            .enumerate()
            .filter(|(k, _)| k % 2 == 1)
        {
            let push = ((k * 7919) % 13) as f64 - 6.0;
            fix.lat_deg += 8e-6 * push;
            fix.velocity[0] += 0.07 * push;
            fix.sigmas = fix.sigmas.map(|s| 10.0 * s);
        }
    });
}

/// With a separate truth the errors are those against the truth, not against the fixes. Navigation
/// starts from its attitude, where learnt biases miss the tilt that they were learnt with.
#[test]
fn a_truth_of_its_own() {
    agree("truth", 5.0, |record, session| {
        let time = (0..session.reference.len())
            .map(|k| k as f64 * EPOCH_S)
            .collect();
        record.truth = Some(Track::new(time, session.reference.clone()));
        for fix in record.fixes.iter_mut().skip(370) {
            fix.lat_deg += 1e-3; // 111 m: these must not be the reference
        }
    });
}

/// Fixes at times between the epochs, later and later.
#[test]
fn fixes_between_the_epochs() {
    agree("uneven times", 2.0, |record, session| {
        record.fixes.clear();
        let sigmas = session.fixes[0].unwrap().sigmas;
        let whole = Record::from_session(session).fixes;
        for (k, fix) in whole.iter().enumerate().take(whole.len() - 1).skip(1) {
            let late = 0.9 * (k % 10) as f64 / 10.0;
            let mut fix = *fix;
            let next = session.reference[k + 1];
            let here = session.reference[k];
            // a cubic curve between two true states, by their positions and velocities
            let (v0, v1) = (here.velocity, next.velocity);
            let p = next.position.ned_from(&here.position);
            let (t, u) = (late, 1.0 - late);
            let at = p * (t * t * (3.0 - 2.0 * t)) + v0 * (t * u * u) - v1 * (t * t * u);
            let moved = here.position.displaced(&at);
            let noise = [
                (fix.lat_deg * DEG - here.position.lat),
                (fix.lon_deg * DEG - here.position.lon),
            ];
            fix.time += late;
            fix.lat_deg = (moved.lat + noise[0]) / DEG;
            fix.lon_deg = (moved.lon + noise[1]) / DEG;
            fix.height_m += moved.h - here.position.h;
            let speed = v0.lerp(&v1, late) - v0;
            for (axis, v) in fix.velocity.iter_mut().enumerate() {
                *v += speed[axis];
            }
            fix.sigmas = sigmas;
            record.fixes.push(fix);
        }
        record.initial_attitude = Some(InitialAttitude::Known(session.reference[1].q_bn));
    });
}

#[test]
fn what_cannot_start_says_why() {
    let why = |record: &Record| {
        let prepared = record.prepare().unwrap();
        let started = start(prepared, &wishes(), &assumptions(), Path::new("in"));
        started.map(|s| s.begin).unwrap_err().to_string()
    };
    let mut stationary = Record::from_session(&simulated(200.0, 5.0, 1));
    stationary.initial_attitude = None;
    let text = why(&stationary);
    assert!(
        text.starts_with("in: 'start' gives no attitude, and none is found in motion: "),
        "{text}"
    );
    assert!(text.contains("; remedy: "), "{text}");
    // fixes of another drive
    let (mut strange, _) = drive(1);
    strange.initial_attitude = None;
    strange.fixes = drive(2).0.fixes;
    let text = why(&strange);
    assert!(text.contains("; remedy: "), "{text}");
}
