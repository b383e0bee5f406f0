use super::*;
use nalgebra::Vector3;

fn record(kind: Kind, velocity: Option<[f64; 3]>) -> Record {
    let sigma_v = velocity.map_or(NOT_MEASURED, |_| 0.1);
    let fix = |k: usize| TimedFix {
        time: k as f64,
        lat_deg: 45.0 + 1e-5 * k as f64,
        lon_deg: 7.0,
        height_m: 100.0,
        velocity: velocity.unwrap_or_default(),
        sigmas: [1.0 + k as f64, 2.0, 3.0, sigma_v, sigma_v, sigma_v],
    };
    Record {
        file: "in".into(),
        time: (0..=400).map(|k| 0.01 * f64::from(k)).collect(),
        samples: (0..=400)
            .map(|k| Increment {
                dtheta: Vector3::new(0.0, 0.0, 0.001 * f64::from(k)),
                dv: Vector3::new(0.0, 0.0, -0.098),
            })
            .collect(),
        kind,
        rate_hz: 100,
        fixes: (0..5).map(fix).collect(),
        initial_attitude: Some(InitialAttitude::Known(UnitQuaternion::identity())),
        ..Record::default()
    }
}

#[test]
fn rates_become_the_increments_of_a_trapezoid_and_increments_stay() {
    let (rates, increments) = (record(Kind::Rate, None), record(Kind::Increment, None));
    let made: Vec<_> = rates.increments().collect();
    assert_eq!((made.len(), made[0].0), (400, 0.01));
    assert!((made[9].1.dtheta.z - 0.01 * 0.0095).abs() < 1e-15);
    let recorded = increments.time.each().zip(increments.samples.each());
    assert!(increments.increments().eq(recorded));
}

/// Without the rates from 1 to 3 s, no increment claims the motion of the gap.
#[test]
fn a_gap_of_rates_stays_a_gap_of_increments() {
    let mut gappy = record(Kind::Rate, None);
    gappy.time.edit(|all| drop(all.drain(101..300)));
    gappy.samples.edit(|all| drop(all.drain(101..300)));
    let (time, increments): (Vec<_>, Vec<_>) = gappy.written_increments().unzip();
    assert_eq!((time.len(), increments.len()), (200, 200));
    assert!((time[99] - 1.0).abs() < 1e-9 && (time[100] - 3.01).abs() < 1e-9);
    let turned = increments[100].dtheta.z;
    assert!((turned - 0.01 * 0.3005).abs() < 1e-9, "{turned}");
    let whole = record(Kind::Rate, None);
    assert!(whole.written_increments().eq(whole.increments()));
}

/// Ten minutes at rest under 9.8 m/s2, in samples whose stamps have so many decimals. Every
/// hundredth sample is missing if `loses`.
fn at_rest(kind: Kind, rate: f64, decimals: usize, loses: bool) -> Record {
    let kept = (1..=(600.0 * rate) as usize).filter(|k| !loses || k % 100 != 50);
    let stamp = |k| format!("{:.decimals$}", k as f64 / rate).parse::<f64>();
    let time: Vec<f64> = kept.map(|k| stamp(k).unwrap()).collect();
    let each = match kind {
        Kind::Rate => 1.0,
        Kind::Increment => 1.0 / rate,
    };
    let sample = Increment {
        dtheta: Vector3::new(0.0, 0.0, 0.002 * each),
        dv: Vector3::new(0.0, 0.0, -9.8 * each),
    };
    let mut record = record(kind, None);
    record.samples = time.iter().map(|_| sample).collect();
    record.time = time.into();
    record.rate_hz = rate as usize;
    record.fixes = (1..=599)
        .map(|k| TimedFix {
            time: f64::from(k),
            ..record.fixes[1]
        })
        .collect();
    record
}

/// The mean rate and force of a session.
fn means(record: &Record) -> [f64; 2] {
    let session = record.prepare().unwrap().session;
    let seconds = session.epochs() as f64;
    let sums = session
        .increments()
        .into_iter()
        .fold([0.0; 2], |[turn, speed], i| {
            [turn + i.dtheta.z, speed + i.dv.z]
        });
    sums.map(|sum| sum / seconds)
}

/// Whatever the rounding of the stamps, and whatever is missing, the motion is that of the vehicle.
#[test]
fn rounded_stamps_and_missing_samples_add_no_motion() {
    for (rate, decimals) in [(800.0, 3), (75.0, 2), (700.0, 3), (400.0, 3), (100.0, 2)] {
        for (kind, loses) in [
            (Kind::Increment, false),
            (Kind::Increment, true),
            (Kind::Rate, false),
            (Kind::Rate, true),
        ] {
            let [turn, force] = means(&at_rest(kind, rate, decimals, loses));
            let what = format!("{rate} Hz, {kind:?}, {loses}: {turn} rad/s, {force} m/s2");
            assert!((turn / 0.002 - 1.0).abs() < 1e-4, "{what}");
            assert!((force / -9.8 - 1.0).abs() < 1e-4, "{what}");
        }
    }
}

/// Written as increments, a missing rate leaves increments of the usual length, so that a reader
/// bridges nothing again.
#[test]
fn a_short_gap_of_rates_becomes_increments_of_the_usual_length() {
    let rates = at_rest(Kind::Rate, 100.0, 3, true);
    let (time, samples): (Vec<_>, Vec<_>) = rates.written_increments().unzip();
    assert_eq!(time.len(), 59_999);
    assert!(
        time.windows(2)
            .all(|pair| (pair[1] - pair[0] - 0.01).abs() < 1e-9)
    );
    let written = Record {
        time: time.into(),
        samples: samples.into(),
        kind: Kind::Increment,
        ..rates
    };
    let [turn, force] = means(&written);
    assert!((turn / 0.002 - 1.0).abs() < 1e-9 && (force / -9.8 - 1.0).abs() < 1e-9);
    let notes = written.prepare().unwrap().notes;
    assert!(
        notes.iter().all(|note| !note.contains("bridged")),
        "{notes:?}"
    );
}

#[test]
fn a_velocity_that_was_not_measured_has_no_weight() {
    let without = record(Kind::Rate, None).session().unwrap();
    let fix = without.fixes[2].unwrap();
    assert_eq!(fix.sigmas[..3], [3.0, 2.0, 3.0]);
    assert!(fix.has(0..3) && (3..6).all(|i| !fix.has(i..i + 1)));
    assert!((without.reference[2].velocity.x - 1.11).abs() < 0.01);
    let with = record(Kind::Rate, Some([5.0, 0.0, 0.0])).session().unwrap();
    let fix = with.fixes[2].unwrap();
    assert_eq!((fix.sigmas[3], fix.velocity.x), (0.1, 5.0));
    assert_eq!(with.reference[2].velocity.x, 5.0);
}

/// An epoch takes the nearest fix since the epoch before, with its own time and accuracy.
#[test]
fn a_fix_belongs_to_its_time() {
    let mut r = record(Kind::Rate, None);
    let mut early = r.fixes[1];
    early.time = 1.4;
    r.fixes.insert(2, early);
    r.fixes[3].time = 2.03; // a little late
    r.fixes[4].time = 2.9;
    r.fixes.pop();
    r.fixes[1].sigmas[0] = 7.0;
    let s = r.session().unwrap();
    let ages: Vec<Option<f64>> = s.fixes.iter().map(|f| Some(f.as_ref()?.age_s)).collect();
    let near = |got: Option<f64>, want: f64| (got.unwrap() - want).abs() < 1e-9;
    assert!(
        near(ages[0], 0.0) && near(ages[1], 0.0) && near(ages[2], -0.03),
        "{ages:?}"
    );
    assert_eq!(s.fixes[1].unwrap().sigmas[0], 7.0);
    assert_eq!(s.epochs(), 2);
}

#[test]
fn a_gap_of_fixes_leaves_epochs_without_and_nothing_is_judged_there() {
    let mut r = record(Kind::Rate, None);
    r.time = (0..=2000).map(|k| 0.01 * f64::from(k)).collect();
    let first = r.samples[0];
    r.samples.edit(|all| all.resize(2001, first));
    r.fixes[3].time = 9.0;
    r.fixes[4].time = 10.0;
    let s = r.session().unwrap();
    let there: Vec<usize> = (0..=10).filter(|k| s.fixes[*k].is_some()).collect();
    assert_eq!(there, [0, 1, 2, 9, 10]);
    assert_eq!(s.unjudged, vec![3..9; 1]);
    assert!(s.judges(2) && !s.judges(3) && !s.judges(8) && s.judges(9));
    assert_eq!(s.nearest_fix(6).position, s.nearest_fix(9).position);
    assert_eq!(s.nearest_fix(5).position, s.nearest_fix(2).position);
}

#[test]
fn missing_parts_are_named() {
    let mut r = record(Kind::Rate, None);
    r.initial_attitude = None;
    let why = r.session().unwrap_err().to_string();
    assert!(why.starts_with("in: 'start' is not given"), "{why}");
    let mut r = record(Kind::Rate, None);
    r.fixes.clear();
    let why = r.session().unwrap_err().to_string();
    assert!(why.starts_with("in: 'fixes' are not"), "{why}");
}
