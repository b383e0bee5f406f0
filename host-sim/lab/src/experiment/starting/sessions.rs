//! Sessions of real units, where they are on this machine: how each starts.

use super::*;
use host_io::recordings::generic;
use host_unit::around::Kind;
use std::path::PathBuf;
use test_bench::recordings::data_dir;

/// The sessions of a folder, in the order of their names.
fn sessions(of: &str) -> Vec<PathBuf> {
    let Some(dir) = data_dir().map(|dir| dir.join("sessions").join(of)) else {
        return Vec::new();
    };
    let Ok(entries) = std::fs::read_dir(dir) else {
        return Vec::new();
    };
    let headers = entries.map(|entry| entry.unwrap().path().join("header.toml"));
    let mut all: Vec<PathBuf> = headers.filter(|header| header.is_file()).collect();
    all.sort();
    all
}

/// How a session starts if configured with this kind of vehicle and this gyro bias, deg/s.
fn found(header: &Path, vehicle: Kind, gyro_dps: f64) -> (f64, Result<Aligned, Progress>) {
    let file = data_dir().unwrap().join("sessions/dot.toml");
    let unit = Unit::load(file.to_str().unwrap()).unwrap();
    let mut assumptions = Assumptions::of(&unit);
    assumptions.prior.gyro_bias = gyro_dps * DEG;
    let record = generic::read(header, &[]).unwrap();
    let prepared = record.prepare().unwrap();
    let known = VehicleKnowledge {
        vehicle,
        forward: true,
        heading: None,
    };
    let session = prepared.session;
    let all = 0..session.epochs();
    (
        prepared.begin,
        in_motion::align(&session, &all, known, &assumptions),
    )
}

/// The gyros' biases of each set's sensor, deg/s, by long fits elsewhere: about the first two axes.
/// It is the tilt that shows them; about the vertical they are known to half a degree a second
/// only.
const SETS: [(&str, [f64; 2]); 2] = [("morpinet-1", [0.72, -0.39]), ("wid", [-0.99, 0.83])];
/// How far they differ from session to session, deg/s.
const SCATTER: f64 = 0.2;
/// The cars of a set were equipped alike: course less heading of the sensor, deg, and how far it
/// may be off by the slip, the fixes, and four standard deviations of a heading.
const MOUNTED: [(&str, f64); 1] = [("wid", -96.0)];
const OFF: f64 = 25.0;
/// Seconds from the first motion within which more than half of the sessions start, and all that
/// are long enough.
const MOST_S: [f64; 2] = [31.0, 80.0];

/// First motion by the fixes of a header's recording, s.
fn moves(header: &Path) -> f64 {
    let record = generic::read(header, &[]).unwrap();
    let first = record.fixes[0].position();
    let away = |fix: &&host_io::recordings::record::TimedFix| {
        fix.position().ned_from(&first).xy().norm() > 1.5
    };
    record.fixes.iter().find(away).map_or(0.0, |fix| fix.time)
}

/// Positions alone, mounting unknown, gyros of a degree a second, configured as they are or five
/// times worse: most sessions start within half a minute of driving, all that drive for 80 s do,
/// the biases are those of the unit, and the headings those of the cars.
#[test]
fn real_sessions_start_in_motion() {
    let (mut soon, mut all) = (0, 0);
    for (set, expected) in SETS {
        let headers = sessions(set);
        if headers.is_empty() {
            println!("skipped: no sessions/{set} in ../shared/data or LRNN_DATA");
        }
        for header in headers {
            let drives = moves(&header);
            for dps in [2.0, 0.2] {
                let name = header.parent().unwrap().file_name().unwrap();
                let (begin, found) = found(&header, Kind::Land, dps);
                print!("{set} {} Land {dps} deg/s: ", name.to_string_lossy());
                all += 1;
                let found = match found {
                    Ok(found) => found,
                    Err(progress) => {
                        println!("{progress:?}");
                        let short = header_s(&header) < drives + MOST_S[1];
                        assert!(short && progress.refused == 0, "{name:?}: {progress:?}");
                        continue;
                    }
                };
                let after = begin + found.epoch as f64 - drives;
                let (roll, pitch, heading) = to_euler(&found.start.nav.q_bn);
                println!(
                    "t {} after {after:.1} roll {:.2} pitch {:.2} heading {:.2} sigma {:.2} {:.2} \
                     bias {:.2?} residual {:.2} refused {}",
                    begin + found.epoch as f64,
                    roll / DEG,
                    pitch / DEG,
                    heading / DEG,
                    found.start.sigma.tilt / DEG,
                    found.start.sigma.heading / DEG,
                    found.bias.map(|bias| bias / DEG),
                    found.residual,
                    found.refused
                );
                soon += usize::from(after <= MOST_S[0]);
                for (bias, expected) in found.bias.iter().zip(expected) {
                    let off = (bias / DEG - expected).abs();
                    assert!(off < SCATTER, "{name:?}: {:?}", found.bias);
                }
                assert!(found.residual < 2.0, "{name:?}: {found:?}");
                let mounted = MOUNTED.iter().find(|(of, _)| *of == set);
                if let Some((_, expected)) = mounted {
                    let course = course(&header, begin + found.epoch as f64);
                    let off = course - heading / DEG - expected;
                    let off = off - 360.0 * (off / 360.0).round();
                    assert!(off.abs() < OFF, "{name:?}: {off} deg, {found:?}");
                }
            }
        }
    }
    println!("{soon} of {all} within {} s of driving", MOST_S[0]);
    assert!(2 * soon >= all, "{soon} of {all}");
}

/// Course by the fixes of a header's recording around a time, deg.
fn course(header: &Path, at: f64) -> f64 {
    let fixes = generic::read(header, &[]).unwrap().fixes;
    let after = fixes.iter().position(|fix| fix.time > at + 0.5).unwrap();
    let before = fixes.iter().rposition(|fix| fix.time < at - 0.5).unwrap();
    let way = fixes[after].position().ned_from(&fixes[before].position());
    way.y.atan2(way.x) / DEG
}

/// Length of a recording, s.
fn header_s(header: &Path) -> f64 {
    let record = generic::read(header, &[]).unwrap();
    record.fixes.last().map_or(0.0, |fix| fix.time)
}
