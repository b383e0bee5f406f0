use super::*;
use proptest::prelude::*;
use test_bench::recordings::{finite, message};

fn raw(kind: u8, content: &[u8]) -> Vec<u8> {
    [&(content.len() as u16).to_le_bytes()[..], &[kind], content].concat()
}

fn data(id: u16, fields: &[&[u8]]) -> Vec<u8> {
    raw(b'D', &[&id.to_le_bytes()[..], &fields.concat()].concat())
}

fn add(instance: u8, id: u16, topic: &str) -> Vec<u8> {
    raw(
        b'A',
        &[&[instance], &id.to_le_bytes()[..], topic.as_bytes()].concat(),
    )
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn parameter(name: &str, value: f32) -> Vec<u8> {
    let key = format!("float {name}");
    raw(
        b'P',
        &[&[key.len() as u8], key.as_bytes(), &value.to_le_bytes()].concat(),
    )
}

const FORMATS: [&str; 6] = [
    "vehicle_imu:uint64_t timestamp;uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;uint32_t delta_angle_dt;uint32_t delta_velocity_dt;",
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;uint32_t accelerometer_integral_dt;uint8_t[4] _padding0;",
    "vehicle_gps_position:uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt_ellipsoid;float s_variance_m_s;float eph;float epv;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid;",
    "sensor_gps:uint64_t timestamp;uint64_t timestamp_sample;uint64_t time_utc_usec;double latitude_deg;double longitude_deg;double altitude_ellipsoid_m;float s_variance_m_s;float eph;float epv;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;uint8_t fix_type;bool vel_ned_valid;",
    "vehicle_attitude:uint64_t timestamp;nested before;float[4] q;",
    "nested:uint8_t[3] x;int16_t y;",
];

fn head() -> Vec<u8> {
    let start = [
        &[0x55, 0x4C, 0x6F, 0x67, 1, 0x12, 0x35, 1][..],
        &7_u64.to_le_bytes(),
    ]
    .concat();
    let formats = FORMATS.iter().flat_map(|text| raw(b'F', text.as_bytes()));
    let mut out = [start, raw(b'B', &[0; 40])].concat();
    out.extend(formats);
    out.extend(parameter(DELAY, 120.0));
    out
}

const START_US: u64 = 5_000_000;

fn imu(id: u16, k: u64) -> Vec<u8> {
    let end = (START_US + 5000 * k).to_le_bytes();
    let values = floats(&[1e-3, 2e-3, 0.25 * k as f32 * 1e-3, 0.01, 0.0, -0.049]);
    let lengths = [5000_u32.to_le_bytes(), 5000_u32.to_le_bytes()].concat();
    data(
        id,
        &[
            &(START_US + 5000 * k + 900).to_le_bytes(),
            &end,
            &values,
            &lengths,
        ],
    )
}

fn combined(k: u64) -> Vec<u8> {
    let length = 5000_u32.to_le_bytes();
    let relative = if k == 7 { i32::MAX } else { 0 }.to_le_bytes();
    data(
        2,
        &[
            &(START_US + 5000 * k).to_le_bytes(),
            &floats(&[0.2, 0.4, 0.05 * k as f32]),
            &length,
            &relative,
            &floats(&[2.0, 0.0, -9.8]),
            &length,
        ],
    )
}

fn gps(k: u64, kind: u8) -> Vec<u8> {
    let position = [470_000_000 + 100 * k as i32, 80_000_000, 400_250].map(i32::to_le_bytes);
    let floats = floats(&[0.3, 1.5, 2.5, 4.0, -1.0, 0.5]);
    data(
        3,
        &[
            &(START_US + 1_000_000 * k + 3).to_le_bytes(),
            &position.concat(),
            &floats,
            &[kind, 1],
        ],
    )
}

fn sensor_gps(k: u64) -> Vec<u8> {
    timed_gps(k, 0, 0)
}

fn timed_gps(k: u64, sampled: u64, utc: u64) -> Vec<u8> {
    let time = (START_US + 1_000_000 * k).to_le_bytes();
    let others = [sampled, utc].map(u64::to_le_bytes).concat();
    let position = [47.0 + 1e-5 * k as f64, 8.0, 400.25].map(f64::to_le_bytes);
    let floats = floats(&[0.3, 1.5, f32::NAN, 4.0, -1.0, 0.5]);
    data(4, &[&time, &others, &position.concat(), &floats, &[3, 0]])
}

fn attitude(k: u64) -> Vec<u8> {
    let q = floats(&[0.5, 0.5, 0.5, 0.5]);
    data(5, &[&(START_US + 100_000 * k).to_le_bytes(), &[9; 5], &q])
}

fn subscriptions() -> Vec<u8> {
    [
        add(0, 0, "vehicle_imu"),
        add(1, 1, "vehicle_imu"),
        add(0, 2, "sensor_combined"),
        add(0, 3, "vehicle_gps_position"),
        add(0, 4, "sensor_gps"),
        add(0, 5, "vehicle_attitude"),
    ]
    .concat()
}

/// Three seconds with the messages that `each` makes for each step of 5 ms.
fn log(each: impl Fn(u64) -> Vec<u8>) -> Vec<u8> {
    let all: Vec<u8> = (0..=600).flat_map(each).collect();
    [head(), subscriptions(), all].concat()
}

/// Messages that the default profile logs: `vehicle_imu` every hundredth time, the rest whole.
fn usual(k: u64) -> Vec<u8> {
    let second = k.is_multiple_of(200);
    [
        if k.is_multiple_of(100) {
            imu(0, k)
        } else {
            Vec::new()
        },
        combined(k),
        if second { gps(k / 200, 3) } else { Vec::new() },
        if k.is_multiple_of(20) {
            attitude(k / 20)
        } else {
            Vec::new()
        },
    ]
    .concat()
}

fn read_bytes(bytes: &[u8], choice: &Choice) -> Result<Reading, Error> {
    let (_dir, path) = test_bench::recordings::file("in.ulg", bytes);
    read(&path, choice, &|_, _| ())
}

fn complaint(bytes: &[u8], choice: &Choice) -> String {
    message(&read_bytes(bytes, choice).unwrap_err())
}

#[test]
fn increments_are_preferred_where_they_are_whole() {
    let both = |k: u64| {
        let gps = if k.is_multiple_of(200) {
            sensor_gps(k / 200)
        } else {
            Vec::new()
        };
        [imu(0, k), imu(1, k), combined(k), gps].concat()
    };
    let read = read_bytes(&log(both), &Choice::default()).unwrap();
    let r = read.record;
    assert_eq!(
        (r.kind, r.rate_hz, r.time.len()),
        (Kind::Increment, 200, 601)
    );
    assert_eq!((r.time[0], r.time[600]), (0.0, 3.0));
    assert_eq!(r.samples[8].dtheta.z, f64::from(2e-3_f32));
    assert_eq!(r.samples[8].dv.z, f64::from(-0.049_f32));
    assert!(
        read.notes[1].contains("vehicle_imu has the instances 0, 1"),
        "{:?}",
        read.notes
    );
    // the delay of the parameter, and the defaults where the receiver reports nothing
    let f = r.fixes[1];
    assert_eq!((f.time, f.lat_deg, f.height_m), (0.88, 47.0 + 1e-5, 400.25));
    let root = |x: f32, n: f64| f64::from(x) / n.sqrt();
    assert_eq!(f.sigmas[..3], [root(1.5, 2.0), root(1.5, 2.0), 1.5]);
    assert!(!f.has(3..6), "marked as no velocity");
}

#[test]
fn means_are_read_where_increments_are_missing() {
    let choice = Choice {
        fix_delay_s: Some(0.0),
        attitude: true,
        ..Choice::default()
    };
    let read = read_bytes(&log(usual), &choice).unwrap();
    let r = read.record;
    // one is marked invalid
    assert_eq!(
        (r.kind, r.rate_hz, r.time.len()),
        (Kind::Increment, 200, 600)
    );
    assert_eq!(r.samples[4].dtheta.z, f64::from(0.05_f32 * 4.0) * 5e-3);
    assert_eq!(r.samples[7].dtheta.z, f64::from(0.05_f32 * 8.0) * 5e-3);
    assert_eq!((r.time[6], r.time[7]), (0.03, 0.04));
    let notes = read.notes.concat();
    assert!(
        notes.contains("1 sample of sensor_combined without"),
        "{notes}"
    );
    let f = r.fixes[2];
    assert!((f.time - 2.000_003).abs() < 1e-9);
    let close = [f.lat_deg - 47.00002, f.lon_deg - 8.0, f.height_m - 400.25];
    assert!(close.iter().all(|x| x.abs() < 1e-9), "{f:?}");
    assert_eq!(f.velocity, [4.0, -1.0, 0.5]);
    let root = |x: f32, n: f64| f64::from(x) / n.sqrt();
    assert_eq!(f.sigmas[2..4], [2.5, root(0.3, 3.0)]);
    // nested fields before it do not move a field
    let Some(InitialAttitude::Known(q)) = r.initial_attitude else {
        panic!("no attitude");
    };
    assert_eq!([q.w, q.i, q.j, q.k], [0.5; 4]);
}

#[test]
fn fixes_of_another_kind_are_left_out() {
    let each = |k: u64| match k % 200 {
        0 => [combined(k), gps(k / 200, 2)].concat(),
        _ => combined(k),
    };
    let read = read_bytes(&log(each), &Choice::default()).unwrap();
    assert_eq!(read.record.fixes, []);
}

#[test]
fn damage_and_cuts_are_passed_with_a_note() {
    let sync = raw(b'S', &[0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]);
    let each = |k: u64| match k {
        200 => [vec![0xFF, 0xFF, b'?', 1, 2, 3], sync.clone(), usual(k)].concat(),
        _ => usual(k),
    };
    let whole = log(each);
    let read = read_bytes(&whole, &Choice::default()).unwrap();
    assert_eq!((read.record.time.len(), read.record.fixes.len()), (600, 4));
    assert!(
        read.notes[0].contains("6 damaged bytes left out"),
        "{:?}",
        read.notes
    );
    let intact = log(usual);
    let half = read_bytes(&intact[..intact.len() / 2], &Choice::default()).unwrap();
    assert!((200..400).contains(&half.record.time.len()));
    let read = read_bytes(&intact[..intact.len() - 5], &Choice::default()).unwrap();
    let note = &read.notes[0];
    assert!(
        note.contains("ends within a message and is read up to"),
        "{note}"
    );
    // the log was cut and continued: bytes up to the offset do not count
    let mut bytes = log(usual);
    bytes.extend([30, 0, b'D', 2, 0, 1, 1]);
    let offset = bytes.len() as u64;
    bytes[16 + 3 + 8] = 1;
    bytes[16 + 3 + 16..][..8].copy_from_slice(&offset.to_le_bytes());
    bytes.extend(combined(601));
    let read = read_bytes(&bytes, &Choice::default()).unwrap();
    assert_eq!(read.record.time.len(), 601);
    let dropout = |k: u64| [usual(k), raw(b'O', &[20, 0])].concat();
    let read = read_bytes(&log(dropout), &Choice::default()).unwrap();
    assert!(
        read.notes[0].contains("dropped out 601 times, 12020 ms"),
        "{:?}",
        read.notes
    );
}

/// The share that is logged is reported: a topic without a quarter of its messages is not whole.
#[test]
fn the_share_that_is_logged_is_reported() {
    let three_of_four = |k: u64| match k % 4 {
        0 => Vec::new(),
        _ => combined(k),
    };
    let why = complaint(&log(three_of_four), &Choice::default());
    let part = "'sensor_combined' is logged for 74.9 % of the time, and vehicle_imu has no samples";
    assert!(why.contains(part), "{why}");
}

#[test]
fn every_fault_is_named() {
    let only = |instance: u8| Choice {
        instance: Some(instance),
        ..Choice::default()
    };
    let attitude = Choice {
        attitude: true,
        ..Choice::default()
    };
    let mut newer = log(usual);
    newer[16 + 3 + 8] = 2;
    let with = |at: u64, other: Vec<u8>| log(|k| if k == at { other.clone() } else { usual(k) });
    let only_gps = log(|k| gps(k, 3));
    let no_attitude = log(|k| [combined(k), if k == 0 { gps(0, 3) } else { Vec::new() }].concat());
    for (bytes, choice, part) in [
        (
            b"not a log at all".to_vec(),
            Choice::default(),
            "in.ulg: 'ULog, byte 16' is no ULog file",
        ),
        (newer, Choice::default(), "needs a newer reader"),
        (
            log(usual),
            only(0),
            "'--instance' 0 of vehicle_imu is logged for 1.0 % of the time, and 90 % are needed",
        ),
        (
            log(usual),
            only(3),
            "'--instance' 3 of vehicle_imu is not in the log",
        ),
        (
            only_gps,
            Choice::default(),
            "'sensor_combined' has no samples, and vehicle_imu has no samples; 90 % are needed",
        ),
        (
            no_attitude,
            attitude,
            "'--attitude-from-log' finds no attitude",
        ),
        (
            with(250, combined(249)),
            Choice::default(),
            "'sensor_combined 0 message 250' has the time 6.245000000 s after 6.245000000 s",
        ),
    ] {
        let why = complaint(&bytes, &choice);
        assert!(why.contains(part), "no '{part}' in {why}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever happens to a file, it is read or refused, and what is read is finite.
    #[test]
    fn no_damage_panics(
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        early in any::<bool>(),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = log(usual);
        let within = if early { 1200 } else { bytes.len() };
        for (at, value) in hits {
            bytes[at.index(within)] = value;
        }
        let length = cut.index(2 * bytes.len()).min(bytes.len());
        match read_bytes(&bytes[..length], &Choice::default()) {
            Ok(reading) => {
                prop_assert!(reading.record.time.is_sorted());
                prop_assert!(finite(&reading.record.samples));
            }
            Err(error) => prop_assert!(error.to_string().contains("; remedy: ")),
        }
    }
}

/// The time of validity that a driver has measured counts instead of the delay, and nonsense there
/// does not; UTC at time 0 is known.
#[test]
fn a_measured_time_of_validity_counts() {
    let read = |sampled: fn(u64) -> u64| {
        let each = |k: u64| {
            let second = k / 200;
            let valid = START_US + 1_000_000 * second - 80_000;
            let utc = 1_764_000_000_000_000 + 1_000_000 * second;
            match k % 200 {
                0 => [combined(k), timed_gps(second, sampled(valid), utc)].concat(),
                _ => combined(k),
            }
        };
        read_bytes(&log(each), &Choice::default()).unwrap()
    };
    for (sampled, age) in [
        ((|valid| valid) as fn(u64) -> u64, 0.08),
        (|_| 0, 0.12),
        (|_| 77, 0.12),
    ] {
        let read = read(sampled);
        let fixes = &read.record.fixes;
        assert!(
            (fixes[2].time - (2.0 - age)).abs() < 1e-9,
            "{}",
            fixes[2].time
        );
        assert!((read.origin_s.unwrap() - 1_764_000_000.0 - age).abs() < 1e-6);
    }
}
