use super::*;
use firmware::wire::novatel::{Header, Log, Repr};
use host_core::inertial::session::to_si;
use host_core::inertial::sins::Increment;
use test_bench::recordings::{file, message, recorded};

#[test]
fn the_recorded_stream_is_whole() {
    let Some(path) = recorded("novatel-ins2.gps") else {
        return;
    };
    let got = read(&path).unwrap();
    let messages: Vec<(u16, usize)> = got.messages.clone().into_iter().collect();
    println!("{messages:?}");
    assert_eq!(got.messages.values().sum::<usize>(), 835);
    assert_eq!([1362, 508, 1465].map(|id| got.messages[&id]), [766, 62, 6]);
    assert_eq!((got.damaged, got.garbage, got.raw.len()), (0, 0, 0));
    assert_eq!((got.corrected.len(), got.ins.len()), (766, 62));
    for w in got.corrected.windows(2) {
        assert!((w[1].time - w[0].time - 0.008).abs() < 1e-5); // 125 Hz
    }
    // at rest: the remainders of gravity and Earth rate are small, and INSPVAS does not move
    for axis in 0..3 {
        let time = 766.0 * 0.008;
        let rate: f64 = got.corrected.iter().map(|c| c.dtheta[axis]).sum::<f64>() / time;
        let force: f64 = got.corrected.iter().map(|c| c.dv[axis]).sum::<f64>() / time;
        assert!(
            rate.abs() < 1e-3 && force.abs() < 0.02,
            "{axis}: {rate} rad/s, {force} m/s2"
        );
    }
    assert!(
        got.ins
            .iter()
            .all(|i| (i.position[0] - 51.150_442_6).abs() < 1e-6 && i.velocity[0].abs() < 0.01)
    );
    let why = session(&got, Axes::RIGHT_FORWARD_UP, None)
        .unwrap_err()
        .to_string();
    assert!(
        why.contains("'RAWIMUSX' is not among the messages") && why.contains("IMURATECORRIMUS"),
        "{why}"
    );
}

fn raw(log: Log, kind: u8, k: usize) -> Vec<u8> {
    let mut buffer = [0; 128];
    let second = 1000.0 + 0.01 * k as f64;
    let repr = Repr {
        log,
        header: Header {
            week: 2100,
            millisecond: (second * 1e3) as u32,
            ..Header::default()
        },
        lead: [0, kind, 0x34, 0x08],
        second_of_week: second,
        status: 0,
        gyro: [10, 20 + k as i32, -30],
        accel: [1, -2, 43_110_635],
    };
    let n = repr.emit(&mut buffer).unwrap();
    buffer[..n].to_vec()
}

fn ins(second: f64) -> Vec<u8> {
    let log = Inspvas {
        header_time: (2100, (second * 1e3) as u32),
        week: 2100,
        second_of_week: second,
        position: [51.0, -114.0, 1000.0],
        velocity: [second - 1000.0, 2.0, 3.0],
        attitude: [1.0, 2.0, 90.0],
        status: 3,
    };
    log.emit().to_vec()
}

/// Before the alignment: no solution.
fn unaligned(second: f64) -> Vec<u8> {
    let log = Inspvas {
        header_time: (2100, (second * 1e3) as u32),
        week: 2100,
        second_of_week: second,
        position: [0.0; 3],
        velocity: [0.0; 3],
        attitude: [0.0; 3],
        status: 1,
    };
    log.emit().to_vec()
}

/// Raw samples with INSPVAS ten times a second, type 11 (HG1700).
fn stream(log: Log, kind: u8, n: usize) -> Vec<Vec<u8>> {
    (0..n)
        .flat_map(|k| {
            let extra = (k % 10 == 5).then(|| ins(1000.0 + 0.01 * k as f64));
            extra.into_iter().chain([raw(log, kind, k)])
        })
        .collect()
}

fn of(messages: &[Vec<u8>], kind: Option<ImuType>) -> Result<Session, Error> {
    let (_dir, path) = file("in.gps", &messages.concat());
    session(&read(&path)?, Axes::RIGHT_FORWARD_UP, kind)
}

#[test]
fn raw_logs_become_a_session_in_the_sensors_own_counts() {
    for (log, kind) in [
        (Log::Rawimusx, None),
        (Log::Rawimux, None),
        (Log::Rawimu, Some(ImuType(11))),
    ] {
        let s = of(&stream(log, 11, 260), kind).unwrap();
        assert_eq!((s.epochs(), s.dt, s.reference.len()), (2, 0.01, 3));
        // INSPVAS begins at sample 5, so the first sample is number 6, turned to forward-right-down
        assert_eq!(
            s.counts[0],
            Counts {
                dtheta: [26, 10, 30],
                dv: [-2, 1, -43_110_635]
            }
        );
        // one count is 2^-27 ft/s, at 100 Hz
        let down = to_si(&s.counts[0], &s.lsb).dv.z / s.dt;
        assert!(
            (down + 43_110_635.0 / 134_217_728.0 * 0.3048 * 100.0).abs() < 1e-9,
            "{down}"
        );
        assert!((s.reference[1].velocity - Vector3::new(1.05, 2.0, -3.0)).norm() < 1e-6);
        let forward = s.reference[0].q_bn * Vector3::x();
        assert!((forward - Vector3::new(0.0, (2.0 * DEG).cos(), -(2.0 * DEG).sin())).norm() < 1e-9);
    }
}

/// The counts of an EG320N are rates: 2^16 counts of its z accelerometer are 0.2 mg, and a sample
/// is 8 ms.
#[test]
fn counts_of_epson_types_become_increments() {
    for (kind, mg, dt) in [(41, 0.2, 0.008), (61, 0.4, 0.005), (62, 0.2, 0.005)] {
        let (_dir, path) = file("in.gps", &raw(Log::Rawimusx, kind, 0));
        let (lsb, rate) = super::imu(&read(&path).unwrap(), None).unwrap();
        assert_eq!(1.0 / f64::from(rate), dt);
        let milli_g = lsb.mps / dt * 65_536.0 / 9.80665e-3;
        assert!((milli_g - mg).abs() < 1e-9, "{kind}: {milli_g}");
    }
}

#[test]
fn damage_loses_only_the_damaged_messages() {
    let mut all = stream(Log::Rawimusx, 11, 260);
    let last = all.len() - 1;
    all[last][30] ^= 1;
    all.insert(0, b"garbage".to_vec());
    let (_dir, path) = file("in.gps", &all.concat());
    let got = read(&path).unwrap();
    assert_eq!(
        (got.raw.len(), got.ins.len(), got.damaged, got.garbage),
        (259, 26, 1, 7 + 56)
    );
}

#[test]
fn every_fault_is_named() {
    let good = stream(Log::Rawimusx, 11, 260);
    let without =
        |f: &dyn Fn(&[u8]) -> bool| good.iter().filter(|m| !f(m)).cloned().collect::<Vec<_>>();
    let mut bad = raw(Log::Rawimusx, 11, 260);
    bad[12] = 1; // IMU error
    let repr = Repr {
        lead: [1, 11, 0, 0],
        ..Repr::parse(&Frame::new_checked(raw(Log::Rawimusx, 11, 260)).unwrap())
    };
    let n = repr.emit(&mut bad).unwrap();
    let with_bad = [good.clone(), vec![bad[..n].to_vec()]].concat();
    let lost = without(&|m| m == raw(Log::Rawimusx, 11, 33));
    for (messages, start) in [
        (
            vec![b"nothing".to_vec()],
            "in.gps: 'NovAtel log' has 7 bytes and no good message",
        ),
        (
            stream(Log::Rawimusx, 200, 260),
            "in.gps: 'IMU type' is 200, whose scale",
        ),
        (
            stream(Log::Rawimus, 11, 260),
            "in.gps: 'IMU type' is not in RAWIMU",
        ),
        (
            without(&|m| m.len() == 104),
            "in.gps: 'INSPVAS' is not among the messages",
        ),
        (
            good[..100].to_vec(),
            "in.gps: 'INSPVAS' covers less than one second",
        ),
        (
            lost,
            "in.gps: 'raw sample' 33 at 1000.340 s comes 0.0200 s after",
        ),
        (
            with_bad,
            "in.gps: 'raw sample' 260 at 1002.600 s is marked bad",
        ),
        (
            [vec![ins(2000.0)], without(&|m| m.len() == 104)].concat(),
            "in.gps: 'INSPVAS' begins after",
        ),
    ] {
        let why = message(&of(&messages, None).unwrap_err());
        assert!(why.starts_with(start), "{why}");
    }
    assert!(matches!(
        read(Path::new("no/such.gps")),
        Err(Error::Missing { .. })
    ));
}

#[test]
fn a_record_for_conversion_has_the_same_samples_and_fixes_in_seconds_of_the_week() {
    let (_dir, path) = file("in.gps", &stream(Log::Rawimusx, 11, 260).concat());
    let log = read(&path).unwrap();
    let r = record(&log, Axes::RIGHT_FORWARD_UP, None).unwrap();
    let s = session(&log, Axes::RIGHT_FORWARD_UP, None).unwrap();
    assert_eq!((r.samples.len(), r.rate_hz, r.fixes.len()), (260, 100, 26));
    assert!((r.time[0] - 1000.0).abs() < 1e-6 && (r.fixes[0].time - 1000.05).abs() < 1e-6);
    assert_eq!(r.samples[6].dtheta, s.increments()[0].dtheta);
    assert_eq!(r.fixes[0].velocity[1..], [2.0, -3.0]);
    assert_eq!((r.fixes[0].lat_deg, r.fixes[0].lon_deg), (51.0, -114.0));
    let begin = r
        .initial_attitude
        .map(|b| matches!(b, InitialAttitude::Known(q) if q.angle_to(&s.reference[0].q_bn) < 1e-9));
    assert_eq!(begin, Some(true));
}

/// Missing and bad samples are gaps of the record, and times that do not rise are named.
#[test]
fn a_record_bridges_missing_and_bad_samples() {
    let mut messages = stream(Log::Rawimusx, 11, 360);
    messages.retain(|m| *m != raw(Log::Rawimusx, 11, 33));
    let bad = messages
        .iter()
        .position(|m| *m == raw(Log::Rawimusx, 11, 50));
    let repr = Repr {
        lead: [1, 11, 0, 0], // IMU error
        ..Repr::parse(&Frame::new_checked(raw(Log::Rawimusx, 11, 50)).unwrap())
    };
    let mut buffer = [0; 128];
    let n = repr.emit(&mut buffer).unwrap();
    messages[bad.unwrap()] = buffer[..n].to_vec();
    let (_dir, path) = file("in.gps", &messages.concat());
    let record = record(&read(&path).unwrap(), Axes::RIGHT_FORWARD_UP, None).unwrap();
    assert_eq!((record.samples.len(), record.rate_hz), (358, 100));
    let prepared = record.prepare().unwrap();
    assert!(prepared.missing.is_empty());
    assert!(
        prepared.notes[0].starts_with("2 gaps of samples, of at most 0.01"),
        "{:?}",
        prepared.notes
    );
    // half a second is missing as in every other format
    let lost: Vec<Vec<u8>> = (100..150).map(|k| raw(Log::Rawimusx, 11, k)).collect();
    messages.retain(|m| !lost.contains(m));
    let (_dir, path) = file("in.gps", &messages.concat());
    let log = read(&path).unwrap();
    let prepared = super::record(&log, Axes::RIGHT_FORWARD_UP, None);
    assert_eq!(prepared.unwrap().prepare().unwrap().missing.len(), 1);
    // one sample in two logs
    messages.push(messages[messages.len() - 1].clone());
    let (_dir, path) = file("in.gps", &messages.concat());
    let why = super::record(&read(&path).unwrap(), Axes::RIGHT_FORWARD_UP, None);
    let why = message(&why.unwrap_err());
    assert!(
        why.starts_with("in.gps: 'raw sample' at 1003.590 s follows that at 1003.590 s"),
        "{why}"
    );
}

/// The log is written again with other counts and right checksums; all else stays, and the sum of
/// the counts is that of the corrections to half a count.
#[test]
fn a_log_is_written_again_with_corrected_counts() {
    let mut messages = stream(Log::Rawimusx, 11, 260);
    messages.insert(40, b"between two messages".to_vec());
    messages.push(messages[7][..20].to_vec());
    let whole = messages.concat();
    let (_dir, path) = file("in.gps", &whole);
    let log = read(&path).unwrap();
    let record = record(&log, Axes::RIGHT_FORWARD_UP, None).unwrap();
    let original = super::log(&log, Axes::RIGHT_FORWARD_UP, None).unwrap();
    let mut taken = vec![Increment::default(); 260];
    assert!(original.without(&taken).unwrap() == whole);
    let count = super::imu(&log, None).unwrap().0;
    for taken in &mut taken[100..] {
        taken.dtheta = Vector3::new(0.3, 0.0, -1.7) * count.rad;
        taken.dv = Vector3::new(0.0, 2.0, 0.0) * count.mps;
    }
    let bytes = original.without(&taken).unwrap();
    assert_eq!(bytes.len(), whole.len());
    let at = messages
        .iter()
        .position(|m| *m == raw(Log::Rawimusx, 11, 100));
    let before: usize = messages[..at.unwrap()].iter().map(Vec::len).sum();
    assert!(bytes[..before] == whole[..before]);
    let (_dir, path) = file("in.gps", &bytes);
    let again = read(&path).unwrap();
    assert_eq!(
        (again.messages.clone(), again.damaged),
        (log.messages.clone(), log.damaged)
    );
    assert!(again.ins == log.ins);
    // right is x, up is z: forward 0.3 is y, down -1.7 is z 1.7
    let sum = |log: &Recording, pick: &dyn Fn(&Raw) -> i32| -> i64 {
        log.raw[100..].iter().map(|raw| i64::from(pick(raw))).sum()
    };
    let moved = |pick: &dyn Fn(&Raw) -> i32| sum(&again, pick) - sum(&log, pick);
    assert_eq!([0, 1, 2].map(|i| moved(&|r| r.gyro[i])), [0, -48, -272]);
    assert_eq!([0, 1, 2].map(|i| moved(&|r| r.accel[i])), [-320, 0, 0]);
    assert_eq!(record.samples.len(), again.raw.len());
    let why = original.without(&taken[1..]).unwrap_err().to_string();
    assert!(why.contains("'raw samples' are not those"), "{why}");
}

/// A solution that is not aligned is no fix and gives no attitude; the attitude is that at the
/// first epoch, also where solutions come before the samples.
#[test]
fn what_comes_before_the_alignment_is_left_out() {
    let whole = stream(Log::Rawimusx, 11, 260).concat();
    let before = [ins(990.0), ins(998.0)].concat();
    let started: Vec<u8> = (0..3)
        .flat_map(|k| unaligned(985.0 + f64::from(k)))
        .collect();
    let (_dir, path) = file("in.gps", &[started, before, whole].concat());
    let r = record(&read(&path).unwrap(), Axes::RIGHT_FORWARD_UP, None).unwrap();
    assert_eq!((r.fixes.len(), r.lever_arm_m), (28, Some([0.0; 3])));
    assert!(
        r.notes[0].contains("3 lines from 985 to 987 s hold no fix"),
        "{:?}",
        r.notes
    );
    let turning = |second: f64| {
        let log = Inspvas::parse(&ins(second)).unwrap();
        Inspvas {
            attitude: [0.0, 0.0, 10.0 * (second - 990.0)],
            ..log
        }
    };
    let turned = [990.0, 998.0, 1000.05, 1001.05].map(turning);
    let log = Recording {
        ins: turned.to_vec(),
        ..read(&path).unwrap()
    };
    let r = record(&log, Axes::RIGHT_FORWARD_UP, None).unwrap();
    let Some(InitialAttitude::Known(q)) = r.initial_attitude else {
        panic!("no attitude");
    };
    let heading = q.euler_angles().2 / DEG;
    let first = r.first_epoch() - 990.0;
    assert!(
        (heading - 10.0 * first).abs() < 1e-6 && first > 9.0,
        "{heading} {first}"
    );
}
