mod documented;
mod refused;

use super::*;
use host_core::inertial::free_inertial::free_inertial;
use host_core::inertial::session::Session;
use host_core::inertial::units::DEG;
use nalgebra::Vector3;
use std::fmt::Write;
use std::path::PathBuf;

const MOVING: &str = r#"
[imu]
file = "imu.csv"
time = { column = "t", unit = "ms" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accel = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "y x -z"

[gnss]
file = "gnss.txt"
separator = "blank"
names = false
time = { column = "1", unit = "s" }
latitude = { column = "2", unit = "deg" }
longitude = { column = "3", unit = "deg" }
height = { column = "4", unit = "m" }
velocity = { columns = ["5", "6", "7"], unit = "m/s", order = "enu" }

[start]
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 90.0
"#;

/// Samples in right-forward-up of a level drive east at 20 m/s; `t` in ms from 1000 s on.
fn imu(n: usize) -> String {
    let mut text = "status,t,gx,gy,gz,ax,ay,az\n".to_owned();
    for k in 0..n {
        writeln!(
            text,
            "ok,{},0,0,0.0023,0,0,{}",
            1_000_000 + 10 * k,
            9.81 / 9.80665
        )
        .unwrap();
    }
    text
}

fn gnss(n: usize) -> String {
    (0..n)
        .map(|k| {
            format!(
                "{:.1}  45.0 {:.9} 80 20 0 0\n",
                1000.5 + k as f64,
                7.0 + 2.537e-4 * k as f64
            )
        })
        .collect()
}

fn load(header: &Path) -> Result<Session, Error> {
    read(header, &[])?.session()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new(header: &str, imu: &str, gnss: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        for (name, text) in [("in.toml", header), ("imu.csv", imu), ("gnss.txt", gnss)] {
            std::fs::write(dir.path().join(name), text).unwrap();
        }
        Self(dir)
    }

    fn header(&self) -> PathBuf {
        self.0.path().join("in.toml")
    }

    fn complaint(&self) -> String {
        let text = load(&self.header())
            .map(|s| s.epochs())
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("; remedy: ") && !text.contains('\n'),
            "{text}"
        );
        text.replace(&format!("{}/", self.0.path().display()), "")
    }
}

#[test]
fn rates_with_fixes_become_a_session_that_navigates() {
    let folder = Folder::new(MOVING, &imu(601), &gnss(6));
    let s = load(&folder.header()).unwrap();
    assert_eq!(
        (s.epochs(), s.counts.len(), s.standstill, s.dt),
        (5, 500, 0, 0.01)
    );
    let fix = |k: usize| s.fixes[k].unwrap();
    assert_eq!(fix(1).sigmas, [1.0, 1.0, 1.5, 0.05, 0.05, 0.05]);
    assert!((fix(3).velocity - Vector3::new(0.0, 20.0, 0.0)).norm() < 1e-12);
    // the session begins at the first fix and has the fixes of the file
    assert!((fix(2).position.lon / DEG - (7.0 + 2.0 * 2.537e-4)).abs() < 1e-12);
    // counts are turned from right-forward-up to forward-right-down
    let increment = s.increments()[7];
    assert!((increment.dtheta.z + 0.0023 * DEG * 0.01).abs() < 2e-9);
    assert!((increment.dv.z + 0.0981).abs() < 2e-8);
    let end = free_inertial(&s, &s.increments(), s.reference[0], 0, 5).position[5];
    // the made samples lack the Coriolis acceleration of 2 mm/s2 and the rotation of the Earth
    assert!(end.xy().norm() < 0.3, "{end}");
}

#[test]
fn increments_at_rest_need_only_a_site() {
    let header = r#"
[imu]
file = "imu.csv"
separator = ";"
names = false
time = { column = "1", unit = "s" }
gyro = { columns = ["2", "3", "4"], unit = "arcsec" }
accel = { columns = ["5", "6", "7"], unit = "m/s" }
axes = "x y z"
[start]
standstill_s = 90
latitude_deg = 34.0
longitude_deg = 108.0
height_m = 380.0
"#;
    let rows: String = (0..10_000)
        .map(|k| {
            format!(
                "{:.3};0.25;0;-0.5;0;0.001;-0.049\n",
                50.0 + 0.005 * f64::from(k)
            )
        })
        .collect();
    let folder = Folder::new(header, &rows, "");
    assert!(
        folder
            .complaint()
            .starts_with("in.toml: 'time' covers 50 s, all of it within the standstill of 90 s")
    );
    let rows: String = (0..20_000)
        .map(|k| {
            format!(
                "{:.3};0.25;0;-0.5;0;0.001;-0.049\n",
                50.0 + 0.005 * f64::from(k)
            )
        })
        .collect();
    let s = load(&Folder::new(header, &rows, "").header()).unwrap();
    assert_eq!(
        (s.epochs(), s.counts.len(), s.standstill),
        (100, 20_000, 90)
    );
    let sum: i64 = s.counts.iter().map(|c| i64::from(c.dtheta[2])).sum();
    let want = -0.5 * host_core::inertial::units::ARCSEC / 1e-9 * 20_000.0;
    assert!((sum as f64 - want).abs() <= 1.0, "{sum} {want}");
    assert_eq!(s.fixes[99].unwrap().velocity, Vector3::zeros());
    // the motion of a lost increment is that of its neighbours
    let lost = rows.replace("50.050;0.25;0;-0.5;0;0.001;-0.049\n", "");
    let s = load(&Folder::new(header, &lost, "").header()).unwrap();
    let bridged: i64 = s.counts.iter().map(|c| i64::from(c.dtheta[2])).sum();
    assert!((bridged as f64 - want).abs() <= 1.0, "{bridged} {want}");
}

#[test]
fn fixes_may_be_in_the_file_of_the_samples_and_lack_a_velocity() {
    let header = MOVING
        .replace(
            "file = \"gnss.txt\"\nseparator = \"blank\"\nnames = false\n",
            "",
        )
        .replace(
            "velocity = { columns = [\"5\", \"6\", \"7\"], unit = \"m/s\", order = \"enu\" }\n",
            "",
        );
    let gnss_at = header.find("[gnss]").unwrap();
    let (first, second) = header.split_at(gnss_at);
    let second = second
        .replace("\"1\", unit = \"s\"", "\"t\", unit = \"ms\"")
        .replace("\"2\"", "\"lat\"")
        .replace("\"3\"", "\"lon\"")
        .replace("\"4\"", "\"h\"");
    let header = format!("{first}{second}");
    let mut rows = String::new();
    for (k, line) in imu(501).lines().enumerate() {
        let fix = match k {
            0 => ",lat,lon,h".to_owned(),
            _ if k % 100 == 51 => format!(",45,{:.9},80", 7.0 + 2.537e-6 * (k - 1) as f64),
            _ => ",,,".to_owned(),
        };
        rows += &format!("{line}{fix}\n");
    }
    let s = load(&Folder::new(&header, &rows, "").header()).unwrap();
    assert_eq!(s.epochs(), 4);
    let fix = s.fixes[2].unwrap();
    assert!(fix.has(0..3) && !fix.has(3..4));
    let velocity = s.reference[2].velocity;
    assert!((velocity.y - 20.0).abs() < 0.02, "{velocity}");
    let half = rows.replacen(",45,", ",,", 1);
    let why = Folder::new(&header, &half, "").complaint();
    assert!(
        why.starts_with("imu.csv:52: column 'lat': 'NaN' is missing"),
        "{why}"
    );
    let level = rows.replacen(",80\n", ",\n", 1);
    let s = load(&Folder::new(&header, &level, "").header()).unwrap();
    let fix = s.fixes[0].unwrap();
    assert!(fix.has(0..2) && !fix.has(2..3));
    assert_eq!(s.reference[0].position.h, 80.0);
}

/// The same vector in four ways: named axes, a matrix, angles after axes, the unit's mounting.
#[test]
fn a_mounting_is_given_in_several_ways() {
    let first = |axes: &str, top: &str| {
        let header = top.to_owned() + &MOVING.replace("axes = \"y x -z\"", axes);
        let folder = Folder::new(
            &header,
            &imu(601).replace(",0,0,1.", ",0.1,0.2,1."),
            &gnss(6),
        );
        let unit = host_unit::Unit {
            mounting: host_unit::mounting::Mounting {
                axes: Some("y x -z".into()),
                ..Default::default()
            },
            ..host_unit::Unit::default()
        };
        let text = unit.to_text("made by a test").unwrap();
        std::fs::write(folder.0.path().join("u.toml"), text).unwrap();
        read(&folder.header(), &[]).unwrap().samples[9].dv
    };
    let named = first("axes = \"y x -z\"", "");
    assert!(named.z < -9.0 && named.x > 1.9 && named.y > 0.9, "{named}");
    for (axes, top) in [
        ("mounting = \"y x -z\"", ""),
        ("mounting = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]", ""),
        ("axes = \"x -y -z\"\nmounting = { heading_deg = 90.0 }", ""),
        ("", "unit = \"u.toml\"\n"),
    ] {
        let given = first(axes, top);
        assert!((given - named).norm() < 1e-9, "{axes}: {given} {named}");
    }
}

#[test]
fn a_truth_of_its_own_judges_and_its_columns_are_those_of_the_fixes_or_named() {
    let truth = |k: usize| format!("{},45.1,{:.9},90,1,2,3", 1000.0 + 0.5 * k as f64, 7.0);
    let plain: String = (0..20).map(|k| truth(k) + "\n").collect();
    let named = format!("t_s,lat_deg,lon_deg,height_m,v_north_mps,v_east_mps,v_down_mps\n{plain}");
    let columns = r#"[truth]
file = "truth.csv"
names = false
time = { column = "1", unit = "s" }
latitude = { column = "2", unit = "deg" }
longitude = { column = "3", unit = "deg" }
height = { column = "4", unit = "m" }
velocity = { columns = ["5", "6", "7"], unit = "m/s", order = "ned" }
"#;
    for (top, text) in [("truth = \"truth.csv\"\n", &named), (columns, &plain)] {
        let folder = Folder::new(&format!("{top}{MOVING}"), &imu(601), &gnss(6));
        std::fs::write(folder.0.path().join("truth.csv"), text).unwrap();
        let s = load(&folder.header()).unwrap();
        assert!((s.reference[2].position.lat / DEG - 45.1).abs() < 1e-12);
        assert_eq!(s.reference[2].velocity, Vector3::new(1.0, 2.0, 3.0));
        assert!((s.fixes[2].unwrap().position.lat / DEG - 45.0).abs() < 1e-12);
        assert!(s.unjudged.is_empty());
    }
    let folder = Folder::new(
        &format!("truth = \"truth.csv\"\n{MOVING}"),
        &imu(601),
        &gnss(6),
    );
    std::fs::write(folder.0.path().join("truth.csv"), "a,b\n1,2\n").unwrap();
    let why = folder.complaint();
    assert!(
        why.starts_with("in.toml: 'truth.time' names column '1'"),
        "{why}"
    );
}

/// A given offset moves the fixes and the truth, and fixes lack what their lines lack.
#[test]
fn fixes_move_by_the_given_offset() {
    let header = MOVING
        .replace(
            "[gnss]",
            "[gnss]\ntime_offset_s = 2.5\nlever_arm_m = [1.0, -0.5, -2]",
        )
        .replace("\"5\", \"6\", \"7\"", "\"5\", \"6\"");
    let folder = Folder::new(&header, &imu(1001), &gnss(6));
    let record = read(&folder.header(), &[]).unwrap();
    assert!((record.fixes[0].time - 1003.0).abs() < 1e-9);
    assert_eq!(record.given_offset_s, Some(2.5));
    assert_eq!(record.lever_arm_m, Some([1.0, -0.5, -2.0]));
    assert!(record.fixes[0].has(3..5) && !record.fixes[0].has(5..6));
    assert_eq!(record.fixes[0].velocity[1], 20.0);
    let s = record.session().unwrap();
    assert_eq!(
        (s.lever_arm, s.reference_arm),
        (Vector3::new(1.0, -0.5, -2.0), s.lever_arm)
    );
}

/// `--truth` replaces the file that the header names, and keeps the columns that it names.
#[test]
fn another_truth_replaces_that_of_the_header() {
    let dir = tempfile::tempdir().unwrap();
    let mut record = crate::recordings::record::Record::from_session(
        &test_bench::recordings::simulated(5.0, 20.0, 1),
    );
    record.initial_attitude = None;
    super::write(&record, None, dir.path()).unwrap();
    let at = |name: &str| dir.path().join(name);
    let track = |height: f64| -> String {
        let row = |k: i32| format!("{k};45.0;7.0;{height}\n");
        "when;la;lo;up\n".to_owned() + &(0..20).map(row).collect::<String>()
    };
    std::fs::write(at("a.txt"), track(100.0)).unwrap();
    std::fs::write(at("b.txt"), track(200.0)).unwrap();
    let header = std::fs::read_to_string(at("header.toml")).unwrap();
    let truth = "[truth]\nfile = 'a.txt'\nseparator = ';'\ntime_offset_s = 3\n\
                 time = { column = 'when', unit = 's' }\n\
                 latitude = { column = 'la', unit = 'deg' }\n\
                 longitude = { column = 'lo', unit = 'deg' }\n\
                 height = { column = 'up', unit = 'm' }\n";
    std::fs::write(at("header.toml"), format!("{truth}{header}")).unwrap();
    let height = |record: &Record| {
        let truth = record.truth.as_ref().unwrap();
        (truth.span(), truth.at(10.0).position.h)
    };
    let named = read(&at("header.toml"), &[]).unwrap();
    let given = read_with_truth(&at("header.toml"), &[], Some(&at("b.txt"))).unwrap();
    assert_eq!(height(&named), (Some((3.0, 22.0)), 100.0));
    assert_eq!(height(&given), (Some((3.0, 22.0)), 200.0));
    // with fixes from elsewhere, too
    let beside = samples(&at("header.toml"), &[], Some(&at("b.txt"))).unwrap();
    assert_eq!(height(&beside), height(&given));
    let why = read_with_truth(&at("header.toml"), &[], Some(&at("c.txt"))).unwrap_err();
    assert!(why.to_string().contains("c.txt: no such file"), "{why}");
}

/// The line of names is the one with the names of the header, wherever it is; a mark of a comment
/// before it does not matter, unless the header names it.
#[test]
fn the_line_of_names_is_found() {
    let text = imu(601);
    for (before, mark, header) in [
        ("", "", MOVING.to_owned()),
        (
            "logger 7, serial 12\n\n# a comment\n",
            "",
            MOVING.to_owned(),
        ),
        ("% x\n", "# ", MOVING.to_owned()),
        ("", "#", MOVING.replace("\"t\"", "\"#t\"")),
        (
            "a\nb\n",
            "",
            MOVING.replace("axes =", "skip_lines = 2\naxes ="),
        ),
    ] {
        // the time is the first column
        let lines: String = text
            .lines()
            .map(|line| {
                let mut cells: Vec<&str> = line.split(',').collect();
                cells.swap(0, 1);
                cells.join(",") + "\n"
            })
            .collect();
        let file = format!("{before}{mark}{lines}");
        let folder = Folder::new(&header, &file, &gnss(6));
        let record = read(&folder.header(), &[]);
        let record = record.unwrap_or_else(|why| panic!("{before}{mark}: {why}"));
        assert_eq!(record.time.len(), 601);
    }
    let header = MOVING.replace("axes =", "skip_lines = 700\naxes =");
    let why = Folder::new(&header, &text, &gnss(6)).complaint();
    assert!(
        why.starts_with("in.toml: 'imu.skip_lines' is 700, and imu.csv has fewer"),
        "{why}"
    );
}

/// A logger that writes all values with every sample holds each fix until the next one.
#[test]
fn fixes_that_are_held_count_once() {
    let held: String = gnss(20)
        .lines()
        .flat_map(|line| {
            let (time, rest) = line.split_once(' ').unwrap();
            let time: f64 = time.parse().unwrap();
            (0..5).map(move |k| format!("{:.1} {rest}\n", time + 0.2 * f64::from(k)))
        })
        .collect();
    let of = |fixes: &str| read(&Folder::new(MOVING, &imu(2001), fixes).header(), &[]).unwrap();
    let (once, held) = (of(&gnss(20)), of(&held));
    assert_eq!(once.fixes, held.fixes);
    let notes = held.notes.join(" ");
    let told = notes.contains("80 lines") && notes.contains("those of the line before");
    assert!(told, "{notes}");
    // a receiver that stands and repeats its position is believed
    let still = |k: usize| format!("{:.1}  45.0 7.0 80 0 0 0\n", 1000.5 + k as f64);
    let still: String = (0..20).map(still).collect();
    assert_eq!(of(&still).fixes.len(), 20);
}

/// Lines that hold no fix, by a column of the header or by their names.
#[test]
fn columns_that_say_that_there_is_no_fix_are_heeded() {
    let fixes = |kind: &[&str]| -> String {
        let lines = gnss(kind.len());
        let lines = lines.lines().zip(kind);
        lines
            .map(|(line, kind)| format!("{line} {kind}\n"))
            .collect()
    };
    let valid = MOVING.replace(
        "[gnss]",
        "[gnss]\nvalid = [{ column = \"8\", least = 3, most = 6 }]",
    );
    let record = |header: &str, kind: &[&str]| {
        read(&Folder::new(header, &imu(601), &fixes(kind)).header(), &[])
    };
    let kinds = ["0", "2", "3", "6", "7", ""];
    let found = record(&valid, &kinds[..5]).unwrap();
    assert_eq!(found.fixes.len(), 2);
    let notes = found.notes.join(" ");
    for part in ["'8' is 0", "'8' is 2", "'8' is 7"] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
    let why = record(&valid, &["0", "0"]).unwrap_err().to_string();
    assert!(why.contains("'gnss' holds no fix: '8' is 0"), "{why}");
    // a column without a known name says nothing
    assert_eq!(record(MOVING, &kinds[..5]).unwrap().fixes.len(), 5);
}
