use super::testing::*;
use super::*;
use proptest::prelude::*;
use std::path::PathBuf;
use test_bench::recordings::{finite, message};

fn choice() -> Choice {
    Choice {
        velocity: Some("/vel".into()),
        ..Choice::default()
    }
}

fn read_bytes(bytes: &[u8], choice: &Choice) -> Result<Reading, Error> {
    let (_dir, path) = test_bench::recordings::file("in.mcap", bytes);
    read(&path, choice, &|_, _| ())
}

fn complaint(bytes: &[u8], choice: &Choice) -> String {
    let error = read_bytes(bytes, choice).unwrap_err();
    let text = error.to_string();
    if text.starts_with("--") {
        text
    } else {
        message(&error)
    }
}

#[test]
fn every_compression_gives_the_same_samples_and_fixes() {
    let all = ["", "lz4", "zstd"];
    for compressions in [&all[..1], &all[1..2], &all[2..], &all] {
        let read = read_bytes(&bag(compressions), &choice()).unwrap();
        assert!(read.notes.is_empty(), "{:?}", read.notes);
        let r = read.record;
        assert_eq!((r.time.len(), r.rate_hz, r.kind), (301, 100, Kind::Rate));
        assert_eq!((r.time[0], r.time[300]), (0.0, 3.0));
        assert_eq!(r.samples[20].dtheta.x, 0.02);
        assert_eq!(r.samples[20].dv.z, 9.8);
        assert_eq!(r.fixes.len(), 3); // one has no fix
        let f = &r.fixes[1];
        assert_eq!(
            (f.time, f.lat_deg, f.lon_deg, f.height_m),
            (2.0, 47.002, 8.0, 400.0)
        );
        // east, north, up become north, east, down
        assert_eq!(f.measured_velocity(), Some([2.0, 1.0, -3.0]));
        assert_eq!(f.sigmas, [1.0, 2.0, 3.0, 0.05, 0.05, 0.05]);
    }
    let without = read_bytes(&bag(&[""]), &Choice::default()).unwrap();
    assert_eq!(without.record.fixes[1].measured_velocity(), None);
    assert!(
        without.notes[0].contains("--velocity-topic names a topic"),
        "{:?}",
        without.notes
    );
}

/// Messages outside of chunks, too.
fn loose(channels: &[u8], messages: &[Vec<u8>]) -> Vec<u8> {
    file_of(&[channels, &messages.concat()].concat())
}

#[test]
fn without_stamps_the_recorders_time_counts() {
    let read = read_bytes(&loose(&channels(), &messages(false)), &choice()).unwrap();
    assert_eq!(read.record.time[300], 3.0);
    assert!(
        read.notes[0].contains("all stamps of /imu/data are zero"),
        "{:?}",
        read.notes
    );
    let asked = Choice {
        bag_time: true,
        ..choice()
    };
    let read = read_bytes(&bag(&[""]), &asked).unwrap();
    assert_eq!((read.record.fixes[0].time, read.notes.len()), (0.0, 0));
}

#[test]
fn a_cut_bag_is_read_up_to_the_cut() {
    for compressions in [["", ""], ["lz4", "lz4"], ["zstd", "zstd"]] {
        let whole = bag(&compressions);
        let half = whole.len() * 6 / 10;
        let read = read_bytes(&whole[..half], &choice()).unwrap();
        assert!(
            (151..301).contains(&read.record.time.len()),
            "{compressions:?}: {}",
            read.record.time.len()
        );
        assert!(
            read.notes[0].contains("ends without the mark of its end"),
            "{:?}",
            read.notes
        );
    }
    // only the index is missing
    let whole = loose(&channels(), &messages(true));
    let read = read_bytes(&whole[..whole.len() - 60], &choice()).unwrap();
    assert_eq!(read.record.time.len(), 301);
    assert_eq!(read.notes.len(), 1, "{:?}", read.notes);
}

#[test]
fn split_bags_are_read_in_order() {
    let dir = tempfile::tempdir().unwrap();
    let all = messages(true);
    let (a, b) = all.split_at(150);
    std::fs::write(dir.path().join("b_0.mcap"), loose(&channels(), a)).unwrap();
    // the second file is packed as a whole
    let level = ruzstd::encoding::CompressionLevel::Fastest;
    let second = loose(&channels(), b);
    let packed = ruzstd::encoding::compress_to_vec(&second[..], level);
    std::fs::write(dir.path().join("b_1.mcap.zstd"), packed).unwrap();
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - b_0.mcap\n    - b_1.mcap.zstd\n";
    std::fs::write(dir.path().join("metadata.yaml"), metadata).unwrap();
    let read = read(dir.path(), &choice(), &|_, _| ()).unwrap();
    assert_eq!((read.record.time.len(), read.record.fixes.len()), (301, 3));
}

#[test]
fn every_fault_of_the_container_is_named() {
    let intact = bag(&[""]);
    let at = intact
        .windows(8)
        .position(|w| w == 9.8_f64.to_le_bytes())
        .unwrap();
    let mut changed = intact.clone();
    changed[at] ^= 1;
    let of = |chunk: Vec<u8>| file_of(&chunk);
    for (bytes, part) in [
        (vec![], "byte 0' is no MCAP file of version 0"),
        (
            b"not a bag at all".to_vec(),
            "byte 8' is no MCAP file of version 0",
        ),
        (
            changed,
            "holds a chunk with a wrong check sum; remedy: run 'mcap recover",
        ),
        (
            of(chunk(&channels(), "bz2")),
            "holds a chunk compressed with 'bz2'; remedy: run 'mcap compress",
        ),
        (of(record(0, &[])), "holds zeros where a record must begin"),
        (of(record(5, &[0; 21])), "holds a message that is too short"),
        (
            of(chunk(&[5, 0xFF, 0xFF, 0, 0, 0, 0, 0, 0, 0], "")),
            "holds a record that is longer than its chunk",
        ),
        (of(record(3, &[1, 0, 9, 0])), "cannot be unpacked"),
    ] {
        let why = complaint(&bytes, &choice());
        assert!(why.starts_with("in.mcap: 'MCAP, byte"), "{why}");
        assert!(why.contains(part), "no '{part}' in {why}");
    }
}

#[test]
fn every_choice_of_topics_is_checked() {
    let two = [
        &channels()[..],
        &channel(5, "/imu/raw", "sensor_msgs/msg/Imu", "cdr"),
    ]
    .concat();
    let mut all = messages(true);
    all.push(log(5, 0, &imu(START, [0.0; 3], [0.0; 3])));
    let two = loose(&two, &all);
    let named = |imu: &str| Choice {
        imu: Some(imu.into()),
        ..Choice::default()
    };
    let ros1 = channel(1, "/imu", "sensor_msgs/Imu", "ros1");
    let camera = channel(4, "/camera", "sensor_msgs/msg/Image", "cdr");
    for (bytes, choice, part) in [
        (
            &two,
            Choice::default(),
            "in.mcap: '--imu-topic' is needed, the bag has several",
        ),
        (
            &two,
            Choice::default(),
            "one of /imu/data (301 messages), /imu/raw (1 message)",
        ),
        (&two, named("/imu/rew"), "'/imu/rew' is not in"),
        (
            &two,
            named("/imu/rew"),
            "type sensor_msgs/msg/Imu: /imu/data",
        ),
        (
            &two,
            named("/fix"),
            "'/fix' has messages of type sensor_msgs/msg/NavSatFix",
        ),
        (&loose(&ros1, &[]), Choice::default(), "is a bag of ROS 1"),
        (
            &loose(&camera, &[]),
            Choice::default(),
            "'sensor_msgs/msg/Imu' is not among the messages",
        ),
        (
            &loose(&camera, &[]),
            Choice::default(),
            "the bag has /camera (sensor_msgs/msg/Image)",
        ),
    ] {
        let why = complaint(bytes, &choice);
        assert!(why.contains(part), "no '{part}' in {why}");
    }
    let read = read_bytes(&two, &named("/imu/data")).unwrap();
    assert_eq!(read.record.time.len(), 301);
}

/// Before the first fix drivers send a status of -1, nan, or zeros.
#[test]
fn messages_without_a_fix_are_left_out_and_counted() {
    let mut all = messages(true);
    all[1] = log(2, 0, &fix(START, 0, f64::NAN));
    let read = read_bytes(&loose(&channels(), &all), &Choice::default()).unwrap();
    let notes = read.record.notes.join(" ");
    for part in [
        "latitude and longitude are 0 or nan",
        "their status is -1 (STATUS_NO_FIX)",
    ] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
    assert!(read.record.fixes.iter().all(|fix| fix.lat_deg.is_finite()));
}

/// A driver that loses its sensor sends nan: the sample is missing, and counted.
#[test]
fn samples_that_are_nan_are_missing() {
    let mut all = messages(true);
    all[23] = log(
        1,
        0,
        &imu(
            START - 7_000_000 + 20 * STEP,
            [f64::NAN, 0.0, 0.0],
            [0.0; 3],
        ),
    );
    let read = read_bytes(&loose(&channels(), &all), &Choice::default()).unwrap();
    assert_eq!(read.record.time.len(), 300);
    let notes = read.record.notes.join(" ");
    assert!(
        notes.contains("1 sample is not finite (nan) and counts as missing"),
        "{notes}"
    );
}

#[test]
fn every_bad_message_is_named() {
    let with = |k: usize, bytes: Vec<u8>| {
        let mut all = messages(true);
        all[k] = bytes;
        loose(&channels(), &all)
    };
    let at = |k: i64| START - 7_000_000 + k * STEP;
    let one = |gyro: f64| log(1, 0, &imu(at(20), [gyro, 0.0, 0.0], [0.0; 3]));
    let mut none = imu(at(20), [0.0; 3], [0.0; 3]);
    none[4 + 16 + 8 * 16..][..8].copy_from_slice(&(-1.0_f64).to_le_bytes());
    // three other messages stand before sample 20, number 21
    for (bytes, part) in [
        (
            one(36.0),
            "'/imu/data message 21' has 36.0 rad/s and 0.0 m/s2",
        ),
        (
            log(1, 0, &imu(at(19), [0.0; 3], [0.0; 3])),
            "'/imu/data message 21' has the time 1700000000.183000000 s after 1700000000.183000000 s",
        ),
        (
            log(1, 0, &[0, 1, 0, 0, 1]),
            "'/imu/data message 21' is cut short after 5 bytes",
        ),
        (
            log(1, 0, &[0x28, 0xB5, 0x2F, 0xFD]),
            "'/imu/data message 21' has the CDR encapsulation 28b5",
        ),
        (
            log(1, 0, &none),
            "'/imu/data message 21' says by a covariance of -1",
        ),
    ] {
        let why = complaint(&with(23, bytes), &choice());
        assert!(why.contains(part), "no '{part}' in {why}");
    }
    for (bytes, part) in [
        (
            log(2, 0, &fix(at(0), 0, 97.0)),
            "'/fix message 1' has the position 97, 8, 400",
        ),
        (
            log(2, 0, &fix(at(250), 0, 47.0)),
            "'/fix message 3' has the time",
        ),
        (log(3, 0, &[0]), "'/vel message 1' has 1 bytes"),
    ] {
        let why = complaint(&with(1, bytes), &choice());
        assert!(why.contains(part), "no '{part}' in {why}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever happens to a file, it is read or refused, and what is read is finite.
    #[test]
    fn damage_never_panics(
        compression in prop::sample::select(vec!["", "lz4", "zstd"]),
        hits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut bytes = bag(&[compression]);
        // the camera's bytes do not matter
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        let length = cut.index(2 * bytes.len()).min(bytes.len());
        let dir = tempfile::tempdir().unwrap();
        let path: PathBuf = dir.path().join("in.mcap");
        std::fs::write(&path, &bytes[..length]).unwrap();
        match read(&path, &choice(), &|_, _| ()) {
            Ok(reading) => {
                prop_assert!(reading.record.time.is_sorted());
                prop_assert!(finite(&reading.record.samples));
            }
            Err(error) => prop_assert!(error.to_string().contains("; remedy: ")),
        }
    }
}
