//! Writes bags for tests, by the specifications of MCAP and CDR.

use super::container;
use std::io::Write;

/// A record: operation code, length, content.
pub(super) fn record(operation: u8, content: &[u8]) -> Vec<u8> {
    let length = (content.len() as u64).to_le_bytes();
    [&[operation], &length[..], content].concat()
}

pub(super) fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// A schema and a channel with the same number.
pub(super) fn channel(id: u16, topic: &str, schema: &str, encoding: &str) -> Vec<u8> {
    let id = id.to_le_bytes();
    let schema = [
        &id[..],
        &string(schema),
        &string("ros2msg"),
        &string("float64 x"),
    ]
    .concat();
    let channel = [&id[..], &id, &string(topic), &string(encoding), &[0; 4]].concat();
    [record(3, &schema), record(4, &channel)].concat()
}

pub(super) fn log(channel: u16, log_time: u64, cdr: &[u8]) -> Vec<u8> {
    let head = [
        &channel.to_le_bytes()[..],
        &[0; 4],
        &log_time.to_le_bytes(),
        &[0; 8],
    ]
    .concat();
    record(5, &[&head, cdr].concat())
}

pub(super) fn chunk(records: &[u8], compression: &str) -> Vec<u8> {
    let packed = match compression {
        "lz4" => {
            let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
            encoder.write_all(records).unwrap();
            encoder.finish().unwrap()
        }
        "zstd" => {
            let level = ruzstd::encoding::CompressionLevel::Fastest;
            ruzstd::encoding::compress_to_vec(records, level)
        }
        _ => records.to_vec(),
    };
    let mut sum = flate2::Crc::new();
    sum.update(records);
    let head = [
        &[0; 16],
        &(records.len() as u64).to_le_bytes()[..],
        &sum.sum().to_le_bytes(),
        &string(compression),
        &(packed.len() as u64).to_le_bytes(),
    ];
    record(6, &[&head.concat(), &packed[..]].concat())
}

pub(super) fn file_of(records: &[u8]) -> Vec<u8> {
    let start = record(1, &[string("ros2"), string("test")].concat());
    let end = [record(15, &[0; 4]), record(2, &[0; 20])].concat();
    [
        &container::MAGIC[..],
        &start,
        records,
        &end,
        &container::MAGIC,
    ]
    .concat()
}

/// CDR of numbers after a header with an empty frame; the numbers begin after `head`.
pub(super) fn cdr(ns: i64, head: &[u8], numbers: &[f64], tail: &[u8]) -> Vec<u8> {
    let second = (ns / 1_000_000_000) as i32;
    let rest = (ns % 1_000_000_000) as u32;
    let mut out = vec![0, 1, 0, 0];
    out.extend(second.to_le_bytes());
    out.extend(rest.to_le_bytes());
    out.extend([1, 0, 0, 0, 0]); // a string of one zero byte
    out.extend(head);
    out.resize(4 + (out.len() - 4).next_multiple_of(8), 0);
    out.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    out.extend(tail);
    out
}

pub(super) fn imu(ns: i64, gyro: [f64; 3], accel: [f64; 3]) -> Vec<u8> {
    let none = [0.0; 9];
    let numbers = [&[0.0; 13][..], &gyro, &none, &accel, &none].concat();
    cdr(ns, &[], &numbers, &[])
}

pub(super) fn fix(ns: i64, status: i8, lat: f64) -> Vec<u8> {
    let covariance = [4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 9.0];
    let numbers = [&[lat, 8.0, 400.0][..], &covariance].concat();
    // an odd offset, so the satellite systems are aligned
    cdr(ns, &[status as u8, 1, 0], &numbers, &[2])
}

pub(super) fn twist(ns: i64, velocity: [f64; 3]) -> Vec<u8> {
    cdr(ns, &[], &[&velocity[..], &[0.0; 3]].concat(), &[])
}

pub(super) const START: i64 = 1_700_000_000_000_000_000;
pub(super) const STEP: i64 = 10_000_000;

/// Three seconds: an IMU at 100 Hz, fixes at 1 Hz, velocities, and a camera.
pub(super) fn messages(stamped: bool) -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for k in 0..=300_i64 {
        let ns = START + k * STEP;
        let stamp = if stamped { ns - 7_000_000 } else { 0 };
        let rate = 1e-3 * k as f64;
        all.push(log(
            1,
            ns as u64,
            &imu(stamp, [rate, 2e-3, 3e-3], [0.5, 0.25, 9.8]),
        ));
        if k % 100 == 0 {
            let status = if k == 100 { -1 } else { 0 };
            all.push(log(
                2,
                ns as u64,
                &fix(stamp, status, 47.0 + 1e-5 * k as f64),
            ));
            all.push(log(3, ns as u64, &twist(stamp + 500_000, [1.0, 2.0, 3.0])));
            all.push(log(4, ns as u64, &[0xEE; 5000]));
        }
    }
    all
}

pub(super) fn channels() -> Vec<u8> {
    [
        channel(1, "/imu/data", "sensor_msgs/msg/Imu", "cdr"),
        channel(2, "/fix", "sensor_msgs/msg/NavSatFix", "cdr"),
        channel(3, "/vel", "geometry_msgs/msg/TwistStamped", "cdr"),
        channel(4, "/camera", "sensor_msgs/msg/Image", "cdr"),
    ]
    .concat()
}

/// A bag in chunks with these compressions, the messages divided among them.
pub(super) fn bag(compressions: &[&str]) -> Vec<u8> {
    let all = messages(true);
    let parts = all.chunks(all.len().div_ceil(compressions.len()));
    let chunks = parts
        .zip(compressions)
        .enumerate()
        .map(|(k, (part, compression))| {
            let channels = if k == 0 { channels() } else { Vec::new() };
            chunk(&[channels, part.concat()].concat(), compression)
        });
    file_of(&chunks.collect::<Vec<_>>().concat())
}
