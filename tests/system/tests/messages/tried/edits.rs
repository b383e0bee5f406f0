//! How an input differs from the right one.

use std::io::Write;
use std::path::Path;

/// An input.
#[derive(Clone, Copy)]
pub struct Case {
    /// The input in words, for the page.
    pub input: &'static str,
    /// Makes it from the right files.
    pub make: fn(&Path),
    /// The command.
    pub args: &'static str,
    /// Parts of what is reported.
    pub printed: &'static [&'static str],
    /// A part of the result.
    pub result: &'static str,
}

pub const CONVERT: &str = "convert csv --header header.toml --to csv --out o";
pub const STRICT: &str = "replay csv --header header.toml --unit tactical --strict";
pub const SIMULATED: &str = "replay csv --header header.toml --strict";

/// A simulated drive of a vehicle in place of the right files.
pub fn simulated(dir: &Path, vehicle: &str) {
    let out = format!("simulate --vehicle {vehicle} --out . --force");
    crate::host_sim(dir, &out).success();
}

pub fn read(dir: &Path, name: &str) -> String {
    std::fs::read_to_string(dir.join(name)).unwrap()
}

pub fn write(dir: &Path, name: &str, text: &str) {
    std::fs::write(dir.join(name), text).unwrap();
}

/// Changes a file as a text.
pub fn text(dir: &Path, name: &str, change: impl Fn(&str) -> String) {
    write(dir, name, &change(&read(dir, name)));
}

/// Changes the cells of each line below the names, counted from 0.
pub fn lines(dir: &Path, name: &str, change: impl Fn(usize, &mut Vec<String>)) {
    text(dir, name, |old| {
        let (names, rest) = old.split_once('\n').unwrap();
        let changed = rest.lines().enumerate().map(|(k, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            change(k, &mut cells);
            cells.join(",") + "\n"
        });
        format!("{names}\n{}", changed.collect::<String>())
    });
}

/// Multiplies and adds to cells of gnss.csv: t, lat, lon, h, vn, ve, vd.
pub fn fixes(dir: &Path, columns: &[usize], change: impl Fn(f64) -> f64) {
    lines(dir, "gnss.csv", |_, cells| {
        for column in columns {
            cells[*column] = format!("{:?}", change(cells[*column].parse().unwrap()));
        }
    });
}

/// Multiplies cells of imu.csv.
pub fn scaled(dir: &Path, columns: &[usize], factor: f64) {
    lines(dir, "imu.csv", |_, cells| {
        for column in columns {
            cells[*column] = format!("{:?}", factor * cells[*column].parse::<f64>().unwrap());
        }
    });
}

/// Takes the velocities out of header.toml.
pub fn without_velocities(dir: &Path) {
    text(dir, "header.toml", |old| {
        let rest = old.lines().filter(|line| !line.starts_with("velocity"));
        rest.map(|line| format!("{line}\n")).collect()
    });
}

/// Writes a text in UTF-16, with its mark.
pub fn wide(dir: &Path, name: &str, text: &str) {
    let marked = format!("\u{feff}{text}");
    let bytes: Vec<u8> = marked.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(dir.join(name), bytes).unwrap();
}

/// The fixes as reports of gpsd. Time 0 is the begin of GPS week 2400.
pub fn gpsd(dir: &Path) -> String {
    let report = |line: &str| {
        let c: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let unix = 315_964_800.0 + 2400.0 * 604_800.0 - 18.0 + c[0];
        let [lat, lon, height, n, e, d] = [c[1], c[2], c[3], c[4], c[5], c[6]];
        format!(
            "{{\"class\":\"TPV\",\"mode\":3,\"time\":{unix},\"lat\":{lat},\"lon\":{lon},\
             \"altHAE\":{height},\"velN\":{n},\"velE\":{e},\"velD\":{d}}}\n"
        )
    };
    read(dir, "gnss.csv").lines().skip(1).map(report).collect()
}

pub fn header(dir: &Path, from: &str, to: &str) {
    text(dir, "header.toml", |old| {
        assert!(old.contains(from), "{from}");
        old.replacen(from, to, 1)
    });
}

/// The first 100 s of the samples, which are at rest, with other names and times.
pub fn rest(dir: &Path, names: &str, scale: f64) {
    let mut out = format!("{names}\n");
    for line in read(dir, "imu.csv").lines().skip(1).take(10_000) {
        let (time, values) = line.split_once(',').unwrap();
        out += &format!("{:.3},{values}\n", scale * time.parse::<f64>().unwrap());
    }
    write(dir, "rest.csv", &out);
}

/// Gives one sample of a bag without chunks the stamp of the one before it.
pub fn repeat_a_stamp(bytes: &mut [u8]) {
    // message records: code 5, length u64, channel u16, sequence u32, two times u64, CDR with its
    // 4 bytes of encapsulation, seconds i32 and nanoseconds u32
    let (mut at, mut seen, mut before) = (8, 0, [0; 8]);
    while let Some(head) = bytes.get(at..at + 9) {
        let length = u64::from_le_bytes(head[1..].try_into().unwrap()) as usize;
        let is_sample = head[0] == 5 && bytes[at + 9..at + 11] == [1, 0];
        let stamp = at + 9 + 22 + 4;
        at += 9 + length;
        if !is_sample {
            continue;
        }
        seen += 1;
        match seen {
            100 => before.copy_from_slice(&bytes[stamp..stamp + 8]),
            101 => return bytes[stamp..stamp + 8].copy_from_slice(&before),
            _ => {}
        }
    }
    panic!("the bag has fewer samples");
}

/// Packs a file and keeps this share of it, under the same name.
pub fn gzip(dir: &Path, name: &str, share: f64) {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(read(dir, name).as_bytes()).unwrap();
    let packed = packed.finish().unwrap();
    let kept = (share * packed.len() as f64) as usize;
    std::fs::write(dir.join(name), &packed[..kept]).unwrap();
}

/// A log of PX4 without every fourth sample.
pub fn three_of_four(log: &[u8]) -> Vec<u8> {
    const HEAD: usize = 16;
    let (mut at, mut samples) = (HEAD, 0);
    let mut out = log[..HEAD].to_vec();
    while let Some(&[low, high, kind]) = log.get(at..at + 3) {
        let message = &log[at..at + 3 + usize::from(u16::from_le_bytes([low, high]))];
        at += message.len();
        let is_sample = kind == b'D' && message[3..5] == [0, 0];
        samples += usize::from(is_sample);
        if !is_sample || samples % 4 != 0 {
            out.extend_from_slice(message);
        }
    }
    out
}
