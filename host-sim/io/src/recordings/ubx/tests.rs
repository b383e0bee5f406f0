use super::*;
use crate::recordings::record::Record;
use proptest::prelude::*;
use test_bench::recordings::message;

/// A message with its checksum, the sums of RFC 1145 with bytes.
fn ubx(class: u8, id: u8, payload: &[u8]) -> Vec<u8> {
    let length = (payload.len() as u16).to_le_bytes();
    let body = [&[class, id], &length[..], payload].concat();
    let (mut a, mut b) = (0_u8, 0_u8);
    for byte in &body {
        a = a.wrapping_add(*byte);
        b = b.wrapping_add(a);
    }
    [&[0xB5, 0x62], &body[..], &[a, b]].concat()
}

fn data(kind: u8, value: i32) -> [u8; 4] {
    let [a, b, c, _] = value.to_le_bytes();
    [a, b, c, kind]
}

/// The values of sample `k` in the order of [`KINDS`].
fn values(k: i32) -> [i32; 6] {
    [4096, -2048, 10 * k, 1024, -512, 10_035]
}

fn raw(tag: u32, k: i32) -> Vec<u8> {
    let mut payload = vec![0; 4];
    for (kind, value) in KINDS.iter().zip(values(k)).chain([(&12, 2500)]) {
        payload.extend(data(*kind, value));
        payload.extend(tag.to_le_bytes());
    }
    ubx(0x10, 0x03, &payload)
}

/// Gyros and accelerometers in messages of their own, as an F9R sends them.
fn plain(tag: u32, k: i32) -> Vec<u8> {
    let part = |axes: std::ops::Range<usize>| {
        let flags = (3_u16 << 11 | 8).to_le_bytes();
        let mut payload = [&tag.to_le_bytes()[..], &flags, &[0; 2]].concat();
        for axis in axes {
            payload.extend(data(KINDS[axis], values(k)[axis]));
        }
        payload.extend(tag.to_le_bytes()); // calibrated tag, no measurement
        ubx(0x10, 0x02, &payload)
    };
    [part(3..6), part(0..3)].concat()
}

const WEEK_END_MS: i64 = 604_800_000;

fn pvt(ms: i64) -> Vec<u8> {
    Pvt {
        time_of_week: (ms % WEEK_END_MS) as u32,
        fix: 3,
        flags: 1,
        longitude: 80_000_000,
        latitude: 470_000_000 + ms as i32 % 10_000,
        height: 400_250,
        horizontal_accuracy: 1414,
        vertical_accuracy: 2000,
        velocity: [1000, -2000, 30],
        speed_accuracy: 173,
        ..Pvt::default()
    }
    .emit()
    .to_vec()
}

/// Twenty seconds: samples at 100 Hz from a clock that wraps, and fixes at 1 Hz that come 45 ms
/// after their time, the fifth after 22 ms. The week ends in between.
fn log(ticks: u32, sample: fn(u32, i32) -> Vec<u8>) -> Vec<u8> {
    let mut out = b"$GNTXT,01,01,02,u-blox*00\r\n".to_vec();
    for k in 0..=2000_i64 {
        let tag = (u32::MAX - 5 * ticks).wrapping_add((k * i64::from(ticks) / 100) as u32);
        out.extend(sample(tag, k as i32));
        let fast = k / 100 == 5;
        if k % 100 == if fast { 2 } else { 4 } {
            out.extend(pvt(WEEK_END_MS - 10_000 + k / 100 * 1000));
        }
    }
    out
}

fn read_bytes(bytes: &[u8], choice: &Choice) -> Result<Reading, Error> {
    let (_dir, path) = test_bench::recordings::file("in.ubx", bytes);
    read(&path, choice, &|_, _| ())
}

#[test]
fn samples_and_fixes_share_a_clock() {
    for (ticks, sample) in [
        (25_600, raw as fn(u32, i32) -> Vec<u8>),
        (1000, plain),
        (12_345, raw),
    ] {
        let choice = Choice {
            fix_delay_s: 0.02,
            ..Choice::default()
        };
        let read = read_bytes(&log(ticks, sample), &choice).unwrap();
        let r = read.record;
        assert_eq!((r.rate_hz, r.time.len(), r.fixes.len()), (100, 2001, 20));
        // a clock of an unknown rate is measured, to the jitter of the fixes over 19 s
        let near = if ticks == 12_345 { 2e-3 } else { 1e-6 };
        assert!(
            (r.time[2000] - 20.0).abs() < 2.0 * near,
            "{ticks}: {}",
            r.time[2000]
        );
        for (k, fix) in r.fixes.iter().enumerate() {
            assert!(
                (fix.time - k as f64).abs() < 2.0 * near,
                "{ticks} {k}: {}",
                fix.time
            );
        }
        let s = &r.samples[7];
        let d = DEG;
        assert!((s.dtheta - nalgebra::Vector3::new(d, -0.5 * d, 70.0 / 4096.0 * d)).norm() < 1e-12);
        assert_eq!(s.dv, nalgebra::Vector3::new(1.0, -0.5, 10_035.0 / 1024.0));
        let f = r.fixes[3];
        assert_eq!((f.lon_deg, f.height_m), (8.0, 400.25));
        assert_eq!(f.velocity, [1.0, -2.0, 0.03]);
        for (got, want) in f.sigmas.iter().zip([1.0, 1.0, 2.0, 0.1, 0.1, 0.1]) {
            assert!((got - want).abs() < 2e-4, "{f:?}");
        }
        assert!(
            read.notes[0].contains("time tags count"),
            "{:?}",
            read.notes
        );
    }
}

#[test]
fn faults_are_named() {
    let complaint = |bytes: &[u8]| message(&read_bytes(bytes, &Choice::default()).unwrap_err());
    let whole = log(1000, plain);
    let fixes_only: Vec<u8> = (0..20).flat_map(|k| pvt(1000 * k)).collect();
    let samples_only: Vec<u8> = (0..500).flat_map(|k| raw(256 * k, 0)).collect();
    let again = [whole.clone(), plain(5, 3)].concat();
    for (bytes, part) in [
        (
            &b"$GNGGA,1,2*00\r\n"[..],
            "in.ubx: 'UBX' has 15 bytes and no UBX message",
        ),
        (
            &fixes_only,
            "in.ubx: 'ESF-RAW' is not among the messages, nor ESF-MEAS",
        ),
        (
            &samples_only,
            "in.ubx: 'NAV-PVT' does not state the time of the samples",
        ),
        (&again, "in.ubx: 'ESF-MEAS message 2002' has the time"),
    ] {
        let why = complaint(bytes);
        assert!(why.starts_with(part), "no '{part}' in {why}");
    }
    let mut bad = whole.clone();
    let at = bad.windows(2).position(|w| w == [0xB5, 0x62]).unwrap();
    bad[at + 10] ^= 1;
    let read = read_bytes(&bad[..bad.len() - 3], &Choice::default()).unwrap();
    let notes = read.notes.concat();
    assert!(notes.contains("1 damaged messages are left out"), "{notes}");
    assert!(notes.contains("ends within a message"), "{notes}");
    assert_eq!(read.record.time.len(), 1999);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Whatever happens to a log, it is read or refused, and what is read is finite.
    #[test]
    fn damage_of_a_log_never_panics(
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..9),
        noise in prop::collection::vec(any::<u8>(), 0..200),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = log(25_600, raw);
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let at = cut.index(bytes.len());
        bytes.splice(at..at, noise);
        let length = cut.index(2 * bytes.len()).min(bytes.len());
        match read_bytes(&bytes[..length], &Choice::default()) {
            Ok(reading) => prop_assert!(reading.record.time.is_sorted()),
            Err(error) => prop_assert!(error.to_string().contains("; remedy: ")),
        }
    }
}

/// A host's wheel ticks with the tags of its own clock change nothing.
#[test]
fn tags_of_another_clock_do_not_count() {
    let wheels = |k: i32| {
        let mut payload = [&(7000 * k as u32).to_le_bytes()[..], &[8, 8, 0, 0]].concat();
        payload.extend(data(10, k));
        ubx(0x10, 0x02, &payload)
    };
    let (mut mixed, mut alone) = (Vec::new(), Vec::new());
    for k in 0..=2000_i32 {
        let sample = plain(5000 + 10 * k as u32, k);
        mixed.extend(wheels(k));
        for log in [&mut mixed, &mut alone] {
            log.extend(sample.clone());
        }
        mixed.extend(wheels(k));
        if k % 100 == 4 {
            for log in [&mut mixed, &mut alone] {
                log.extend(pvt(i64::from(k) / 100 * 1000));
            }
        }
    }
    let choice = Choice::default();
    let [mixed, alone] = [mixed, alone].map(|log| read_bytes(&log, &choice).unwrap().record);
    let all = |r: &Record| r.time.iter().copied().collect::<Vec<f64>>();
    assert_eq!(all(&mixed), all(&alone));
    assert_eq!(mixed.fixes, alone.fixes);
}

/// UTC at time 0 is known from the first fix, for fixes beside the log.
#[test]
fn the_date_is_known() {
    let dated = |ms: i64| {
        Pvt {
            year: 2026,
            month_to_second: [11, 29, 0, 0, 3],
            nanosecond: -500_000_000,
            valid: 7,
            ..Pvt::parse(&pvt(ms)).unwrap()
        }
        .emit()
    };
    let mut log = Vec::new();
    for k in 0..=2000_i32 {
        log.extend(plain(5000 + 10 * k as u32, k));
        if k % 100 == 0 && k > 0 {
            log.extend(dated(i64::from(k) * 10 + 1500));
        }
    }
    let read = read_bytes(&log, &Choice::default()).unwrap();
    // 2026-11-29 is 20 786 days after 1970, and the first fix is at 1 s
    let want = 20_786.0 * 86_400.0 + 2.5 - 1.0;
    assert!(
        (read.origin_s.unwrap() - want).abs() < 1e-3,
        "{:?}",
        read.origin_s
    );
}
