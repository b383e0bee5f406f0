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

/// How a session starts, told this kind of vehicle and gyros of this bias by the datasheet, deg/s.
fn found(header: &Path, vehicle: Kind, gyro_dps: f64) -> (f64, Result<Aligned, Progress>) {
    let file = data_dir().unwrap().join("sessions/dot.toml");
    let unit = Unit::load(file.to_str().unwrap()).unwrap();
    let mut assumptions = Assumptions::of(&unit);
    assumptions.prior.gyro_bias = gyro_dps * DEG;
    let record = generic::read(header, &[]).unwrap();
    let prepared = record.prepare().unwrap();
    let known = Known {
        vehicle,
        heading: None,
    };
    let session = prepared.session;
    let all = 0..session.epochs();
    (
        prepared.begin,
        in_motion::align(&session, &all, known, &assumptions),
    )
}

#[test]
fn real_sessions_start_in_motion() {
    for of in ["morpinet-1", "wid"] {
        for header in sessions(of) {
            for (vehicle, dps) in [(Kind::Land, 2.0), (Kind::Air, 2.0), (Kind::Land, 0.2)] {
                let (begin, found) = found(&header, vehicle, dps);
                let name = header.parent().unwrap().file_name().unwrap();
                print!("{of} {name:?} {vehicle:?} {dps} deg/s: ");
                match found {
                    Ok(found) => {
                        let (roll, pitch, heading) = to_euler(&found.start.nav.q_bn);
                        let bias = found.bias.map(|x| x / DEG);
                        println!(
                            "t {} roll {:.2} pitch {:.2} heading {:.2} sigma {:.2} {:.2} bias {:.2} {:.2} {:.2} residual {:.2} refused {}",
                            begin + found.epoch as f64,
                            roll / DEG,
                            pitch / DEG,
                            heading / DEG,
                            found.start.sigma.tilt / DEG,
                            found.start.sigma.heading / DEG,
                            bias[0],
                            bias[1],
                            bias[2],
                            found.residual,
                            found.refused
                        );
                    }
                    Err(progress) => println!("{progress:?}"),
                }
            }
        }
    }
}
