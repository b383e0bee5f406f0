//! Logs of receivers as `--fixes`: what is read of each kind, and that a device at the same bytes
//! has the same fixes. The logs are in `fixtures/receiver`; `writers.rs` makes them, and with
//! `LRNN_WRITE_FIXTURES` set writes them again.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

mod writers;

use assert_cmd::Command;
use firmware::wire::Receiver;
use firmware::wire::receiver::ReceiverFormat::{self, Nmea, Novatel, Sbf, Ubx};
use firmware::wire::receiver::epoch::Arrival;
use host_io::recordings::receiver;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use writers::*;

/// A log, the protocol that is given, and what is read.
struct Case {
    name: &'static str,
    given: Option<ReceiverFormat>,
    bytes: Vec<u8>,
    /// Protocol, and how many values of a fix it gives.
    want: Result<(ReceiverFormat, usize), &'static str>,
    /// What is reported besides.
    note: &'static str,
}

fn case(
    name: &'static str,
    bytes: Vec<u8>,
    want: Result<(ReceiverFormat, usize), &'static str>,
) -> Case {
    Case {
        name,
        given: None,
        bytes,
        want,
        note: "",
    }
}

fn text(end: &'static str) -> impl Fn(u32) -> Vec<u8> {
    move |n| lines(&nmea(n, "GN", &["GGA", "RMC", "GST"]), end)
}

/// Sentences of these kinds alone.
fn alone(kinds: &'static [&'static str]) -> impl Fn(u32) -> Vec<u8> {
    move |n| lines(&nmea(n, "GN", kinds), "\r\n")
}

/// An old receiver without a fix, whose VTG says that it stands.
fn without_a_fix(n: u32) -> Vec<u8> {
    let time = nmea(n, "GP", &["GGA"])[0][7..16].to_owned();
    let texts = [
        format!("GPGGA,{time},,,,,0,00,99.99,,,,,,"),
        format!("GPRMC,{time},V,,,,,0.0,0.0,271126,,"),
        "GPVTG,0.0,T,,M,0.0,N,0.0,K".to_owned(),
    ];
    lines(&texts.map(|text| sentence(&text)), "\r\n")
}

/// Each line changed.
fn changed(change: impl Fn(&str) -> String) -> Vec<u8> {
    log(|n| {
        let sentences = nmea(n, "GN", &["GGA", "RMC"]);
        let all: Vec<String> = sentences.iter().map(|line| change(line)).collect();
        lines(&all, "\r\n")
    })
}

fn binary() -> Vec<Case> {
    let usual = log(|n| [pvt(n, 92), long(0x35, 400, n), long(0x43, 656, n)].concat());
    let mixed = log(|n| [pvt(n, 92), lines(&nmea(n, "GN", &["RMC", "GGA"]), "\r\n")].concat());
    let text_too = "NMEA is in the log, too, with 20 fixes; --fixes-protocol nmea takes these";
    let blocks = log(|n| {
        [
            pvt_block(n, true),
            long_block(4027, 900, n),
            long_block(4013, 1300, n),
        ]
        .concat()
    });
    vec![
        case("ubx-long.ubx", usual, Ok((Ubx, 6))),
        Case {
            note: text_too,
            ..case("ubx-nmea.ubx", mixed.clone(), Ok((Ubx, 6)))
        },
        Case {
            given: Some(Nmea),
            ..case("ubx-nmea.ubx", mixed, Ok((Nmea, 5)))
        },
        case("ubx-7.ubx", log(|n| pvt(n, 84)), Ok((Ubx, 6))),
        case(
            "ubx-posllh-velned.ubx",
            log(|n| [posllh(n), status(n), velned(n)].concat()),
            Ok((Ubx, 6)),
        ),
        case("ubx-ecef.ubx", log(ecef), Ok((Ubx, 6))),
        case(
            "ubx-hpposllh.ubx",
            log(|n| [velned(n), hpposllh(n)].concat()),
            Ok((Ubx, 6)),
        ),
        case(
            "ubx-raw.ubx",
            log(|n| [ubx(0x35, &[n as u8; 8]), ubx(0x61, &[0; 4])].concat()),
            Err("UBX: 20 NAV-EOE, 20 NAV-SAT, wanted NAV-PVT, or NAV-POSLLH and NAV-VELNED"),
        ),
        case("sbf-long.sbf", blocks, Ok((Sbf, 6))),
        case(
            "sbf-cartesian.sbf",
            log(|n| pvt_block(n, false)),
            Ok((Sbf, 6)),
        ),
        case(
            "sbf-time.sbf",
            log(|n| sbf(5914, &[n as u8; 16])),
            Err("SBF: 20 ReceiverTime, wanted PVTGeodetic or PVTCartesian"),
        ),
        case(
            "novatel-text.gps",
            log(|n| novatel(n, "BEST")),
            Ok((Novatel, 6)),
        ),
        case(
            "novatel-psr.gps",
            log(|n| novatel(n, "PSR")),
            Ok((Novatel, 6)),
        ),
        case("novatel-bestxyz.gps", log(bestxyz), Ok((Novatel, 6))),
        case(
            "novatel-bestxyz-text.gps",
            log(bestxyz_in_text),
            Err("NovAtel: 20 BESTXYZA in text of more bytes than a device holds"),
        ),
        case(
            "novatel-abbreviated.gps",
            log(abbreviated),
            Err("NovAtel: 20 BESTPOS, 20 BESTVEL in abbreviated text, without a checksum"),
        ),
    ]
}

fn sentences() -> Vec<Case> {
    let bare = changed(|line| line.split('*').next().unwrap().to_owned());
    let gga = alone(&["GGA"]);
    let late = log(|n| match n {
        9 => [gga(n), lines(&nmea(n, "GN", &["ZDA"]), "\r\n")].concat(),
        _ => gga(n),
    });
    vec![
        case("nmea-lf.nmea", log(text("\n")), Ok((Nmea, 5))),
        case("nmea-cr.nmea", log(text("\r")), Ok((Nmea, 5))),
        case("nmea-crcrlf.nmea", log(text("\r\r\n")), Ok((Nmea, 5))),
        case(
            "nmea-blank-lines.nmea",
            log(text("\r\n\r\n")),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-tag-blocks.nmea",
            changed(|line| format!("\\s:gps0,c:1795780800*5A\\{line}")),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-logger.nmea",
            changed(|line| format!("2026-11-27T12:00:00.123Z {line}")),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-cells.nmea",
            changed(|line| format!("12:00:00.123,gps,\"{line}\"")),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-old-vtg.nmea",
            log(without_a_fix),
            Err("NMEA: 20 GGA, 20 RMC, 20 VTG, none with a fix"),
        ),
        case(
            "nmea-small-letters.nmea",
            changed(|line| {
                let (text, sum) = line.split_once('*').unwrap();
                format!("{text}*{}", sum.to_lowercase())
            }),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-gq.nmea",
            log(|n| lines(&nmea(n, "GQ", &["GGA", "RMC"]), "\r\n")),
            Ok((Nmea, 5)),
        ),
        case(
            "nmea-no-checksum.nmea",
            bare.clone(),
            Err("NMEA: 20 GGA, 20 RMC without a checksum; remedy: give --fixes-protocol nmea"),
        ),
        Case {
            given: Some(Nmea),
            ..case("nmea-no-checksum.nmea", bare, Ok((Nmea, 5)))
        },
        case("nmea-rmc.nmea", log(alone(&["RMC"])), Ok((Nmea, 4))),
        Case {
            note: "no date is in the log",
            ..case(
                "nmea-gll-vtg.nmea",
                log(alone(&["GLL", "VTG"])),
                Ok((Nmea, 4)),
            )
        },
        case("nmea-late-date.nmea", late, Ok((Nmea, 3))),
        Case {
            note: "no date is in the log",
            ..case("nmea-no-date.nmea", log(gga), Ok((Nmea, 3)))
        },
    ]
}

/// The path of a fixture, which is as its writer makes it.
fn fixture(case: &Case) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/receiver");
    let path = folder.join(case.name);
    if std::env::var_os("LRNN_WRITE_FIXTURES").is_some() {
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&path, &case.bytes).unwrap();
    }
    assert!(
        std::fs::read(&path).unwrap() == case.bytes,
        "{} is another one",
        case.name
    );
    path
}

/// The command line on a recording of 25 s around the fixes: what it prints.
fn printed(dir: &Path, out: &str, case: &Case, path: &Path) -> String {
    let log = path.to_str().unwrap();
    let mut command = Command::new(system::host_sim_binary());
    command.current_dir(dir);
    command.args(["convert", "csv", "--header", "header.toml", "--to", "csv"]);
    command.args(["--out", out, "--fixes", log]);
    if let Some(given) = case.given {
        command.args(["--fixes-protocol", &receiver::name(given).to_lowercase()]);
    }
    let out = command.output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(!text.contains("panicked"), "{}: {text}", case.name);
    text
}

fn recording(dir: &Path) {
    let mut imu = String::from("t,gx,gy,gz,ax,ay,az\n");
    for k in 0..500 {
        let time = f64::from(START) - 2.5 + 0.05 * f64::from(k);
        imu += &format!("{time:.3},0,0,0,0,0,-9.81\n");
    }
    std::fs::write(dir.join("imu.csv"), imu).unwrap();
    let header = r#"[imu]
file = "imu.csv"
time = { column = "t", unit = "s" }
gyro = { columns = ["gx", "gy", "gz"], unit = "rad/s" }
accel = { columns = ["ax", "ay", "az"], unit = "m/s^2" }
axes = "x y z"
"#;
    std::fs::write(dir.join("header.toml"), header).unwrap();
}

/// The fixes that a device has at these bytes at 115 200 bit/s: an epoch a second, in pieces of the
/// device's length. Time of the week, position, velocity.
fn on_device(case: &Case) -> Vec<(u32, [f64; 6])> {
    let mut receiver = Receiver::new(case.given);
    let mut fixes = Vec::new();
    let mut take = |receiver: &mut Receiver| {
        while let Some(solution) = receiver.next_fix() {
            let Some(fix) = solution.fix else { continue };
            let at = fix.position;
            let [n, e, d] = fix.velocity;
            let place = [
                at.latitude.to_degrees(),
                at.longitude.to_degrees(),
                at.height,
            ];
            fixes.push((fix.time_ms, [place[0], place[1], place[2], n, e, d]));
        }
    };
    // every epoch has as many bytes, but where a date comes once
    let (epoch, rest) = (
        case.bytes.len() / EPOCHS as usize,
        case.bytes.len() % EPOCHS as usize,
    );
    let length = if rest == 0 { epoch } else { case.bytes.len() };
    for (second, epoch) in (1..).zip(case.bytes.chunks(length)) {
        for (piece, bytes) in (0..).zip(epoch.chunks(64)) {
            let us = 1_000_000 * second + 64 * 87 * piece;
            if receiver.is_due(us) {
                let us = us - 200_000; // the application looks every 10 ms
                receiver.push(&[], Arrival { us, sample: 0 });
                take(&mut receiver);
            }
            receiver.push(bytes, Arrival { us, sample: 0 });
            take(&mut receiver);
        }
    }
    receiver.push(
        &[],
        Arrival {
            us: u64::MAX / 2,
            sample: 0,
        },
    );
    take(&mut receiver);
    fixes
}

const HEADING: &str = "| log | what is reported |\n|---|---|\n";

/// Every kind of log is read or named, and the table of fixtures/tried.md is what is reported.
#[test]
fn every_kind_of_log_is_read_or_named() {
    let mut table = HEADING.to_owned();
    let dir = tempfile::tempdir().unwrap();
    recording(dir.path());
    for (k, case) in binary().into_iter().chain(sentences()).enumerate() {
        let path = fixture(&case);
        let text = printed(dir.path(), &format!("out{k}"), &case, &path);
        let name = case.name;
        let option = case.given.map_or(String::new(), |given| {
            format!(
                " (`--fixes-protocol {}`)",
                receiver::name(given).to_lowercase()
            )
        });
        let printed = text.trim_end().replace("host-sim: ", "");
        let printed = printed.replace(&format!("{}/", path.parent().unwrap().display()), "");
        let printed = printed.replace('\n', "`; `").replace('|', "\\|");
        writeln!(table, "| `{name}`{option} | `{printed}` |").unwrap();
        let (format, values) = match case.want {
            Err(why) => {
                assert!(text.contains(why), "{name}: {text}");
                continue;
            }
            Ok(want) => want,
        };
        let from = f64::from(START);
        let to = from + f64::from(EPOCHS - 1);
        let protocol = receiver::name(format);
        let count =
            format!("20 fixes ({protocol}) from {from:.3} to {to:.3} s on the IMU's clock\n");
        assert!(
            text.contains(&count) && text.contains(case.note),
            "{name}: {text}"
        );
        let log = receiver::read(&path, case.given, &|_, _| ()).unwrap();
        for (k, fix) in (0..).zip(&log.fixes) {
            let place = [fix.lat_deg - PLACE[0], fix.lon_deg - longitude(k)];
            assert!(
                place.iter().all(|deg| deg.abs() < 2e-7),
                "{name} {k} {place:?}"
            );
            let height = !fix.has(2..3) || (fix.height_m - PLACE[2]).abs() < 0.02;
            assert!(height, "{name} {k}");
            assert_eq!(
                (0..6).filter(|at| fix.has(*at..at + 1)).count(),
                values,
                "{name}"
            );
            let [n, e, _] = fix.velocity;
            let moves = n.hypot(e - EAST_MPS) < 0.01;
            assert!(moves || values == 3, "{name} {:?}", fix.velocity);
        }
    }
    system::compare_table(HEADING, &table);
}

/// Of two protocols the device may have the first epoch of the other one, too.
#[test]
fn a_device_has_the_same_fixes() {
    for case in binary().into_iter().chain(sentences()) {
        let path = fixture(&case);
        let log = receiver::read(&path, case.given, &|_, _| ());
        let desktop = log.map_or(Vec::new(), |log| {
            let shift = if log.format == Nmea { 18.0 } else { 0.0 };
            let fix = |fix: &host_io::recordings::record::TimedFix| {
                let [n, e, d] = fix.velocity;
                let ms = ((fix.time - shift) * 1e3).round() as u32;
                (ms, [fix.lat_deg, fix.lon_deg, fix.height_m, n, e, d])
            };
            log.fixes.iter().map(fix).collect()
        });
        let mut device = on_device(&case);
        assert_eq!(device.len(), desktop.len(), "{}", case.name);
        // before its date has come the device has the time of the day, on a Sunday
        let sunday = |ms: u32| ms % 86_400_000;
        for ((ms, _), (want, _)) in device.iter_mut().zip(&desktop) {
            assert!(
                *ms == *want || *ms == sunday(*want),
                "{} {ms} {want}",
                case.name
            );
            *ms = *want;
        }
        for ((_, on_device), (_, on_desktop)) in device.iter().zip(&desktop) {
            let near = on_device
                .iter()
                .zip(on_desktop)
                .all(|(a, b)| (a - b).abs() < 1e-9);
            assert!(near, "{}: {on_device:?} {on_desktop:?}", case.name);
        }
    }
}
